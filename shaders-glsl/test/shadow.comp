// The shadow factor of light 0 at given points.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/shadow.glsl"
layout(local_size_x = 64) in;
struct ShadowProbe { vec3 world; vec3 normal; float factor; };
layout(binding = 0, scalar) buffer Probes { ShadowProbe probes[]; };
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= probes.length()) return;
    probes[i].factor = shadow_factor(light(0u), probes[i].world, probes[i].normal);
}
