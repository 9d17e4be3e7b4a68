// Averages along rows, of all Gaussians, of a band of rows. An invocation has SPAN neighbours of one row, so that a sample is loaded once
// for all of them and for four Gaussians.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D luminance;
#include "tonemap/search.glsl"
layout(binding = 1, scalar) uniform Kernels { TonemapKernels kernels; };
layout(binding = 2, rgba32f) uniform writeonly image2D rows;  // row of the band + group · rows of the band
#include "tonemap/span.glsl"

layout(push_constant, scalar) uniform Push {
    int first;  // row of the band
    int count;  // of rows
    uint groups;
    int radius[6];  // largest of each group
};

void main() {
    int width = textureSize(luminance, 0).x;
    ivec2 pixel = ivec2(int(gl_GlobalInvocationID.x) * SPAN, int(gl_GlobalInvocationID.y) + first);
    if (pixel.x >= width || pixel.y >= first + count) {
        return;
    }
    for (uint group = 0u; group < groups; ++group) {
        vec4 sum[SPAN];
        [[unroll]] for (int k = 0; k < SPAN; ++k) {
            sum[k] = vec4(0.0);
        }
        for (int start = -radius[group]; start < radius[group] + SPAN; start += SPAN) {
            float samples[SPAN];
            [[unroll]] for (int a = 0; a < SPAN; ++a) {
                samples[a] = texelFetch(luminance, ivec2(clamp(pixel.x + start + a, 0, width - 1), pixel.y), 0).r;
            }
            SPAN_ADD(group, start, samples, sum)
        }
        int row = pixel.y - first + int(group) * count;
        [[unroll]] for (int k = 0; k < SPAN; ++k) {
            if (pixel.x + k < width) {
                imageStore(rows, ivec2(pixel.x + k, row), sum[k]);
            }
        }
    }
}
