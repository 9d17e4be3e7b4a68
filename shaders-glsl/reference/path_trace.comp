// Rays of paths (reference/path.comp): the ray of one kind of each path of a list. A ray to the next surface keeps its hit. The light of a ray
// that reaches its light is added to the path.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/sampling.glsl"
#include "reference/path.glsl"

layout(local_size_x = 64) in;
// 1: rays to lights, which end at any hit.
layout(constant_id = 0) const uint TO_LIGHTS = 0u;

layout(binding = 13, scalar) uniform SettingsBlock { PathSettings settings; };
#include "lib/trace.glsl"

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 14, scalar) buffer Paths { PathState paths[]; };
layout(binding = 17, scalar) writeonly buffer Hits { Hit hits[]; };
layout(binding = 18, scalar) readonly buffer Lists { uint lists[]; };
layout(binding = 19, scalar) readonly buffer Counts { PathCount counts[]; };

layout(push_constant, scalar) uniform Push {
    uint first;        // reference/path_slots.glsl
    uint sample_index;
    uint turn;         // 0 for camera rays, n + 1 for rays from surface n
    uint way;
};

#include "reference/path_at.glsl"
#include "reference/path_slots.glsl"
#include "reference/path_camera.glsl"

// The light that waits in a path.
WaitingLight waiting_light(uint slot) {
    if (way == TO_LIGHT) return PATH_AT(slot).lamp;
    if (way == TO_SUN) return PATH_AT(slot).sun;
    return PATH_AT(slot).sky;
}

void begin_path(uint slot, Ray ray) {
    PATH_AT(slot).origin = ray.origin;
    PATH_AT(slot).density = 0.0;
    PATH_AT(slot).direction = ray.direction;
    PATH_AT(slot).steps = packed_steps(Steps(true, 0u, 0u, 0u));
    PATH_AT(slot).throughput = vec3(1.0);
    PATH_AT(slot).emission = vec3(0.0);
    PATH_AT(slot).direct = vec3(0.0);
    PATH_AT(slot).indirect = vec3(0.0);
}

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= counts[path_count(way, turn)].paths) return;
    if (turn > 0u) slot = LIST_AT(path_list(way, turn) * settings.capacity + slot);
    if (TO_LIGHTS != 0u) {
        WaitingLight light = waiting_light(slot);
        // The ray ends a little before a lamp, so that the lamp does not occlude itself.
        Ray ray = Ray(PATH_AT(slot).light_origin, 0.0, light.direction, way == TO_LIGHT ? 0.99999 : 1e30);
        if (trace(ray, TRACE_SHADOW, PATH_AT(slot).salt + way, true).instance != NONE) return;
        if (PATH_AT(slot).to_direct != 0u) PATH_AT(slot).direct += light.radiance;
        else PATH_AT(slot).indirect += light.radiance;
        return;
    }
    uvec2 pixel = pixel_of(slot);
    uint number = sample_of(slot);
    Steps steps = Steps(true, 0u, 0u, 0u);
    Ray ray;
    if (turn == 0u) {
        ray = camera_ray(pixel, number);
        begin_path(slot, ray);
    } else {
        steps = unpacked_steps(PATH_AT(slot).steps);
        ray = Ray(PATH_AT(slot).origin, 0.0, PATH_AT(slot).direction, 1e30);
    }
    uint mask = steps.vertex == 0u ? TRACE_CAMERA : steps.scattered > 0u ? TRACE_SHADOW : 0u;
    uint salt = random_words(pixel, number, path_dimension(steps.vertex), settings.seed).x;
    HIT_AT(slot) = trace(ray, mask, salt, false);
}
