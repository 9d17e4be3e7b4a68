// A layer of the picture so far, from the sums over samples. `Sums::layers` computes the same on the host.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "reference/path_sums_at.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, rgba32f) uniform writeonly image2D shown;

layout(push_constant, scalar) uniform Push {
    uint shows;    // SHOWS_
    float samples; // of every pixel, at least 1
    float epsilon; // added to the square of the luminance in relative errors
    uvec2 sums_at; // address
};

// Depth of the background, metres.
const float BACKGROUND = 1e10;

vec4 sum_of(ivec2 pixel, uint layer) {
    ivec2 size = imageSize(shown);
    uint at = uint(pixel.y * size.x + pixel.x);
    uint each = uint(size.x * size.y);
    vec4 high = SUM_AT(sums_at, layer * each + at);
    return layer < PATH_EXACT_SUMS ? high + SUM_AT(sums_at, (layer + PATH_SUMS) * each + at) : high;
}

vec3 mean_of(ivec2 pixel, uint layer) {
    return sum_of(pixel, layer).rgb / samples;
}

// Variance of the mean luminance; the same relative to the square of the luminance.
vec2 variance_of(ivec2 pixel) {
    if (samples < 2.0) return vec2(0.0);
    float mean = sum_of(pixel, 0u).a / samples;
    float spread = max(sum_of(pixel, 1u).a / samples - mean * mean, 0.0);
    float variance = spread / (samples - 1.0);
    return vec2(variance, variance / (mean * mean + epsilon));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(shown)))) return;
    float met = sum_of(pixel, 2u).a; // samples that hit a surface
    vec3 value = vec3(0.0);
    if (shows == SHOWS_TOTAL) {
        value = mean_of(pixel, 0u) + mean_of(pixel, 1u) + mean_of(pixel, 2u);
    } else if (shows == SHOWS_EMISSION) {
        value = mean_of(pixel, 0u);
    } else if (shows == SHOWS_DIRECT) {
        value = mean_of(pixel, 1u);
    } else if (shows == SHOWS_INDIRECT) {
        value = mean_of(pixel, 2u);
    } else if (shows == SHOWS_ALBEDO) {
        value = mean_of(pixel, 3u);
    } else if (shows == SHOWS_NORMAL) {
        vec3 normal = sum_of(pixel, 4u).rgb;
        value = dot(normal, normal) > 0.0 ? normalize(normal) : vec3(0.0);
    } else if (shows == SHOWS_POSITION) {
        value = sum_of(pixel, 5u).rgb / max(met, 1.0);
    } else if (shows == SHOWS_DEPTH) {
        value = vec3(met > 0.0 ? sum_of(pixel, 3u).a / met : BACKGROUND);
    } else if (shows == SHOWS_SAMPLES) {
        value = vec3(samples);
    } else {
        value = vec3(variance_of(pixel), 0.0);
    }
    imageStore(shown, pixel, vec4(value, 1.0));
}
