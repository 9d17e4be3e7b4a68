// Averages along rows, of all Gaussians, of a band of rows. An invocation has SPAN neighbours of one row, so that a sample is loaded once
// for all of them and for four Gaussians.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;
const int SPAN = 8;

layout(constant_id = 0) const uint GROUPS = 4;
layout(constant_id = 1) const uint RADIUS_0 = 4;  // largest of each group
layout(constant_id = 2) const uint RADIUS_1 = 8;
layout(constant_id = 3) const uint RADIUS_2 = 14;
layout(constant_id = 4) const uint RADIUS_3 = 20;
layout(constant_id = 5) const uint RADIUS_4 = 0;
layout(constant_id = 6) const uint RADIUS_5 = 0;

layout(binding = 0) uniform sampler2D luminance;
#include "lib/tonemap_search.glsl"
layout(binding = 1, scalar) readonly buffer Weights { vec4 weights[]; };
layout(binding = 2, scalar) writeonly buffer Rows { vec4 rows[]; };  // [group][row of the band][column]

layout(push_constant, scalar) uniform Push {
    int first;  // row of the band
    int count;  // of rows
};

void average(uint group, int radius, ivec2 pixel, int width) {
    vec4 sum[SPAN];
    for (int k = 0; k < SPAN; ++k) {
        sum[k] = vec4(0.0);
    }
    for (int t = -radius; t < radius + SPAN; ++t) {
        float l = search_clamped(pixel + ivec2(t, 0));
        for (int k = 0; k < SPAN; ++k) {
            // Zero beyond the radius.
            sum[k] += weights[group * TONEMAP_STRIDE + uint(abs(t - k))] * l;
        }
    }
    int base = (int(group) * count + pixel.y - first) * width + pixel.x;
    for (int k = 0; k < SPAN; ++k) {
        if (pixel.x + k < width) {
            rows[base + k] = sum[k];
        }
    }
}

void main() {
    int width = textureSize(luminance, 0).x;
    ivec2 pixel = ivec2(int(gl_GlobalInvocationID.x) * SPAN, int(gl_GlobalInvocationID.y) + first);
    if (pixel.x >= width || pixel.y >= first + count) {
        return;
    }
    average(0u, int(RADIUS_0), pixel, width);
    if (GROUPS > 1u) { average(1u, int(RADIUS_1), pixel, width); }
    if (GROUPS > 2u) { average(2u, int(RADIUS_2), pixel, width); }
    if (GROUPS > 3u) { average(3u, int(RADIUS_3), pixel, width); }
    if (GROUPS > 4u) { average(4u, int(RADIUS_4), pixel, width); }
    if (GROUPS > 5u) { average(5u, int(RADIUS_5), pixel, width); }
}
