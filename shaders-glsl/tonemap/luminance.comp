// Luminance of every pixel, and minimum, maximum and sum of logarithms over those of a rectangle. The sums are of integers, so that
// neither the order of work nor a division into tiles can change them.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/tonemap.glsl"

// An invocation has a column of TONEMAP_ROWS pixels.
layout(local_size_x = 64) in;
// The logarithms of so many pixels have a sum of 32 bits.
const int PART = 16;

layout(binding = 0) uniform sampler2D color;
layout(binding = 1, r32f) uniform writeonly image2D luminance;
layout(binding = 2, scalar) buffer Sums {
    uint least;        // bits of a float that is not negative: they are ordered as it is
    uint largest;
    uint log_low;      // sum of (152 + log2(1e-6 + L)) · 2^20 over pixels that are not black, 64 bits
    uint log_high;
    uint lit;          // their number
} sums;

layout(push_constant, scalar) uniform Push {
    ivec2 first;  // of the rectangle
    ivec2 last;   // of the rectangle, inside
    float exposure;  // factor
};

shared uint group_least[64];
shared uint group_largest[64];
shared uvec2 group_sum[64];
shared uint group_lit[64];

uvec2 add64(uvec2 a, uvec2 b) {
    uint carry;
    uint low = uaddCarry(a.x, b.x, carry);
    return uvec2(low, a.y + b.y + carry);
}

void main() {
    ivec2 extent = imageSize(luminance);
    uint lane = gl_LocalInvocationIndex;
    ivec2 pixel = ivec2(gl_GlobalInvocationID.x, gl_GlobalInvocationID.y * TONEMAP_ROWS);
    uint least = 0xFFFFFFFFu;
    uint largest = 0u;
    uvec2 sum = uvec2(0u);
    uint lit = 0u;
    if (pixel.x < extent.x) {
        int end = min(pixel.y + int(TONEMAP_ROWS), extent.y);
        uint part = 0u;
        for (; pixel.y < end; ++pixel.y) {
            if (pixel.y % PART == 0) {
                sum = add64(sum, uvec2(part, 0u));
                part = 0u;
            }
            precise vec3 exposed = exposure * tonemap_clean(texelFetch(color, pixel, 0).rgb);
            float l = tonemap_luminance(exposed);
            imageStore(luminance, pixel, vec4(l));
            if (all(greaterThanEqual(pixel, first)) && all(lessThanEqual(pixel, last))) {
                uint bits = floatBitsToUint(l);
                least = min(least, bits);
                largest = max(largest, bits);
                if (bits != 0u) {
                    int fixed_log = int(roundEven(log2(1e-6 + l) * 1048576.0));
                    part += uint(fixed_log + (152 << 20));
                    ++lit;
                }
            }
        }
        sum = add64(sum, uvec2(part, 0u));
    }
    group_least[lane] = least;
    group_largest[lane] = largest;
    group_sum[lane] = sum;
    group_lit[lane] = lit;
    barrier();
    // Eight by eight: few barriers, which CPUs wait long at.
    for (uint step = 1u; step < 64u; step *= 8u) {
        if (lane % (8u * step) == 0u) {
            for (uint i = lane + step; i < lane + 8u * step; i += step) {
                group_least[lane] = min(group_least[lane], group_least[i]);
                group_largest[lane] = max(group_largest[lane], group_largest[i]);
                group_sum[lane] = add64(group_sum[lane], group_sum[i]);
                group_lit[lane] += group_lit[i];
            }
        }
        barrier();
    }
    if (lane == 0u && group_least[0] != 0xFFFFFFFFu) {
        atomicMin(sums.least, group_least[0]);
        atomicMax(sums.largest, group_largest[0]);
        uint low = group_sum[0].x;
        uint before = atomicAdd(sums.log_low, low);
        uint carry = before + low < before ? 1u : 0u;
        atomicAdd(sums.log_high, group_sum[0].y + carry);
        atomicAdd(sums.lit, group_lit[0]);
    }
}
