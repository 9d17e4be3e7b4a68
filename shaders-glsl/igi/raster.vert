// Draws opaque casters into one shadow map of a virtual light.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/vpl.glsl"
#include "lib/sampling.glsl"
#include "igi/vpl_map.glsl"

layout(binding = 1, scalar) readonly buffer Instances { Instance instances[]; };
layout(binding = 2, scalar) readonly buffer Visible { uint visible[]; };
layout(binding = 3, scalar) readonly buffer Positions { vec3 positions[]; };
layout(binding = 4, scalar) readonly buffer Vpls { Vpl vpls[]; };

layout(push_constant, scalar) uniform Push {
    uint light;    // virtual light
    uint face;     // which of the light's three maps
    float nearest; // near plane, metres
};

void main() {
    uint i = visible[gl_InstanceIndex];
    vec3 at = positions[instances[i].first_vertex + uint(gl_VertexIndex)];
    vec3 world = (instances[i].world_from_object * vec4(at, 1.0)).xyz;
    gl_Position = vpl_map_clip(vpls[light], face, nearest, world);
}
