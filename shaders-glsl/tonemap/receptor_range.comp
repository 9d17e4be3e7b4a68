// Smallest and largest response over the pixels of a rectangle.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/tonemap.glsl"
#include "tonemap/receptor.glsl"

layout(local_size_x = 64) in;

layout(binding = 0) uniform sampler2D color;
layout(binding = 1, scalar) readonly buffer Statistics { TonemapStatistics statistics; };
layout(binding = 2, scalar) readonly buffer Sums {
    uint least;
    uint largest;
    uint log_low;
    uint log_high;
    uint lit;
} sums;
layout(binding = 3, scalar) buffer Receptor { TonemapReceptor receptor; };

layout(push_constant, scalar) uniform Push {
    TonemapReceptorSettings settings;
    ivec2 first;  // of the rectangle
    ivec2 last;   // of the rectangle, inside
};
#include "tonemap/receptor_response.glsl"

shared float group_least[64];
shared float group_largest[64];

void main() {
    uint lane = gl_LocalInvocationIndex;
    ivec2 pixel = first + ivec2(gl_GlobalInvocationID.x, gl_GlobalInvocationID.y * TONEMAP_ROWS);
    Adapted adapted = receptor_adapted();
    float low = 2.0;
    float high = 0.0;
    if (pixel.x <= last.x) {
        int end = min(pixel.y + int(TONEMAP_ROWS), last.y + 1);
        for (; pixel.y < end; ++pixel.y) {
            vec3 response = receptor_response(settings.exposure * tonemap_clean(texelFetch(color, pixel, 0).rgb), adapted);
            low = min(low, min(response.r, min(response.g, response.b)));
            high = max(high, max(response.r, max(response.g, response.b)));
        }
    }
    group_least[lane] = low;
    group_largest[lane] = high;
    barrier();
    for (uint step = 1u; step < 64u; step *= 8u) {
        if (lane % (8u * step) == 0u) {
            for (uint i = lane + step; i < lane + 8u * step; i += step) {
                group_least[lane] = min(group_least[lane], group_least[i]);
                group_largest[lane] = max(group_largest[lane], group_largest[i]);
            }
        }
        barrier();
    }
    if (lane == 0u && group_least[0] <= 1.0) {
        atomicMin(receptor.least, floatBitsToUint(group_least[0]));
        atomicMax(receptor.largest, floatBitsToUint(group_largest[0]));
    }
}
