// Averages along rows of a level of the pyramid, of all its Gaussians. An invocation has SPAN neighbours of one row.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "lib/tonemap_kernels.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) readonly buffer Level { float level[]; };
layout(binding = 1, scalar) uniform Kernels { TonemapKernels kernels; };
layout(binding = 2, scalar) writeonly buffer Rows { float rows[]; };  // a plane for each Gaussian

#include "lib/tonemap_span.glsl"

layout(push_constant, scalar) uniform Push {
    ivec2 size;  // of the level
    uint groups;
    int radius[6];  // largest of each group
};

void main() {
    ivec2 pixel = ivec2(int(gl_GlobalInvocationID.x) * SPAN, int(gl_GlobalInvocationID.y));
    if (any(greaterThanEqual(pixel, size))) {
        return;
    }
    int line = pixel.y * size.x;
    int plane = size.x * size.y;
    for (uint group = 0u; group < groups; ++group) {
        vec4 sum[SPAN];
        [[unroll]] for (int k = 0; k < SPAN; ++k) {
            sum[k] = vec4(0.0);
        }
        for (int start = -radius[group]; start < radius[group] + SPAN; start += SPAN) {
            float samples[SPAN];
            [[unroll]] for (int a = 0; a < SPAN; ++a) {
                samples[a] = level[line + clamp(pixel.x + start + a, 0, size.x - 1)];
            }
            SPAN_ADD(group, start, samples, sum)
        }
        int to = int(group) * 4 * plane + line + pixel.x;
        [[unroll]] for (int k = 0; k < SPAN; ++k) {
            if (pixel.x + k < size.x) {
                [[unroll]] for (int i = 0; i < 4; ++i) {
                    rows[to + i * plane + k] = sum[k][i];
                }
            }
        }
    }
}
