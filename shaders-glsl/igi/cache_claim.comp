// A cell for every surface at the end of a tree. Where a cell lies in the table depends on who comes first; nothing else does.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/igi_ray_tree.glsl"
#include "lib/igi_cache.glsl"

layout(local_size_x = 64) in;

layout(push_constant, scalar) uniform Push {
    vec3 low;   // corner of the cells, metres
    float side; // of a cell, metres
    uint first; // number of the first node
    uint nodes;
    uint most;  // cells
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= nodes || tree_nodes[at].state != TREE_SURFACE) return;
    uint key = cache_key(cache_cell(tree_nodes[at].position, low, side), cache_facing(tree_nodes[at].normal));
    uint slot = cache_hash(key);
    for (uint i = 0u; i < CACHE_PROBES; ++i) {
        uint there = cache_keys[slot];
        // More cells than allowed: nobody will look at them.
        if (there == CACHE_EMPTY && cache_count > most) return;
        if (there == CACHE_EMPTY) there = atomicCompSwap(cache_keys[slot], CACHE_EMPTY, key);
        if (there == CACHE_EMPTY) {
            uint number = atomicAdd(cache_count, 1u);
            if (number < most) cache_list[number] = slot;
        }
        if (there == CACHE_EMPTY || there == key) {
            atomicMin(cache_cells[slot].node, first + at);
            return;
        }
        slot = (slot + 1u) % CACHE_SLOTS;
    }
    // Nothing free near: as if there were too many.
    atomicAdd(cache_count, most + 1u);
}
