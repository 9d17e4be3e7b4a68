// Light of the sky at probes: the paths that left the scene, sorted by the patches of the sky.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/sampling.glsl"
#include "daylight/daylight.glsl"
#include "daylight/probe.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform SettingsBlock { DaySettings settings; };
layout(binding = 8, scalar) readonly buffer Starts { DayStart starts[]; };
layout(binding = 10, scalar) readonly buffer Escapes { DayEscape escapes[]; };
// PROBE_TERMS sums of radiance for a radiance of 1 W/(sr m²) of each patch: patch after patch for each probe.
layout(binding = 12, scalar) buffer Sums { vec3 sums[]; };

void main() {
    uint receiver = gl_GlobalInvocationID.x;
    if (receiver >= settings.receivers) return;
    for (uint i = 0u; i < settings.samples; ++i) {
        uint path = receiver * settings.samples + i;
        DayEscape escape = escapes[path];
        if (escape.weight == vec3(0.0)) continue;
        float terms[PROBE_TERMS] = probe_harmonics(starts[path].direction);
        uint at = PROBE_TERMS * (receiver * SKY_PATCHES + sky_patch(escape.direction));
        for (uint k = 0u; k < PROBE_TERMS; ++k) sums[at + k] += 4.0 * terms[k] * escape.weight;
    }
}
