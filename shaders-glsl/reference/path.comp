// Path tracing of some samples of a tile of pixels: what happens at the surfaces that rays have hit. reference/path_trace.comp traces the rays,
// and reference/path_end.comp adds the light of the paths to the sums. Each pass has a list of the paths that it concerns, so that invocations
// side by side do the same, and none waits for a longer path. Radiance is kept apart by the number of scatterings along the path: none, one, more.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_ballot : require
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
#define ENVIRONMENT_EDGES_BINDING 9
#define ENVIRONMENT_EDGES_AT settings.environment_at
#include "lib/environment_sampling.glsl"
#define LIGHT_COLUMNS_BINDING 10
#define LIGHT_TARGETS_BINDING 11
#define INSTANCE_LIGHTS_BINDING 12
#define LIGHT_NODES_BINDING 16
#define LIGHT_NODES_AT settings.light_nodes_at
#define LIGHT_TARGETS_AT settings.light_targets_at
#include "lib/light_sampling.glsl"
#define SURFACE_BINDING 1
#include "lib/hit_surface.glsl"
#include "lib/ray.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
// Paths, hits and lists are read and written by address (reference/path_at.glsl).
layout(binding = 14, scalar) buffer Paths { PathState paths[]; };

layout(binding = 17, scalar) readonly buffer Hits { Hit hits[]; };
layout(binding = 18, scalar) buffer Lists { uint lists[]; };
// path_count(): of the rays that were traced, and of those from here. A pass cannot both have its size from a buffer and write to it.
layout(binding = 19, scalar) readonly buffer Traced { PathCount traced[]; };
layout(binding = 21, scalar) buffer Counts { PathCount counts[]; };

layout(push_constant, scalar) uniform Push {
    uint first;        // reference/path_slots.glsl
    uint sample_index;
    uint surface;      // number of the surface along the paths; 0: new paths
};

#include "reference/path_at.glsl"
#include "reference/path_slots.glsl"
#include "reference/path_camera.glsl"
#include "reference/path_step.glsl"

// Appends paths to the list of their rays of one kind from this surface. One invocation of a subgroup counts for all.
void append(bool wanted, uint way, uint slot) {
    uvec4 those = subgroupBallot(wanted);
    uint more = subgroupBallotBitCount(those);
    uint before = 0u;
    if (more > 0u && subgroupElect()) {
        uint at = path_count(way, surface + 1u);
        before = atomicAdd(counts[at].paths, more);
        uint groups = (before + more + PATH_GROUP - 1u) / PATH_GROUP - (before + PATH_GROUP - 1u) / PATH_GROUP;
        if (groups > 0u) atomicAdd(counts[at].groups, groups);
    }
    before = subgroupBroadcastFirst(before);
    uint number = before + subgroupBallotExclusiveBitCount(those);
    if (wanted) LIST_AT(path_list(way, surface + 1u) * settings.capacity + number) = slot;
}

void main() {
    uint slot = gl_GlobalInvocationID.x;
    bool there = slot < traced[path_count(ON, surface)].paths;
    if (there && surface > 0u) slot = LIST_AT(path_list(ON, surface) * settings.capacity + slot);
    uvec2 pixel = pixel_of(slot);
    there = there && all(lessThan(pixel, settings.extent));
    bool alive = false;
    uint waiting = 0u;
    if (there) {
        Path path;
        path.steps = unpacked_steps(PATH_AT(slot).steps);
        path.origin = PATH_AT(slot).origin;
        path.density = PATH_AT(slot).density;
        path.direction = PATH_AT(slot).direction;
        path.throughput = PATH_AT(slot).throughput;
        waiting = path_surface(pixel, sample_of(slot), slot, HIT_AT(slot), path);
        alive = path.steps.alive;
        PATH_AT(slot).steps = packed_steps(path.steps);
        if (alive) {
            PATH_AT(slot).origin = path.origin;
            PATH_AT(slot).density = path.density;
            PATH_AT(slot).direction = path.direction;
            PATH_AT(slot).throughput = path.throughput;
        }
    }
    append(alive, ON, slot);
    for (uint turn = 1u; turn < settings.turns; ++turn) {
        uint way = settings.turn_ways[turn];
        append((waiting >> way & 1u) != 0u, way, slot);
    }
}
