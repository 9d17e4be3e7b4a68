// The irradiance of all probes at one time of the day, as harmonics without negative light.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "daylight/tiles.glsl"
#include "daylight/probe.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform GridBlock { DayGrid grid; };
// PROBE_TERMS for each probe, irradiance in W/m².
layout(binding = 1, scalar) writeonly buffer Light { vec3 light[]; };

// Directions at which negative light is looked for: those of the bake, and the corners of a cube.
const uint LOOKED_AT = PROBE_DIRECTIONS + 8u;

vec3 looked_at(uint i) {
    if (i < PROBE_DIRECTIONS) return probe_direction(i);
    uint corner = i - PROBE_DIRECTIONS;
    return 0.57735027 * (2.0 * vec3(uvec3(corner, corner >> 1u, corner >> 2u) & 1u) - 1.0);
}

void main() {
    uint number = gl_GlobalInvocationID.x;
    if (number >= grid.counts.x * grid.counts.y * grid.counts.z) return;
    uvec3 at = uvec3(number, number / grid.counts.x, number / (grid.counts.x * grid.counts.y));
    at.xy %= grid.counts.xy;
    uvec2 brick = probe_brick(grid, at);
    vec3 terms[PROBE_TERMS];
    for (uint k = 0u; k < PROBE_TERMS; ++k) terms[k] = vec3(0.0);
    for (uint i = 0u; i < PROBE_DIRECTIONS; ++i) {
        uint texel = day_texel(brick.x, uvec2(brick.y * PROBE_DIRECTIONS + i, 0u));
        if (texel == NONE) break;
        vec3 e = day_irradiance(brick.x, texel);
        float harmonics[PROBE_TERMS] = probe_harmonics(probe_direction(i));
        for (uint k = 0u; k < PROBE_TERMS; ++k) terms[k] += 12.5663706 / float(PROBE_DIRECTIONS) * harmonics[k] * e;
    }
    // The bands above the first one are weaker where the sum would be negative; the mean over all directions stays.
    terms[0] = max(terms[0], vec3(0.0));
    vec3 mean = 0.28209479 * terms[0];
    float window = 1.0;
    for (uint i = 0u; i < LOOKED_AT; ++i) {
        float harmonics[PROBE_TERMS] = probe_harmonics(looked_at(i));
        vec3 rest = vec3(0.0);
        for (uint k = 1u; k < PROBE_TERMS; ++k) rest += harmonics[k] * terms[k];
        for (uint c = 0u; c < 3u; ++c) {
            if (mean[c] + window * rest[c] < 0.0) window = mean[c] / -rest[c];
        }
    }
    light[number * PROBE_TERMS] = terms[0];
    for (uint k = 1u; k < PROBE_TERMS; ++k) light[number * PROBE_TERMS + k] = window * terms[k];
}
