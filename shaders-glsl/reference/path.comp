// Path tracing of a tile of pixels, with one sample per pixel. Traces up to `rays` rays of each path; the buffer keeps the path's state
// for the next dispatch. Radiance is summed separately by the number of scatterings along the path: none, one, more.
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
#define ENVIRONMENT_BINDING 8
#define ENVIRONMENT_COLUMNS_BINDING 9
#include "lib/environment_sampling.glsl"
#define LIGHT_COLUMNS_BINDING 10
#define LIGHT_TARGETS_BINDING 11
#define INSTANCE_LIGHTS_BINDING 12
#define LIGHT_NODES_BINDING 16
#include "lib/light_sampling.glsl"
#define SURFACE_BINDING 1
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "reference/path.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 13, scalar) uniform SettingsBlock { PathSettings settings; };
layout(binding = 14, scalar) buffer Paths { PathState paths[]; };
// Layers 0 to PATH_SUMS - 1: sums over samples; then PATH_EXACT_SUMS layers: the rounding errors of the first sums.
layout(binding = 15, rgba32f) uniform image2DArray sums;

layout(push_constant, scalar) uniform Push {
    uint first;    // slot of the tile's first pixel, in blocks of 8 × 8
    uint count;    // slots
    uint sample_index;
    uint turn;     // rays per path in the dispatches before; 0: starts new paths
    uint rays;     // rays per path in this dispatch
};

#include "reference/path_sums.glsl"
#include "reference/path_step.glsl"

// Pixel of a slot. Slots are ordered by blocks of 8 × 8 pixels, so that the rays of a workgroup are close to each other.
uvec2 pixel_of(uint slot) {
    uint block = slot / 64u;
    uint inside = slot % 64u;
    uvec2 corner = 8u * uvec2(block % settings.blocks, block / settings.blocks);
    return corner + uvec2(inside % 8u, inside / 8u);
}

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= count) return;
    uvec2 pixel = pixel_of(first + at);
    if (any(greaterThanEqual(pixel, settings.extent))) return;
    PathState path;
    if (turn == 0u) {
        path = camera_path(pixel);
    } else {
        path = paths[at];
        if ((path.alive | path.waiting) == 0u) return;
    }
    for (uint i = 0u; i < rays && (path.alive | path.waiting) != 0u; ++i) {
        path_step(pixel, settings.turn_ways[(turn + i) % settings.turns], path);
    }
    if ((path.alive | path.waiting) == 0u) add_light(pixel, path);
    paths[at] = path;
}
