// At which times of the day the vertices of paths see the sun: a bit for each time. An invocation has some
// paths and some words of times.
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

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform SettingsBlock { DaySettings settings; };
layout(binding = 8, scalar) readonly buffer Suns { DaySun suns[]; };
layout(binding = 9, scalar) readonly buffer Vertices { DayVertex vertices[]; };
layout(binding = 11, scalar) readonly buffer Counts { uint counts[]; };
layout(binding = 12, scalar) buffer Bits { uint bits[]; };

#include "daylight/sun_ray.glsl"
#include "daylight/sun_roulette.glsl"
#include "daylight/occluder.glsl"
#include "daylight/sights.glsl"

layout(push_constant, scalar) uniform Push {
    uint first;  // time
    uint count;
};

// The next vertex of this invocation, the next word of it, and the first path that is not of this invocation.
uint at_path, at_vertex, at_word, last_path;

DaySunChoice choice_of(uint path, uint vertex) {
    return sun_choice(settings.first_receiver + path / settings.samples, settings.first_sample + path % settings.samples, vertex);
}

bool next_word(inout SunSight sight) {
    while (at_path < last_path && at_vertex == counts[at_path]) {
        at_vertex = 0u;
        ++at_path;
    }
    if (at_path == last_path) return false;
    uint at = at_path * DAY_VERTICES + at_vertex;
    if (at_word == first_word) {
        DaySunChoice choice = choice_of(at_path, at_vertex);
        sight.position = vertices[at].position;
        sight.disc = choice.disc;
        sight.salt = choice.salt;
        sight.occluder = no_occluder();
    }
    sight.word = at * settings.words + at_word;
    sight.begin = DAY_TIMES * at_word;
    at_word = at_word + 1u < end_word ? at_word + 1u : first_word;
    if (at_word == first_word) ++at_vertex;
    return true;
}

// Sets the bits of the times at which the vertices of a path want rays. All invocations of a group have the same time, so that they load the same sun.
void want_rays(uint path) {
    for (uint k = 0u; k < counts[path]; ++k) {
        uint at = path * DAY_VERTICES + k;
        DayVertex vertex = vertices[at];
        float number = choice_of(path, k).number;
        for (uint word = first_word; word < end_word; ++word) {
            uvec2 times = word_times(word, first, count);
            uint wanted = 0u;
            for (uint time = times.x; time < times.y; ++time) {
                if (number < sun_stay(vertex, suns[time])) wanted |= 1u << (time & 31u);
            }
            bits[at * settings.words + word] |= wanted;
        }
    }
}

void main() {
    if (!find_words(first, count)) return;
    uint paths = settings.receivers * settings.samples;
    at_path = min(gl_GlobalInvocationID.x * settings.sight_places, paths);
    last_path = min(at_path + settings.sight_places, paths);
    at_vertex = 0u;
    at_word = first_word;
    for (uint path = at_path; path < last_path; ++path) want_rays(path);
    send_sights(first, count);
}
