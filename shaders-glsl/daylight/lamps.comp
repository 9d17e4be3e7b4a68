// Light of lamps: each receiver and each vertex of its paths samples one point or spot light or one emissive triangle, and adds its light to the
// lamp's group. Direct light is part of it, because a lightmap is the only place where the light of a surface lies at run time.
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

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform SettingsBlock { DaySettings settings; };
layout(binding = 9, scalar) readonly buffer Vertices { DayVertex vertices[]; };
layout(binding = 11, scalar) readonly buffer Counts { uint counts[]; };
// Sums of irradiance: group after group for each receiver. Even and odd samples apart.
layout(binding = 12, scalar) buffer Sums { vec3 sums[]; };
layout(binding = 13, scalar) readonly buffer Groups { uint groups[]; };  // of the lights, then of the materials
layout(binding = 14, scalar) readonly buffer Spots { DaySpot spots[]; };

layout(push_constant, scalar) uniform Push {
    uint first;    // sample of this batch
    uint count;
};

#include "daylight/lamp.glsl"

void main() {
    uint receiver = gl_GlobalInvocationID.x;
    if (receiver >= settings.receivers) return;
    DaySpot spot = spots[receiver];
    DayVertex start = DayVertex(spot.above, spot.shading, spot.normal, vec3(1.0), 0.0, 0u);
    for (uint i = first; i < first + count; ++i) {
        uint path = receiver * settings.samples + i;
        uint number = settings.first_sample + i;
        for (uint k = 0u; k <= counts[path]; ++k) {
            DayVertex vertex = start;
            if (k > 0u) vertex = vertices[path * DAY_VERTICES + k - 1u];
            uvec4 hash = pcg4d(uvec4(settings.first_receiver + receiver, number, k, settings.seed ^ 0x2545f491u));
            DayLamp lamp;
            if (!day_lamp(vertex.position, vertex.geometric, hash, settings.lights, lamp)) continue;
            float cosine = dot(vertex.normal, lamp.to_light);
            if (cosine <= 0.0 || dot(vertex.geometric, lamp.to_light) <= 0.0) continue;
            if (trace_any(Ray(vertex.position, 0.0, lamp.target - vertex.position, 0.99999), TRACE_SHADOW, hash.y)) continue;
            uint at = 2u * (receiver * settings.groups + lamp.group) + (number & 1u);
            sums[at] += vertex.weight * lamp.arrives * cosine;
        }
    }
}
