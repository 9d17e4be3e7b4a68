// Claims a cache cell for the surface of each ray tree node. The order of the invocations decides in which slot of the hash table a cell
// lies; it decides nothing else, so results are reproducible.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "igi/ray_tree.glsl"
#include "igi/cache.glsl"

layout(local_size_x = 64) in;

layout(push_constant, scalar) uniform Push {
    vec3 low;   // corner of the grid, metres
    float side; // side of a cell, metres
    uint first; // number of the first node within the picture
    uint nodes;
    uint most;  // maximum of cells
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= nodes || tree_nodes[at].state != TREE_SURFACE) return;
    uint key = cache_key(cache_cell(tree_nodes[at].position, low, side), cache_facing(tree_nodes[at].normal));
    uint slot = cache_hash(key);
    for (uint i = 0u; i < CACHE_PROBES; ++i) {
        uint there = cache_keys[slot];
        // With more cells than allowed the cache is not used.
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
    // No free slot was found. A count above the maximum switches the cache off.
    atomicAdd(cache_count, most + 1u);
}
