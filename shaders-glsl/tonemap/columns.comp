// Averages of rows along columns, and the largest neighbourhood that is still even. An invocation has SPAN neighbours of one column.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/tonemap.glsl"

layout(local_size_x = 64) in;
const int SPAN = 8;

layout(constant_id = 0) const uint GROUPS = 4;
layout(constant_id = 1) const uint RADIUS_0 = 4;
layout(constant_id = 2) const uint RADIUS_1 = 8;
layout(constant_id = 3) const uint RADIUS_2 = 14;
layout(constant_id = 4) const uint RADIUS_3 = 20;
layout(constant_id = 5) const uint RADIUS_4 = 0;
layout(constant_id = 6) const uint RADIUS_5 = 0;

layout(binding = 0) uniform sampler2D luminance;
#include "lib/tonemap_search.glsl"
layout(binding = 1, scalar) readonly buffer Search { TonemapSearch search; };
layout(binding = 2, scalar) readonly buffer Weights { vec4 weights[]; };
layout(binding = 3, scalar) readonly buffer Rows { vec4 rows[]; };
layout(binding = 4, scalar) readonly buffer Statistics { TonemapStatistics statistics; };
layout(binding = 5, r32f) uniform writeonly image2D adaptation;

layout(push_constant, scalar) uniform Push {
    int first;   // row in `rows`
    int count;   // of rows in `rows`
    int begin;   // rows that come out
    int end;
};

float found[SPAN][4 * TONEMAP_GROUPS];

void average(uint group, int radius, ivec2 pixel, ivec2 extent) {
    vec4 sum[SPAN];
    for (int k = 0; k < SPAN; ++k) {
        sum[k] = vec4(0.0);
    }
    int base = (int(group) * count - first) * extent.x + pixel.x;
    for (int t = -radius; t < radius + SPAN; ++t) {
        // A last band's span may go beyond the rows that are there, for pixels that are not.
        int row = min(clamp(pixel.y + t, 0, extent.y - 1), first + count - 1);
        vec4 v = rows[base + row * extent.x];
        for (int k = 0; k < SPAN; ++k) {
            sum[k] += weights[group * TONEMAP_STRIDE + uint(abs(t - k))] * v;
        }
    }
    for (int k = 0; k < SPAN; ++k) {
        found[k][4u * group] = sum[k].x;
        found[k][4u * group + 1u] = sum[k].y;
        found[k][4u * group + 2u] = sum[k].z;
        found[k][4u * group + 3u] = sum[k].w;
    }
}

void main() {
    ivec2 extent = textureSize(luminance, 0);
    ivec2 pixel = ivec2(int(gl_GlobalInvocationID.x), int(gl_GlobalInvocationID.y) * SPAN + begin);
    if (pixel.x >= extent.x || pixel.y >= end) {
        return;
    }
    average(0u, int(RADIUS_0), pixel, extent);
    if (GROUPS > 1u) { average(1u, int(RADIUS_1), pixel, extent); }
    if (GROUPS > 2u) { average(2u, int(RADIUS_2), pixel, extent); }
    if (GROUPS > 3u) { average(3u, int(RADIUS_3), pixel, extent); }
    if (GROUPS > 4u) { average(4u, int(RADIUS_4), pixel, extent); }
    if (GROUPS > 5u) { average(5u, int(RADIUS_5), pixel, extent); }
    for (int k = 0; k < SPAN && pixel.y + k < end; ++k) {
        float level = found[k][search.centre[0]];
        for (uint i = 0u; i < search.steps; ++i) {
            float c = found[k][search.centre[i]];
            float s = found[k][search.surround[i]];
            if (!(abs(c - s) < search.slope * c + search.offset[i] * statistics.log_average)) {
                break;
            }
            level = c;
        }
        imageStore(adaptation, pixel + ivec2(0, k), vec4(level));
    }
}
