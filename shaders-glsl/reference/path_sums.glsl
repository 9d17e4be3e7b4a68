// Sums over samples. The sums of radiance have separate sums of their rounding errors, so that a million samples are as exact as one.
// Each layer has rgb and alpha:
//   0 emission, luminance of the total      3 albedo, distance along the view axis
//   1 direct,   its square                  4 shading normal, number of samples left out as not finite
//   2 indirect, samples that hit a surface  5 position, —

// Before including: `settings`.
#include "reference/path_sums_at.glsl"

// A sum is `high` + `low`, to 48 bits.
struct ExactSum {
    vec4 high;
    vec4 low;
};

// The sums of a pixel.
struct PixelSums {
    ExactSum emission; // layer 0, and the next ones in their order
    ExactSum direct;
    ExactSum indirect;
    vec4 albedo;
    vec4 normal;
    vec4 position;
};

uint place_of_sum(uvec2 pixel, uint layer) {
    return layer * settings.sum_pixels + (pixel.y - settings.first_row) * settings.extent.x + pixel.x;
}

vec4 load_sum(uvec2 pixel, uint layer) { return SUM_AT(settings.sums_at, place_of_sum(pixel, layer)); }
void store_sum(uvec2 pixel, uint layer, vec4 sum) { SUM_AT(settings.sums_at, place_of_sum(pixel, layer)) = sum; }

ExactSum load_exact_sum(uvec2 pixel, uint layer) {
    return ExactSum(load_sum(pixel, layer), load_sum(pixel, layer + PATH_SUMS));
}

void store_exact_sum(uvec2 pixel, uint layer, ExactSum sum) {
    store_sum(pixel, layer, sum.high);
    store_sum(pixel, layer + PATH_SUMS, sum.low);
}

PixelSums load_sums(uvec2 pixel) {
    return PixelSums(load_exact_sum(pixel, 0u), load_exact_sum(pixel, 1u), load_exact_sum(pixel, 2u), load_sum(pixel, 3u),
        load_sum(pixel, 4u), load_sum(pixel, 5u));
}

void store_sums(uvec2 pixel, PixelSums sums) {
    store_exact_sum(pixel, 0u, sums.emission);
    store_exact_sum(pixel, 1u, sums.direct);
    store_exact_sum(pixel, 2u, sums.indirect);
    store_sum(pixel, 3u, sums.albedo);
    store_sum(pixel, 4u, sums.normal);
    store_sum(pixel, 5u, sums.position);
}

void add_exactly(inout ExactSum of, vec4 value) {
    vec4 high = of.high;
    vec4 low = of.low;
    // Two-sum (Knuth), then renormalised. `precise` forbids the compiler to simplify the terms.
    precise vec4 sum = high + value;
    precise vec4 back = sum - high;
    precise vec4 rest = (high - (sum - back)) + (value - back);
    precise vec4 error = low + rest;
    precise vec4 total = sum + error;
    precise vec4 left = error - (total - sum);
    of.high = total;
    of.low = left;
}

bool is_number(vec3 v) {
    return !any(isnan(v)) && !any(isinf(v));
}

void add_light(inout PixelSums sums, vec3 emission, vec3 direct, vec3 indirect) {
    if (!is_number(emission) || !is_number(direct) || !is_number(indirect)) {
        sums.normal.a += 1.0;
        return;
    }
    vec3 total = emission + direct + indirect;
    float luminance = dot(total, vec3(0.2126, 0.7152, 0.0722));
    add_exactly(sums.emission, vec4(emission, luminance));
    add_exactly(sums.direct, vec4(direct, luminance * luminance));
    add_exactly(sums.indirect, vec4(indirect, 0.0));
}

// Adds the attributes of the first surface.
void add_surface(inout PixelSums sums, vec3 albedo, vec3 normal, vec3 position, float depth) {
    add_exactly(sums.indirect, vec4(0.0, 0.0, 0.0, 1.0));
    sums.albedo += vec4(albedo, depth);
    sums.normal += vec4(normal, 0.0);
    sums.position += vec4(position, 0.0);
}
