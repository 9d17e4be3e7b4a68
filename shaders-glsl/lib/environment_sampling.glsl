// Radiance from infinity in full precision, and directions drawn in proportion to it.
// Before including: lib/sampling.glsl, and define ENVIRONMENT_BINDING and ENVIRONMENT_EDGES_BINDING.
#ifndef LIB_ENVIRONMENT_SAMPLING
#define LIB_ENVIRONMENT_SAMPLING

#include "lib/environment_map.glsl"

layout(binding = ENVIRONMENT_BINDING) uniform sampler2D environment_radiance_map; // W/(sr m2), latitude-longitude
// Lower edges of intervals in [0, ENVIRONMENT_EDGE_END]: first of the rows of cells, then for each row of its cells. After the last interval
// lies ENVIRONMENT_EDGE_END. The length of an interval is its probability exactly. Behind these edges are as many guides: the part of all words
// that a word lies in says between which two guides its interval is.
layout(binding = ENVIRONMENT_EDGES_BINDING, scalar) readonly buffer EnvironmentEdges { uint environment_edges[]; };
const uint ENVIRONMENT_EDGE_END = 0x80000000u; // export
// By address (lib/scene_at.glsl) where ENVIRONMENT_EDGES_AT has it.
#ifdef ENVIRONMENT_EDGES_AT
#include "lib/scene_at.glsl"
#define ENVIRONMENT_EDGE(i) WordsAt(ENVIRONMENT_EDGES_AT).of[i]
#else
#define ENVIRONMENT_EDGE(i) environment_edges[i]
#endif

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

// First edge of the cells of a row.
uint environment_row(EnvironmentMap map, uint row) {
    return 2u * (map.cells.y + 1u + row * (map.cells.x + 1u));
}

// Probability of an interval that begins at edge number `at`.
float environment_share(uint at) {
    return float(ENVIRONMENT_EDGE(at + 1u) - ENVIRONMENT_EDGE(at)) * (1.0 / 2147483648.0);
}

// Density per steradian with which environment_sample gives a direction of this cell.
float environment_cell_density(EnvironmentMap map, uvec2 cell) {
    float share = environment_share(cell.y) * environment_share(environment_row(map, cell.y) + cell.x);
    return share / environment_cell_angle(map, cell.y);
}

// Density per steradian with which environment_sample gives this direction.
float environment_density(EnvironmentMap map, vec3 direction) {
    return environment_cell_density(map, min(uvec2(environment_place(map, direction) * vec2(map.cells)), map.cells - 1u));
}

// The interval of `count` intervals that a word lies in, and its place in the interval, in (0, 1).
uint environment_interval(uint first, uint count, uint word, out float place) {
    word >>= 1u;
    uint guide = first + count + 1u + ((word >> 15u) * count >> 16u);
    uint low = ENVIRONMENT_EDGE(guide), high = ENVIRONMENT_EDGE(guide + 1u) + 1u;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (ENVIRONMENT_EDGE(first + middle) <= word) low = middle;
        else high = middle;
    }
    uint edge = ENVIRONMENT_EDGE(first + low);
    place = (float(word - edge) + 0.5) / float(ENVIRONMENT_EDGE(first + low + 1u) - edge);
    return low;
}

// A direction: a row of cells and a cell of the row by their probabilities, then uniform in the cell's solid angle. Two words that are well
// distributed in a square give directions that are well distributed by the light.
vec3 environment_sample(EnvironmentMap map, uvec2 words, out float density) {
    vec2 u;
    uvec2 cell;
    cell.y = environment_interval(0u, map.cells.y, words.y, u.y);
    cell.x = environment_interval(environment_row(map, cell.y), map.cells.x, words.x, u.x);
    density = environment_cell_density(map, cell);
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
