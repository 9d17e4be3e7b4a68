// Adds to the ray tree nodes the light of a few virtual lights, picked from the light tree (like igi/gather_picks.comp).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#define TRACE_BOXES
#include "lib/random.glsl"
#include "lib/trace.glsl"
#include "lib/vpl.glsl"
#include "igi/ray_tree.glsl"
#define VPL_NODES_BINDING 4
#include "igi/vpl_tree.glsl"

layout(local_size_x = 64) in;

layout(binding = 3, scalar) readonly buffer Vpls { Vpl vpls[]; };

#include "igi/vpl_picked.glsl"

layout(push_constant, scalar) uniform Push {
    uint first;      // pick
    uint count;
    uint picks;
    uint proposals;  // for each pick
    uint leaves;     // of the light tree
    uint nodes;
    float least;     // min_d of the bounded geometry term, metres; 0: none
    uint seed;
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= nodes || tree_nodes[at].state != TREE_SURFACE) return;
    TreeNode node = tree_nodes[at];
    vec3 origin = node.position + node.normal * node.gap;
    float offset = vpl_offset(uvec2(node.pixel & 0xffffu, node.pixel >> 16u), tree_branch(at), TREE_WIDTH, seed);
    Receiver receiver = Receiver(node.position, node.normal, origin, offset, uvec2(node.pixel, tree_branch(at)));
    vec3 sum = vpl_picked(receiver, Picking(picks, proposals, leaves, least, seed), first, count).rgb;
    tree_nodes[at].light = node.light + node.weight * node.albedo * (sum / 3.14159265358979);
}
