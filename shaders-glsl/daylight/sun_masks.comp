// At which times of the day the sun is seen from points: a bit for each time in the mask of a side of a cell. An invocation has some points.
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
layout(binding = 9, scalar) readonly buffer MaskPoints { DayMaskPoint points[]; };
layout(binding = 10, scalar) readonly buffer Requests { DayRequests requests; };
layout(binding = 12, scalar) buffer Bits { uint bits[]; };

#include "daylight/sun_ray.glsl"
#include "daylight/occluder.glsl"
#include "daylight/visibility.glsl"

// The first point that is not of this invocation, and the next point.
uint end_point, next_point;
// The normal of the current point's triangle.
vec3 normal;

bool next_place(out SunPlace place) {
    if (next_point == end_point) return false;
    DayMaskPoint point = points[next_point++];
    normal = point.normal;
    place = SunPlace(point.side * day_words(settings), point.position, point.disc, point.salt);
    return true;
}

bool wants_ray(SunPlace place, DaySun sun) {
    return dot(normal, day_sun_ray(place.position, sun, place.disc).direction) > 0.0;
}

void main() {
    next_point = min(gl_GlobalInvocationID.x * settings.places, requests.count);
    end_point = min(next_point + settings.places, requests.count);
    find_visibility();
}
