// Averages of rows along columns, and the largest neighbourhood that is still even. An invocation has SPAN neighbours of one column.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "tonemap/tonemap.glsl"

layout(local_size_x = 64) in;

// 1: only spans with an important pixel are worked on.
layout(constant_id = 0) const uint HAS_MAP = 0;

layout(binding = 0) uniform sampler2D luminance;
#include "tonemap/search.glsl"
layout(binding = 1, scalar) readonly buffer Search { TonemapSearch search; };
layout(binding = 2, scalar) uniform Kernels { TonemapKernels kernels; };
layout(binding = 3) uniform sampler2D rows;
layout(binding = 4, scalar) readonly buffer Statistics { TonemapStatistics statistics; };
layout(binding = 5, r32f) uniform writeonly image2D adaptation;
layout(binding = 6) uniform sampler2D importance;
#include "tonemap/span.glsl"

layout(push_constant, scalar) uniform Push {
    int first;   // row in `rows`
    int count;   // of rows in `rows`
    int begin;   // rows that come out
    int end;
    uint groups;
    int radius[6];  // largest of each group
};

void main() {
    ivec2 extent = textureSize(luminance, 0);
    ivec2 pixel = ivec2(int(gl_GlobalInvocationID.x), int(gl_GlobalInvocationID.y) * SPAN + begin);
    if (pixel.x >= extent.x || pixel.y >= end) {
        return;
    }
    if (HAS_MAP != 0u) {
        float most = 0.0;
        for (int y = pixel.y; y < min(pixel.y + SPAN, end); ++y) {
            most = max(most, texelFetch(importance, ivec2(pixel.x, y), 0).r);
        }
        if (most == 0.0) {
            return;
        }
    }
    float found[4 * TONEMAP_GROUPS][SPAN];
    for (uint group = 0u; group < groups; ++group) {
        vec4 sum[SPAN];
        [[unroll]] for (int k = 0; k < SPAN; ++k) {
            sum[k] = vec4(0.0);
        }
        int base = int(group) * count - first;
        for (int start = -radius[group]; start < radius[group] + SPAN; start += SPAN) {
            vec4 samples[SPAN];
            [[unroll]] for (int a = 0; a < SPAN; ++a) {
                // A last band's span may go beyond the rows that are there, for pixels that are not.
                int row = min(clamp(pixel.y + start + a, 0, extent.y - 1), first + count - 1);
                samples[a] = texelFetch(rows, ivec2(pixel.x, base + row), 0);
            }
            SPAN_ADD(group, start, samples, sum)
        }
        [[unroll]] for (int k = 0; k < SPAN; ++k) {
            [[unroll]] for (uint i = 0u; i < 4u; ++i) {
                found[4u * group + i][k] = sum[k][i];
            }
        }
    }
    float level[SPAN];
    bool even[SPAN];
    [[unroll]] for (int k = 0; k < SPAN; ++k) {
        level[k] = found[search.centre[0]][k];
        even[k] = true;
    }
    for (uint i = 0u; i < search.steps; ++i) {
        uint centre = search.centre[i];
        uint surround = search.surround[i];
        float offset = search.offset[i] * statistics.log_average;
        [[unroll]] for (int k = 0; k < SPAN; ++k) {
            float c = found[centre][k];
            even[k] = even[k] && abs(c - found[surround][k]) < search.slope * c + offset;
            level[k] = even[k] ? c : level[k];
        }
    }
    [[unroll]] for (int k = 0; k < SPAN; ++k) {
        if (pixel.y + k < end) {
            imageStore(adaptation, pixel + ivec2(0, k), vec4(level[k]));
        }
    }
}
