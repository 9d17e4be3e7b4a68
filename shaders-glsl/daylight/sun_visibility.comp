// At which times of the day the vertices of paths see the sun: a bit for each time. An invocation has some paths.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/sampling.glsl"
#define SURFACE_BINDING 1
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "daylight/daylight.glsl"

layout(local_size_x = DAY_VISIBILITY_GROUP) in;

layout(binding = 0, scalar) uniform SettingsBlock { DaySettings settings; };
layout(binding = 8, scalar) readonly buffer Suns { DaySun suns[]; };
layout(binding = 9, scalar) readonly buffer Vertices { DayVertex vertices[]; };
layout(binding = 11, scalar) readonly buffer Counts { uint counts[]; };
layout(binding = 12, scalar) buffer Bits { uint bits[]; };

#include "daylight/sun_ray.glsl"
#include "daylight/sun_roulette.glsl"
#include "daylight/occluder.glsl"
#include "daylight/visibility.glsl"

// The first path that is not of this invocation, the path and the number of its next vertex.
uint end_path, path, next_vertex;
// The current vertex.
DayVertex vertex;
DaySunChoice choice;

bool next_place(out SunPlace place) {
    while (path < end_path && next_vertex == counts[path]) {
        next_vertex = 0u;
        ++path;
    }
    if (path == end_path) return false;
    uint at = path * DAY_VERTICES + next_vertex;
    vertex = vertices[at];
    choice = sun_choice(settings.first_receiver + path / settings.samples, settings.first_sample + path % settings.samples, next_vertex);
    ++next_vertex;
    place = SunPlace(at * day_words(settings), vertex.position, choice.disc, choice.salt);
    return true;
}

bool wants_ray(SunPlace place, DaySun sun) {
    return choice.number < sun_stay(vertex, sun);
}

void main() {
    uint paths = settings.receivers * settings.samples;
    path = min(gl_GlobalInvocationID.x * settings.places, paths);
    end_path = min(path + settings.places, paths);
    next_vertex = 0u;
    find_visibility();
}
