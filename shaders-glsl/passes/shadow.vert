// Opaque casters into one layer of the shadow maps.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"

layout(binding = 1, scalar) readonly buffer Instances { Instance instances[]; };
layout(binding = 2, scalar) readonly buffer Visible { uint visible[]; };
layout(binding = 3, scalar) readonly buffer Positions { vec3 positions[]; };
layout(push_constant, scalar) uniform Push { mat4 clip_from_world; };

void main() {
    uint i = visible[gl_InstanceIndex];
    vec3 at = positions[instances[i].first_vertex + uint(gl_VertexIndex)];
    gl_Position = clip_from_world * (instances[i].world_from_object * vec4(at, 1.0));
}
