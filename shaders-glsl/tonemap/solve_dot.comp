// Products of two images (or the first alone, or squared differences), summed over columns of TONEMAP_DOT_ROWS pixels and over groups in a fixed order.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/solve.glsl"

layout(local_size_x = 64) in;

// 0: the first image. 1: its product with the second. 2: the square of their difference.
layout(constant_id = 0) const uint PRODUCT = 1;

layout(binding = 0) uniform sampler2D one;
layout(binding = 1) uniform sampler2D two;
layout(binding = 2, scalar) readonly buffer Solve { TonemapSolve solve; };
layout(binding = 3, scalar) writeonly buffer Sums { float sums[]; };

shared float columns[64];

void main() {
    if (solve.done != 0u) return;
    uint lane = gl_LocalInvocationIndex;
    ivec2 extent = textureSize(one, 0);
    ivec2 at = ivec2(gl_GlobalInvocationID.x, gl_GlobalInvocationID.y * TONEMAP_DOT_ROWS);
    precise float sum = 0.0;
    if (at.x < extent.x) {
        int end = min(at.y + int(TONEMAP_DOT_ROWS), extent.y);
        for (; at.y < end; ++at.y) {
            float value = texelFetch(one, at, 0).r;
            float other = texelFetch(two, at, 0).r;
            sum += PRODUCT == 1u ? value * other : PRODUCT == 2u ? (value - other) * (value - other) : value;
        }
    }
    columns[lane] = sum;
    barrier();
    for (uint step = 1u; step < 64u; step *= 8u) {
        if (lane % (8u * step) == 0u) {
            precise float group = columns[lane];
            for (uint i = lane + step; i < lane + 8u * step; i += step) {
                group += columns[i];
            }
            columns[lane] = group;
        }
        barrier();
    }
    if (lane == 0u) {
        sums[gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x] = columns[0];
    }
}
