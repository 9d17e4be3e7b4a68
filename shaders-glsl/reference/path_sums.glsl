// Sums over samples. The sums of radiance have separate sums of their rounding errors, so that a million samples are as exact as one.
// Each layer has rgb and alpha:
//   0 emission, luminance of the total      3 albedo, distance along the view axis
//   1 direct,   its square                  4 shading normal, number of samples left out as not finite
//   2 indirect, samples that hit a surface  5 position, —

ivec3 place_of_sum(uvec2 pixel, uint layer) {
    return ivec3(pixel.x, pixel.y - settings.first_row, layer);
}

void add_to_sum(uvec2 pixel, uint layer, vec4 value) {
    ivec3 at = place_of_sum(pixel, layer);
    ivec3 at_error = place_of_sum(pixel, layer + PATH_SUMS);
    vec4 high = imageLoad(sums, at);
    vec4 low = imageLoad(sums, at_error);
    // Two-sum (Knuth), then renormalised: high + low is the sum to 48 bits. `precise` forbids the compiler to simplify the terms.
    precise vec4 sum = high + value;
    precise vec4 back = sum - high;
    precise vec4 rest = (high - (sum - back)) + (value - back);
    precise vec4 error = low + rest;
    precise vec4 total = sum + error;
    precise vec4 left = error - (total - sum);
    imageStore(sums, at, total);
    imageStore(sums, at_error, left);
}

void add_plainly(uvec2 pixel, uint layer, vec4 value) {
    ivec3 at = place_of_sum(pixel, layer);
    imageStore(sums, at, imageLoad(sums, at) + value);
}

bool is_number(vec3 v) {
    return !any(isnan(v)) && !any(isinf(v));
}

void add_light(uvec2 pixel, PathState path) {
    if (!is_number(path.emission) || !is_number(path.direct) || !is_number(path.indirect)) {
        add_plainly(pixel, 4u, vec4(0.0, 0.0, 0.0, 1.0));
        return;
    }
    vec3 total = path.emission + path.direct + path.indirect;
    float luminance = dot(total, vec3(0.2126, 0.7152, 0.0722));
    add_to_sum(pixel, 0u, vec4(path.emission, luminance));
    add_to_sum(pixel, 1u, vec4(path.direct, luminance * luminance));
    add_to_sum(pixel, 2u, vec4(path.indirect, 0.0));
}

// Adds the attributes of the first surface.
void add_surface(uvec2 pixel, vec3 albedo, vec3 normal, vec3 position, float depth) {
    add_to_sum(pixel, 2u, vec4(0.0, 0.0, 0.0, 1.0));
    add_plainly(pixel, 3u, vec4(albedo, depth));
    add_plainly(pixel, 4u, vec4(normal, 0.0));
    add_plainly(pixel, 5u, vec4(position, 0.0));
}
