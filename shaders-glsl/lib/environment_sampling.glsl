// Radiance from infinity in full precision, and directions drawn in proportion to it.
// Before including: lib/sampling.glsl, and define ENVIRONMENT_BINDING and ENVIRONMENT_COLUMNS_BINDING.
#ifndef LIB_ENVIRONMENT_SAMPLING
#define LIB_ENVIRONMENT_SAMPLING

#include "lib/environment_map.glsl"

layout(binding = ENVIRONMENT_BINDING) uniform sampler2D environment_radiance_map; // W/(sr m2), latitude-longitude
layout(binding = ENVIRONMENT_COLUMNS_BINDING, scalar) readonly buffer EnvironmentColumns { AliasEntry environment_columns[]; };

// Azimuth and polar angle as fractions of their ranges, in the map's own frame. As passes/environment.glsl has it, but
// precise at the poles.
vec2 environment_place(EnvironmentMap map, vec3 direction) {
    float s = sin(map.rotation), c = cos(map.rotation);
    vec3 d = vec3(c * direction.x - s * direction.z, direction.y, s * direction.x + c * direction.z);
    float u = atan(d.x, -d.z) * 0.15915494 + 0.5;
    return vec2(u >= 1.0 ? u - 1.0 : u, atan(length(d.xz), d.y) * 0.31830989);
}

vec3 environment_texel(EnvironmentMap map, int x, int y) {
    // Beyond a pole lies the same row, half a turn away.
    if (y < 0 || y >= map.size.y) {
        x += map.size.x / 2;
        y = y < 0 ? -1 - y : 2 * map.size.y - 1 - y;
    }
    x = x < 0 ? x + map.size.x : x;
    x = x >= map.size.x ? x - map.size.x : x;
    return texelFetch(environment_radiance_map, ivec2(x, y), 0).rgb;
}

// Radiance from a unit direction, bilinear (Environment::radiance in Rust).
vec3 environment_radiance(EnvironmentMap map, vec3 direction) {
    vec2 at = environment_place(map, direction) * vec2(map.size) - 0.5;
    vec2 corner = floor(at);
    vec2 f = at - corner;
    int x = int(corner.x), y = int(corner.y);
    vec3 top = mix(environment_texel(map, x, y), environment_texel(map, x + 1, y), f.x);
    vec3 bottom = mix(environment_texel(map, x, y + 1), environment_texel(map, x + 1, y + 1), f.x);
    return mix(top, bottom, f.y) * map.scale;
}

// Solid angle of a cell, steradians, exactly.
float environment_cell_angle(EnvironmentMap map, uint row) {
    float rows = float(map.cells.y);
    float mid = SAMPLING_PI * (float(row) + 0.5) / rows;
    return 4.0 * SAMPLING_PI / float(map.cells.x) * sin(mid) * sin(0.5 * SAMPLING_PI / rows);
}

// Density per steradian with which environment_sample gives this direction.
float environment_density(EnvironmentMap map, vec3 direction) {
    uvec2 cell = min(uvec2(environment_place(map, direction) * vec2(map.cells)), map.cells - 1u);
    return environment_columns[cell.y * map.cells.x + cell.x].probability / environment_cell_angle(map, cell.y);
}

// A direction: a cell by its probability (whole bits and a fraction), then uniform in its solid angle.
vec3 environment_sample(EnvironmentMap map, uint bits, float keep, vec2 u, out float density) {
    uint index = pick_below(bits, map.cells.x * map.cells.y);
    AliasEntry column = environment_columns[index];
    if (keep >= column.keep) index = column.other;
    uvec2 cell = uvec2(index % map.cells.x, index / map.cells.x);
    density = environment_columns[index].probability / environment_cell_angle(map, cell.y);
    // Uniform in cos θ; sin²(θ/2) = (1 - cos θ)/2 keeps its precision at the upper pole.
    vec2 edges = sin(0.5 * SAMPLING_PI * (float(cell.y) + vec2(0.0, 1.0)) / float(map.cells.y));
    float h = mix(edges.x * edges.x, edges.y * edges.y, u.y);
    float sine = 2.0 * sqrt(max(h * (1.0 - h), 0.0));
    float azimuth = 2.0 * SAMPLING_PI * ((float(cell.x) + u.x) / float(map.cells.x) - 0.5);
    vec3 d = vec3(sine * sin(azimuth), 1.0 - 2.0 * h, -sine * cos(azimuth));
    float s = sin(map.rotation), c = cos(map.rotation);
    return vec3(c * d.x + s * d.z, d.y, -s * d.x + c * d.z);
}

#endif
