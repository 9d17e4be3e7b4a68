// Number of marked samples of each block.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "fiv/online.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Marks { uint marks[]; };
layout(binding = 1, scalar) writeonly buffer Counts { uint counts[]; };

layout(push_constant, scalar) uniform Push { uint blocks; };

shared uint sums[64];

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint block = gl_WorkGroupID.y * FIV_ROW + gl_WorkGroupID.x;
    if (block >= blocks) return;
    sums[lane] = uint(bitCount(marks[FIV_BLOCK_WORDS * block + lane]));
    barrier();
    for (uint step = 32u; step > 0u; step >>= 1u) {
        if (lane < step) sums[lane] += sums[lane + step];
        barrier();
    }
    if (lane == 0u) counts[block] = sums[0];
}
