// Starts short paths at the surfaces of the ray tree nodes.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/random.glsl"
#include "igi/ray_tree.glsl"
#include "igi/near.glsl"

layout(local_size_x = 64) in;

layout(push_constant, scalar) uniform Push {
    uint count;  // nodes
    uint number; // which path of the node
    uint paths;  // paths per node
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= count) return;
    near_paths[at].alive = tree_nodes[at].state == TREE_SURFACE ? 1u : 0u;
    if (tree_nodes[at].state != TREE_SURFACE) return;
    near_paths[at].position = tree_nodes[at].position;
    near_paths[at].normal = tree_nodes[at].normal;
    near_paths[at].salt = pcg4d(uvec4(tree_nodes[at].pixel, tree_branch(at), 0x7ee5u, 0u)).x;
    near_paths[at].side = tree_nodes[at].normal;
    near_paths[at].gap = tree_nodes[at].gap;
    near_paths[at].weight = vec3(1.0 / float(paths));
    if (number == 0u) near_paths[at].light = vec3(0.0);
}
