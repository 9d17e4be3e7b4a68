// Light of the sun at probes at all times of the day, as suns.comp has it at surfaces: harmonics of the light that arrives.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/sampling.glsl"
#include "daylight/daylight.glsl"
#include "daylight/probe.glsl"

layout(local_size_x = DAY_TIMES) in;

layout(binding = 0, scalar) uniform SettingsBlock { DaySettings settings; };
layout(binding = 1, scalar) readonly buffer Suns { DaySun suns[]; };
layout(binding = 8, scalar) readonly buffer Starts { DayStart starts[]; };
layout(binding = 9, scalar) readonly buffer Vertices { DayVertex vertices[]; };
layout(binding = 11, scalar) readonly buffer Counts { uint counts[]; };
// PROBE_TERMS sums of radiance for a sun of 1 W/m² at normal incidence: those of the even and those of the odd samples, time after time for
// each probe.
layout(binding = 12, scalar) buffer Sums { vec3 sums[]; };

// A bit for each time: whether the sun is seen. For each vertex of the paths, or for each side of a cell of the sun masks.
layout(binding = 15, scalar) readonly buffer Bits { uint bits[]; };

#include "daylight/sun_ray.glsl"
#include "daylight/sun_roulette.glsl"
#include "daylight/sun.glsl"

layout(push_constant, scalar) uniform Push {
    uint first;    // sample of this batch
    uint count;
};

void main() {
    uint time = gl_GlobalInvocationID.x;
    uint receiver = gl_WorkGroupID.y;
    if (time >= settings.times) return;
    DaySun sun = suns[time];
    for (uint i = first; i < first + count; ++i) {
        uint path = receiver * settings.samples + i;
        uint number = settings.first_sample + i;
        vec3 light = day_sun(path, settings.first_receiver + receiver, number, time, sun);
        if (light == vec3(0.0)) continue;
        float terms[PROBE_TERMS] = probe_harmonics(starts[path].direction);
        uint at = PROBE_TERMS * (2u * (receiver * settings.times + time) + (number & 1u));
        for (uint k = 0u; k < PROBE_TERMS; ++k) sums[at + k] += 4.0 * terms[k] * light;
    }
}
