// Adds light to the ray tree nodes: interpolates the irradiance of the cache cells around each node's surface.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/sampling.glsl"
#include "igi/ray_tree.glsl"
#include "igi/cache.glsl"

layout(local_size_x = 64) in;

layout(push_constant, scalar) uniform Push {
    vec3 low;   // corner of the grid, metres
    float side; // side of a cell, metres
    uint nodes;
    uint most;  // maximum of cells
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (cache_count > most || at >= nodes || tree_nodes[at].state != TREE_SURFACE) return;
    TreeNode node = tree_nodes[at];
    ivec3 cell = cache_cell(node.position, low, side);
    uint facing = cache_facing(node.normal);
    uint own = cache_find(cache_key(cell, facing));
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    if (own != CACHE_EMPTY) {
        // A minimal weight, so that the node's own cell is used where no other cell has a weight.
        sum = 1e-3 * cache_cells[own].light;
        weights = 1e-3;
    }
    // On curved surfaces the neighbouring cells may have another facing. `seen` has a bit for each facing that was looked up.
    uint seen = 0u;
    mat3 frame = frame_around(node.normal);
    for (uint tilt = 0u; tilt < 5u; ++tilt) {
        vec2 aside = tilt == 0u ? vec2(0.0) : (tilt & 1u) != 0u ? vec2(tilt == 1u ? 0.3 : -0.3, 0.0) : vec2(0.0, tilt == 2u ? 0.3 : -0.3);
        uint code = cache_facing(normalize(frame * vec3(aside, 1.0)));
        if ((seen >> code & 1u) != 0u) continue;
        seen |= 1u << code;
        for (int i = 0; i < 27; ++i) {
            ivec3 near = cell + ivec3(i % 3, i / 3 % 3, i / 9) - 1;
            if (any(lessThan(near, ivec3(0))) || any(greaterThan(near, ivec3(511)))) continue;
            uint slot = cache_find(cache_key(near, code));
            if (slot == CACHE_EMPTY) continue;
            vec3 apart = cache_cells[slot].position - node.position;
            float away = dot(apart, apart) / (side * side);
            // A distance perpendicular to the surface counts three times.
            float lift = abs(dot(node.normal, apart)) / side;
            float alike = dot(node.normal, cache_cells[slot].normal);
            float w = max(1.0 - away - 8.0 * lift * lift, 0.0) * max(10.0 * alike - 9.0, 0.0);
            sum += w * cache_cells[slot].light;
            weights += w;
        }
    }
    if (weights <= 0.0) return;
    tree_nodes[at].light = node.light + node.weight * node.albedo * (sum / (weights * 3.14159265358979));
}
