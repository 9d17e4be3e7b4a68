// Sets the point at which each cell gathers light: the surface of the cell's node with the lowest number. The choice does not depend on
// the order of the invocations.
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
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= nodes || tree_nodes[at].state != TREE_SURFACE) return;
    vec3 position = tree_nodes[at].position, normal = tree_nodes[at].normal;
    uint slot = cache_find(cache_key(cache_cell(position, low, side), cache_facing(normal)));
    if (slot == CACHE_EMPTY || cache_cells[slot].node != first + at) return;
    cache_cells[slot].position = position;
    cache_cells[slot].gap = tree_nodes[at].gap;
    cache_cells[slot].normal = normal;
    cache_cells[slot].light = vec3(0.0);
}
