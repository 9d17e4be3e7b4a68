// At which times of the day the sun is seen from points: a bit for each time in the mask of a side of a cell. An invocation has some
// points and some words of times.
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

layout(local_size_x = 64) in; // DAY_MASK_GROUP

layout(binding = 0, scalar) uniform SettingsBlock { DaySettings settings; };
layout(binding = 8, scalar) readonly buffer Suns { DaySun suns[]; };
layout(binding = 9, scalar) readonly buffer MaskPoints { DayMaskPoint points[]; };
layout(binding = 10, scalar) readonly buffer Requests { DayRequests requests; };
layout(binding = 12, scalar) buffer Bits { uint bits[]; };

#include "daylight/sun_ray.glsl"
#include "daylight/occluder.glsl"
#include "daylight/sights.glsl"

layout(push_constant, scalar) uniform Push {
    uint first;  // time
    uint count;
};

// The next point of this invocation, the next word of it, and the first point that is not of this invocation.
uint at_point, at_word, last_point;

bool next_word(inout SunSight sight) {
    if (at_point == last_point) return false;
    DayMaskPoint point = points[at_point];
    if (at_word == first_word) {
        sight.position = point.position;
        sight.disc = point.disc;
        sight.salt = point.salt;
        sight.occluder = no_occluder();
    }
    sight.word = point.side * settings.words + at_word;
    sight.begin = DAY_TIMES * at_word;
    at_word = at_word + 1u < end_word ? at_word + 1u : first_word;
    if (at_word == first_word) ++at_point;
    return true;
}

// Sets the bits of the times at which the sun is before the surface of a point.
void want_rays(DayMaskPoint point) {
    for (uint word = first_word; word < end_word; ++word) {
        uvec2 times = word_times(word, first, count);
        uint wanted = 0u;
        for (uint time = times.x; time < times.y; ++time) {
            if (dot(point.normal, day_sun_ray(point.position, suns[time], point.disc).direction) > 0.0) wanted |= 1u << (time & 31u);
        }
        bits[point.side * settings.words + word] |= wanted;
    }
}

void main() {
    if (!find_words(first, count)) return;
    at_point = min(gl_GlobalInvocationID.x * settings.sight_places, requests.count);
    last_point = min(at_point + settings.sight_places, requests.count);
    at_word = first_word;
    for (uint point = at_point; point < last_point; ++point) want_rays(points[point]);
    send_sights(first, count);
}
