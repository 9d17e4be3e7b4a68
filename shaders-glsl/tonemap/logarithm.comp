// log10 of luminance, of at most four decades below the largest.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/tonemap.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D luminance;
layout(binding = 1, scalar) readonly buffer Statistics { TonemapStatistics statistics; };
layout(binding = 2, r32f) uniform writeonly image2D logarithm;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(logarithm)))) {
        return;
    }
    float least = max(1e-6 * statistics.high, TONEMAP_SMALLEST);
    imageStore(logarithm, pixel, vec4(0.30102999566 * log2(max(texelFetch(luminance, pixel, 0).r, least))));
}
