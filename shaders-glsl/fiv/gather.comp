// Sums of the chunks of each point, in their order.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/fiv.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Partials { float partials[]; };
layout(binding = 1, scalar) writeonly buffer Fivs { float fivs[]; };         // nine for each point
layout(binding = 2, scalar) writeonly buffer Coverage { float coverage[]; }; // solid angle that is hidden (own: seen), sr

layout(push_constant, scalar) uniform Push {
    uint first; // point
    uint count;
    uint chunks;
    float inside; // a point from which as much is hidden lies inside of the occluder, sr
    uint own;     // 1: it is seen, and a place from which no more is seen lies inside
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    float sums[10];
    for (uint k = 0u; k < 10u; ++k) sums[k] = 0.0;
    for (uint chunk = 0u; chunk < chunks; ++chunk) {
        for (uint k = 0u; k < 10u; ++k) sums[k] += partials[10u * (i * chunks + chunk) + k];
    }
    if (own != 0u ? sums[9] <= inside : sums[9] >= inside) {
        for (uint k = 0u; k < 9u; ++k) sums[k] = FIV_INSIDE;
    }
    for (uint k = 0u; k < 9u; ++k) fivs[9u * (first + i) + k] = sums[k];
    coverage[first + i] = sums[9];
}
