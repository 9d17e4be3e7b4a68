// Light of lamps at probes: harmonics of the light that arrives. Emissive surfaces light a probe directly and by the vertices of its paths, point and
// spot lights by the vertices alone: their direct light is computed where an object is, because it changes much between two probes.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/lights.glsl"
#include "lib/sampling.glsl"
#define LIGHT_COLUMNS_BINDING 24
#define LIGHT_TARGETS_BINDING 25
#define INSTANCE_LIGHTS_BINDING 26
#define LIGHT_NODES_BINDING 27
#include "lib/light_sampling.glsl"
#define SURFACE_BINDING 1
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "daylight/emission.glsl"
#include "daylight/daylight.glsl"
#include "daylight/probe.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform SettingsBlock { DaySettings settings; };
layout(binding = 8, scalar) readonly buffer Probes { vec3 probes[]; };
layout(binding = 9, scalar) readonly buffer Vertices { DayVertex vertices[]; };
layout(binding = 11, scalar) readonly buffer Counts { uint counts[]; };
// PROBE_TERMS sums of radiance: those of the even and those of the odd samples, group after group for each probe.
layout(binding = 12, scalar) buffer Sums { vec3 sums[]; };
layout(binding = 13, scalar) readonly buffer Groups { uint groups[]; };  // of the lights, then of the materials
layout(binding = 14, scalar) readonly buffer Starts { DayStart starts[]; };

layout(push_constant, scalar) uniform Push {
    uint first;    // sample of this batch
    uint count;
};

#include "daylight/lamp.glsl"

void main() {
    uint receiver = gl_GlobalInvocationID.x;
    if (receiver >= settings.receivers) return;
    for (uint i = first; i < first + count; ++i) {
        uint path = receiver * settings.samples + i;
        uint number = settings.first_sample + i;
        for (uint k = 0u; k <= counts[path]; ++k) {
            // The first part of a path is the probe itself: any direction is as good as another.
            DayVertex vertex = DayVertex(probes[receiver], vec3(0.0), vec3(0.0), vec3(1.0), 0.0, 0u);
            if (k > 0u) vertex = vertices[path * DAY_VERTICES + k - 1u];
            uvec4 hash = pcg4d(uvec4(settings.first_receiver + receiver, number, k, settings.seed ^ 0x2545f491u));
            DayLamp lamp;
            if (!day_lamp(vertex.position, vertex.geometric, hash, settings.lights, lamp) || (k == 0u && lamp.punctual)) continue;
            float cosine = k > 0u ? dot(vertex.normal, lamp.to_light) : 1.0;
            if (cosine <= 0.0 || (k > 0u && dot(vertex.geometric, lamp.to_light) <= 0.0)) continue;
            if (trace_any(Ray(vertex.position, 0.0, lamp.target - vertex.position, 0.99999), TRACE_SHADOW, hash.y)) continue;
            // Light of vertices arrives along the start of the path, which all directions share: 4 is their solid angle over the π of its weight.
            vec3 light = k > 0u ? 4.0 * vertex.weight * lamp.arrives * cosine : lamp.arrives;
            float terms[PROBE_TERMS] = probe_harmonics(k > 0u ? starts[path].direction : lamp.to_light);
            uint at = PROBE_TERMS * (2u * (receiver * settings.groups + lamp.group) + (number & 1u));
            for (uint t = 0u; t < PROBE_TERMS; ++t) sums[at + t] += terms[t] * light;
        }
    }
}
