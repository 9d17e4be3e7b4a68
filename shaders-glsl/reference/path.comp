// Path tracing of a tile of pixels, with one sample per pixel: what happens at the surfaces that rays have hit. reference/path_trace.comp
// traces the rays. Each pass has a list of the paths that it concerns, so that invocations side by side do the same, and none waits for a
// longer path. Radiance is summed separately by the number of scatterings along the path: none, one, more.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/lights.glsl"
#include "lib/sampling.glsl"
#include "lib/bsdf.glsl"
#include "reference/path.glsl"

layout(binding = 13, scalar) uniform SettingsBlock { PathSettings settings; };

#define ENVIRONMENT_BINDING 8
#define ENVIRONMENT_COLUMNS_BINDING 9
#include "lib/environment_sampling.glsl"
#define LIGHT_COLUMNS_BINDING 10
#define LIGHT_TARGETS_BINDING 11
#define INSTANCE_LIGHTS_BINDING 12
#define LIGHT_NODES_BINDING 16
#define LIGHT_NODES_AT settings.light_nodes_at
#include "lib/light_sampling.glsl"
#define SURFACE_BINDING 1
#include "lib/hit_surface.glsl"
#include "lib/ray.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 14, scalar) buffer Paths { PathState paths[]; };
// Layers 0 to PATH_SUMS - 1: sums over samples; then PATH_EXACT_SUMS layers: the rounding errors of the first sums.
layout(binding = 15, rgba32f) uniform image2DArray sums;

layout(binding = 17, scalar) readonly buffer Hits { Hit hits[]; };
layout(binding = 18, scalar) buffer Lists { uint lists[]; };
// path_count(): of the rays that were traced, and of those from here. A pass cannot both have its size from a buffer and write to it.
layout(binding = 19, scalar) readonly buffer Traced { PathCount traced[]; };
layout(binding = 21, scalar) buffer Counts { PathCount counts[]; };

layout(push_constant, scalar) uniform Push {
    uint first;        // slot of the tile's first pixel, in blocks of 8 × 8
    uint sample_index;
    uint surface;      // number of the surface along the paths; 0: new paths
};

#include "reference/path_sums.glsl"
#include "reference/path_at.glsl"
#include "reference/path_camera.glsl"
#include "reference/path_step.glsl"

// Appends a path to the list of its rays of one kind from this surface.
void append(uint way, uint slot) {
    uint at = path_count(way, surface + 1u);
    uint number = atomicAdd(counts[at].paths, 1u);
    if (number % PATH_GROUP == 0u) atomicAdd(counts[at].groups, 1u);
    lists[path_list(way, surface + 1u) * settings.capacity + number] = slot;
}

void main() {
    uint number = gl_GlobalInvocationID.x;
    if (number >= traced[path_count(ON, surface)].paths) return;
    uint slot = number;
    if (surface > 0u) slot = lists[path_list(ON, surface) * settings.capacity + number];
    uvec2 pixel = pixel_of(first + slot);
    if (any(greaterThanEqual(pixel, settings.extent))) return;
    PathState path;
    if (surface == 0u) path = camera_path(pixel);
    else path = PATH_AT(slot);
    // The light that waited has arrived.
    path.waiting = 0u;
    if (path.alive != 0u) path_surface(pixel, hits[slot], path);
    if ((path.alive | path.waiting) == 0u) {
        add_light(pixel, path);
        return;
    }
    PATH_AT(slot) = path;
    append(ON, slot);
    for (uint turn = 1u; turn < settings.turns; ++turn) {
        uint way = settings.turn_ways[turn];
        if ((path.waiting >> way & 1u) != 0u) append(way, slot);
    }
}
