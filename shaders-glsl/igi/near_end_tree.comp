// Adds the light of the short paths to the ray tree nodes.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "igi/ray_tree.glsl"
#include "igi/near.glsl"

layout(local_size_x = 64) in;

layout(push_constant, scalar) uniform Push {
    uint count; // nodes
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= count || tree_nodes[at].state != TREE_SURFACE) return;
    tree_nodes[at].light += tree_nodes[at].weight * tree_nodes[at].albedo * (near_paths[at].light / 3.14159265358979);
}
