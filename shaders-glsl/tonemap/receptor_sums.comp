// Sums of the channels over the pixels of a rectangle. They are of integers, as those of luminance.comp, which has found the largest luminance.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/tonemap.glsl"
#include "tonemap/receptor.glsl"

layout(local_size_x = 64) in;

layout(binding = 0) uniform sampler2D color;
layout(binding = 1, scalar) readonly buffer Sums {
    uint least;
    uint largest;
    uint log_low;
    uint log_high;
    uint lit;
} sums;
layout(binding = 2, scalar) buffer Receptor { TonemapReceptor receptor; };

layout(push_constant, scalar) uniform Push {
    ivec2 first;  // of the rectangle
    ivec2 last;   // of the rectangle, inside
    float exposure;
};

shared uvec2 columns[3][64];

uvec2 add64(uvec2 a, uvec2 b) {
    uint carry;
    uint low = uaddCarry(a.x, b.x, carry);
    return uvec2(low, a.y + b.y + carry);
}

void main() {
    uint lane = gl_LocalInvocationIndex;
    ivec2 pixel = first + ivec2(gl_GlobalInvocationID.x, gl_GlobalInvocationID.y * TONEMAP_ROWS);
    float unit = receptor_unit(uintBitsToFloat(sums.largest));
    uvec3 upper = uvec3(0u);
    uvec3 lower = uvec3(0u);
    if (pixel.x <= last.x) {
        int end = min(pixel.y + int(TONEMAP_ROWS), last.y + 1);
        for (; pixel.y < end; ++pixel.y) {
            precise vec3 exposed = exposure * tonemap_clean(texelFetch(color, pixel, 0).rgb);
            precise vec3 units = exposed / unit;
            precise vec3 large = floor(units / 65536.0);
            upper += uvec3(large);
            lower += uvec3(units - 65536.0 * large + 0.5);
        }
    }
    for (int i = 0; i < 3; ++i) {
        columns[i][lane] = add64(uvec2(upper[i] << 16, upper[i] >> 16), uvec2(lower[i], 0u));
    }
    barrier();
    for (uint step = 1u; step < 64u; step *= 8u) {
        if (lane % (8u * step) == 0u) {
            for (uint i = lane + step; i < lane + 8u * step; i += step) {
                for (int c = 0; c < 3; ++c) {
                    columns[c][lane] = add64(columns[c][lane], columns[c][i]);
                }
            }
        }
        barrier();
    }
    if (lane < 3u) {
        uvec2 sum = columns[lane][0];
        uint before = atomicAdd(receptor.low[lane], sum.x);
        uint carry = before + sum.x < before ? 1u : 0u;
        atomicAdd(receptor.high[lane], sum.y + carry);
    }
}
