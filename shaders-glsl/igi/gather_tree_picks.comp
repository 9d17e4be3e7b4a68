// Light at the surfaces at the ends of the trees from a few virtual lights picked by the tree over them (as igi/gather_picks.comp).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#define TRACE_BOXES
#include "lib/random.glsl"
#include "lib/trace.glsl"
#include "lib/vpl.glsl"
#include "lib/igi_tree.glsl"
#define VPL_NODES_BINDING 4
#include "lib/vpl_tree.glsl"

layout(local_size_x = 64) in;

layout(binding = 3, scalar) readonly buffer Vpls { Vpl vpls[]; };

layout(push_constant, scalar) uniform Push {
    uint first;      // pick
    uint count;
    uint picks;
    uint leaves;     // of the tree over the virtual lights
    uint nodes;
    float least;     // min_d of the bounded geometry term, metres; 0: none
    uint imperfect;  // 1: boxes of triangles stand for them
    uint seed;
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= nodes || tree_nodes[at].state != TREE_SURFACE) return;
    TreeNode node = tree_nodes[at];
    vec3 origin = node.position + node.normal * node.gap;
    float offset = vpl_offset(uvec2(node.pixel & 0xffffu, node.pixel >> 16u), at % TREE_WIDTH, TREE_WIDTH, seed);
    vec3 sum = vec3(0.0), seen = vec3(0.0);
    uint last = VPL_NO_PICK;
    trace_imperfect = imperfect != 0u;
    for (uint i = first; i < first + count; ++i) {
        float probability;
        float u = min((float(i) + offset) / float(picks), 0.99999994);
        uint k = vpl_pick(u, node.position, node.normal, least, leaves, probability);
        if (k == VPL_NO_PICK) continue;
        if (k != last) {
            last = k;
            Vpl vpl = vpls[k];
            seen = vpl_irradiance(vpl, node.position, node.normal, least) / (probability * float(picks));
            vec3 to = vpl.position + vpl.normal * vpl.gap - origin;
            uint salt = pcg4d(uvec4(node.pixel, at % TREE_WIDTH, k, seed)).x;
            if (seen != vec3(0.0) && trace_any(Ray(origin, 0.0, to, 0.99999), TRACE_SHADOW, salt)) seen = vec3(0.0);
        }
        sum += seen;
    }
    tree_nodes[at].light = node.light + node.weight * node.albedo * (sum / 3.14159265358979);
}
