// Important pixels by the Sobel operator (thesis 4.4.2.2): where the magnitude of the gradient of the luminance is over a
// threshold, and over 1e-4 of the mean luminance around. The kernels are not normalised. Beyond the border the border repeats.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/tonemap.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D luminance;
layout(binding = 1, scalar) readonly buffer Statistics { TonemapStatistics statistics; };
#include "tonemap/importance.glsl"

layout(constant_id = 1) const uint RELATIVE = 0;  // 1: the threshold counts in log-averages of the picture

float at(ivec2 pixel) {
    return texelFetch(luminance, clamp(pixel, ivec2(0), textureSize(luminance, 0) - 1), 0).r;
}

// A quarter of the kernel (1, 2, 1): a mean, which cannot overflow, and scaling by powers of two rounds nothing.
float column(ivec2 p) {
    precise float mean = 0.25 * at(p + ivec2(0, -1)) + 0.5 * at(p) + 0.25 * at(p + ivec2(0, 1));
    return mean;
}

float row(ivec2 p) {
    precise float mean = 0.25 * at(p + ivec2(-1, 0)) + 0.5 * at(p) + 0.25 * at(p + ivec2(1, 0));
    return mean;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(importance)))) return;
    float left = column(pixel - ivec2(1, 0));
    float right = column(pixel + ivec2(1, 0));
    float above = row(pixel - ivec2(0, 1));
    float below = row(pixel + ivec2(0, 1));
    precise float x = right - left;
    precise float y = below - above;
    precise float magnitude = 4.0 * sqrt(x * x + y * y);
    // Of very bright pixels, rounding alone would be over any threshold.
    float mean = 0.25 * left + 0.25 * right + 0.25 * above + 0.25 * below;
    bool over = RELATIVE != 0u ? magnitude > threshold * statistics.frame_log_average : magnitude * statistics.scale > threshold;
    store_importance(pixel, over && magnitude > 1e-4 * mean);
}
