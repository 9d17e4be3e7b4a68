// Vertices of chosen objects, for their matte.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/scene.glsl"

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1, scalar) readonly buffer Instances { Instance instances[]; };
layout(binding = 2, scalar) readonly buffer Visible { uint visible[]; };
layout(binding = 3, scalar) readonly buffer Positions { vec3 positions[]; };

layout(location = 0) out vec3 seen; // position in view space, metres

void main() {
    uint i = visible[gl_InstanceIndex];
    vec4 world = instances[i].world_from_object * vec4(positions[instances[i].first_vertex + uint(gl_VertexIndex)], 1.0);
    gl_Position = view.clip_from_world * world;
    seen = (view.view_from_world * world).xyz;
}
