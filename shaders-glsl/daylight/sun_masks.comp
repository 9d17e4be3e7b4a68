// At which times of the day the sun is seen from points: a bit for each time in the mask of a side of a cell. Invocations side by side have the same
// point and neighbouring times, so that their rays stay together.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/sampling.glsl"
#include "lib/trace.glsl"
#include "daylight/daylight.glsl"

layout(local_size_x = 1, local_size_y = 64) in;

layout(binding = 0, scalar) uniform SettingsBlock { DaySettings settings; };
layout(binding = 8, scalar) readonly buffer Suns { vec4 suns[]; };  // as for day_sun_ray()
layout(binding = 9, scalar) readonly buffer MaskPoints { DayMaskPoint points[]; };
layout(binding = 10, scalar) readonly buffer Requests { DayRequests requests; };
layout(binding = 12, scalar) buffer Bits { uint bits[]; };

#include "daylight/sun_ray.glsl"

layout(push_constant, scalar) uniform Push {
    uint first;  // of the groups of 64 times
    uint count;
};

void main() {
    uint request = gl_WorkGroupID.z * DAY_MASK_ROW + gl_WorkGroupID.x;
    if (request >= requests.count) return;
    DayMaskPoint point = points[request];
    for (uint group = first; group < first + count; ++group) {
        uint time = 64u * group + gl_LocalInvocationID.y;
        if (time >= settings.times) return;
        vec4 sun = suns[time];
        DaySunRay ray = day_sun_ray(point.position, sun, sun_frame(sun), point.disc);
        if (dot(point.normal, ray.direction) <= 0.0) continue;
        if (trace_any(Ray(point.position, 0.0, ray.direction, ray.far), TRACE_SHADOW, point.salt)) continue;
        atomicOr(bits[point.side * settings.mask_words + (time >> 5u)], 1u << (time & 31u));
    }
}
