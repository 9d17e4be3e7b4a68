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
#include "lib/trace.glsl"
#include "reference/path.glsl"

layout(local_size_x = 64) in;
// 1: rays to lights, which end at any hit.
layout(constant_id = 0) const uint TO_LIGHTS = 0u;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 13, scalar) uniform SettingsBlock { PathSettings settings; };
layout(binding = 14, scalar) buffer Paths { PathState paths[]; };
layout(binding = 17, scalar) writeonly buffer Hits { Hit hits[]; };
layout(binding = 18, scalar) readonly buffer Lists { uint lists[]; };
layout(binding = 19, scalar) readonly buffer Counts { PathCount counts[]; };

layout(push_constant, scalar) uniform Push {
    uint first;        // slot of the tile's first pixel, in blocks of 8 × 8
    uint sample_index;
    uint turn;         // 0 for camera rays, n + 1 for rays from surface n
    uint way;
};

#include "reference/path_at.glsl"
#include "reference/path_camera.glsl"

// The ray to the light that waits in a path.
Ray ray_to_light(uint slot) {
    if (way == TO_LIGHT) return Ray(PATH_AT(slot).light_origin, 0.0, PATH_AT(slot).lamp.direction, PATH_AT(slot).lamp.limit);
    if (way == TO_SUN) return Ray(PATH_AT(slot).light_origin, 0.0, PATH_AT(slot).sun.direction, PATH_AT(slot).sun.limit);
    return Ray(PATH_AT(slot).light_origin, 0.0, PATH_AT(slot).sky.direction, PATH_AT(slot).sky.limit);
}

void main() {
    uint number = gl_GlobalInvocationID.x;
    if (number >= counts[path_count(way, turn)].paths) return;
    uint slot = number;
    if (turn > 0u) slot = lists[path_list(way, turn) * settings.capacity + number];
    if (TO_LIGHTS != 0u) {
        Hit hit = trace(ray_to_light(slot), TRACE_SHADOW, PATH_AT(slot).salt + way, true);
        if (hit.instance != NONE) return;
        vec3 radiance = way == TO_LIGHT ? PATH_AT(slot).lamp.radiance : way == TO_SUN ? PATH_AT(slot).sun.radiance : PATH_AT(slot).sky.radiance;
        // The light of the first surface is direct.
        if (PATH_AT(slot).light_scatterings == 1u) PATH_AT(slot).direct += radiance;
        else PATH_AT(slot).indirect += radiance;
        return;
    }
    uvec2 pixel = pixel_of(first + slot);
    PathState path;
    if (turn == 0u) path = camera_path(pixel);
    else path = PATH_AT(slot);
    // It only waits for light.
    if (path.alive == 0u) return;
    uint mask = path.vertex == 0u ? TRACE_CAMERA : path.scattered > 0u ? TRACE_SHADOW : 0u;
    uint salt = random_words(pixel, sample_index, path_dimension(path), settings.seed).x;
    hits[slot] = trace(Ray(path.origin, 0.0, path.direction, path.limit), mask, salt, false);
}
