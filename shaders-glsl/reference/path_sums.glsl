// Sums over samples. The sums of radiance have separate sums of their rounding errors, so that a million samples are as exact as one.
// Each layer has rgb and alpha:
//   0 emission, luminance of the total      3 albedo, distance along the view axis
//   1 direct,   its square                  4 shading normal, number of samples left out as not finite
//   2 indirect, samples that hit a surface  5 position, —

// Before including: reference/path_at.glsl and `settings`.
#include "reference/path_sums_at.glsl"

uint place_of_sum(uvec2 pixel, uint layer) {
    return layer * settings.sum_pixels + (pixel.y - settings.first_row) * settings.extent.x + pixel.x;
}

void add_to_sum(uvec2 pixel, uint layer, vec4 value) {
    uint at = place_of_sum(pixel, layer);
    uint at_error = place_of_sum(pixel, layer + PATH_SUMS);
    vec4 high = SUM_AT(settings.sums_at, at);
    vec4 low = SUM_AT(settings.sums_at, at_error);
    // Two-sum (Knuth), then renormalised: high + low is the sum to 48 bits. `precise` forbids the compiler to simplify the terms.
    precise vec4 sum = high + value;
    precise vec4 back = sum - high;
    precise vec4 rest = (high - (sum - back)) + (value - back);
    precise vec4 error = low + rest;
    precise vec4 total = sum + error;
    precise vec4 left = error - (total - sum);
    SUM_AT(settings.sums_at, at) = total;
    SUM_AT(settings.sums_at, at_error) = left;
}

void add_plainly(uvec2 pixel, uint layer, vec4 value) {
    SUM_AT(settings.sums_at, place_of_sum(pixel, layer)) += value;
}

bool is_number(vec3 v) {
    return !any(isnan(v)) && !any(isinf(v));
}

void add_light(uvec2 pixel, vec3 emission, vec3 direct, vec3 indirect) {
    if (!is_number(emission) || !is_number(direct) || !is_number(indirect)) {
        add_plainly(pixel, 4u, vec4(0.0, 0.0, 0.0, 1.0));
        return;
    }
    vec3 total = emission + direct + indirect;
    float luminance = dot(total, vec3(0.2126, 0.7152, 0.0722));
    add_to_sum(pixel, 0u, vec4(emission, luminance));
    add_to_sum(pixel, 1u, vec4(direct, luminance * luminance));
    add_to_sum(pixel, 2u, vec4(indirect, 0.0));
}

// Adds the attributes of the first surface.
void add_surface(uvec2 pixel, vec3 albedo, vec3 normal, vec3 position, float depth) {
    add_to_sum(pixel, 2u, vec4(0.0, 0.0, 0.0, 1.0));
    add_plainly(pixel, 3u, vec4(albedo, depth));
    add_plainly(pixel, 4u, vec4(normal, 0.0));
    add_plainly(pixel, 5u, vec4(position, 0.0));
}
