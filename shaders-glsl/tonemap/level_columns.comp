// Averages of rows along columns of a level of the pyramid. An invocation has SPAN neighbours of one column.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "lib/tonemap_kernels.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Rows { float rows[]; };  // a plane for each Gaussian
layout(binding = 1, scalar) uniform Kernels { TonemapKernels kernels; };
layout(binding = 2, scalar) writeonly buffer Averages { float averages[]; };  // the same

#include "lib/tonemap_span.glsl"

layout(push_constant, scalar) uniform Push {
    ivec2 size;  // of the level
    uint groups;
    int radius[6];  // largest of each group
};

void main() {
    ivec2 pixel = ivec2(int(gl_GlobalInvocationID.x), int(gl_GlobalInvocationID.y) * SPAN);
    if (any(greaterThanEqual(pixel, size))) {
        return;
    }
    int plane = size.x * size.y;
    for (uint group = 0u; group < groups; ++group) {
        vec4 sum[SPAN];
        [[unroll]] for (int k = 0; k < SPAN; ++k) {
            sum[k] = vec4(0.0);
        }
        int base = int(group) * 4 * plane + pixel.x;
        for (int start = -radius[group]; start < radius[group] + SPAN; start += SPAN) {
            vec4 samples[SPAN];
            [[unroll]] for (int a = 0; a < SPAN; ++a) {
                int from = base + clamp(pixel.y + start + a, 0, size.y - 1) * size.x;
                samples[a] = vec4(rows[from], rows[from + plane], rows[from + 2 * plane], rows[from + 3 * plane]);
            }
            SPAN_ADD(group, start, samples, sum)
        }
        [[unroll]] for (int k = 0; k < SPAN; ++k) {
            if (pixel.y + k < size.y) {
                int to = base + (pixel.y + k) * size.x;
                [[unroll]] for (int i = 0; i < 4; ++i) {
                    averages[to + i * plane] = sum[k][i];
                }
            }
        }
    }
}
