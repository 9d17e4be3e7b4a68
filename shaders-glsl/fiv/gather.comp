// Sums of the chunks of each point, in a fixed order.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "fiv/fiv.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Partials { float partials[]; };
layout(binding = 1, scalar) writeonly buffer Fivs { float fivs[]; };         // nine floats for each point
layout(binding = 2, scalar) writeonly buffer Coverage { float coverage[]; }; // hidden (own: visible) solid angle, sr

layout(push_constant, scalar) uniform Push {
    uint first; // first point
    uint count;
    uint chunks;
    float inside; // hidden solid angle from which on a point lies inside the occluder, sr
    uint own;     // 1: the solid angle is the visible one, and a point that sees no more than `inside` lies inside
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
