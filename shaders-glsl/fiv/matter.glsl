// Upper bound of the light that an occluder of an apparent size can hide (techniques::fiv::negligible). Needs a buffer
// `float matter[]`. Include fiv/fiv.glsl before.
#ifndef LIB_FIV_MATTER
#define LIB_FIV_MATTER

// Coordinates of a unit direction in the table.
vec2 fiv_matter_place(vec3 direction) {
    float azimuth = atan(direction.x, -direction.z) * (0.5 / FIV_PI);
    return vec2((azimuth - floor(azimuth)) * float(FIV_MATTER_AZIMUTHS),
                atan(length(direction.xz), direction.y) * (float(FIV_MATTER_POLARS - 1u) / FIV_PI));
}

// Level, with its fraction, of a disc whose radius is this sine.
float fiv_matter_level(float r) {
    return clamp(log2(max(r, 1e-6) / 0.05), 0.0, float(FIV_MATTER_LEVELS - 1u) - 1e-3);
}

float fiv_matter_at(int azimuth, uint polar, uint level) {
    uint column = uint(azimuth) & (FIV_MATTER_AZIMUTHS - 1u);
    return matter[(level * FIV_MATTER_POLARS + polar) * FIV_MATTER_AZIMUTHS + column];
}

// Most light that a disc of directions around `direction` (unit) can hide, as a share of the mean irradiance. The disc
// radius is the sine `r`. The result is continuous in both arguments.
float fiv_matter(vec3 direction, float r) {
    vec2 place = fiv_matter_place(direction);
    uvec2 at = min(uvec2(place), uvec2(FIV_MATTER_AZIMUTHS - 1u, FIV_MATTER_POLARS - 2u));
    vec2 part = clamp(place - vec2(at), 0.0, 1.0);
    float level = fiv_matter_level(r);
    uint low = min(uint(level), FIV_MATTER_LEVELS - 2u);
    vec2 sum = vec2(0.0);
    for (uint k = 0u; k < 4u; ++k) {
        uvec2 step = uvec2(k & 1u, k >> 1u);
        vec2 weights = mix(1.0 - part, part, vec2(step));
        int column = int(at.x + step.x);
        sum += weights.x * weights.y * vec2(fiv_matter_at(column, at.y + step.y, low), fiv_matter_at(column, at.y + step.y, low + 1u));
    }
    return r * r * mix(sum.x, sum.y, clamp(level - float(low), 0.0, 1.0));
}

// An upper bound of fiv_matter for every direction within the chord `off` of this direction, and for every radius up to
// `r`.
float fiv_matter_around(vec3 direction, float off, float r) {
    vec2 place = fiv_matter_place(direction);
    float level = length(direction.xz);
    // Directions within this chord are at most a step apart in the table, except near the poles.
    float cell = 2.0 * FIV_PI / float(FIV_MATTER_AZIMUTHS);
    if (1.2 * off > cell * (level - 1.2 * off)) return 1e30;
    uint high = min(uint(fiv_matter_level(r)) + 1u, FIV_MATTER_LEVELS - 1u);
    float most = 0.0;
    for (int row = -1; row <= 2; ++row) {
        uint polar = uint(clamp(int(place.y) + row, 0, int(FIV_MATTER_POLARS) - 1));
        for (int column = -1; column <= 2; ++column) {
            most = max(most, fiv_matter_at(int(place.x) + column, polar, high));
        }
    }
    return r * r * most;
}

#endif
