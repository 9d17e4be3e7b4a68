// Adds the light of a range of virtual lights to the ray tree nodes: from every light and at full resolution, as in the paper.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#define TRACE_BOXES
#include "lib/random.glsl"
#include "lib/trace.glsl"
#include "lib/vpl.glsl"
#include "igi/ray_tree.glsl"

layout(local_size_x = 64) in;

layout(binding = 3, scalar) readonly buffer Vpls { Vpl vpls[]; };

layout(push_constant, scalar) uniform Push {
    uint first;      // virtual light
    uint count;
    uint nodes;
    float least;     // min_d of the bounded geometry term, metres; 0: none
    uint seed;
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= nodes || tree_nodes[at].state != TREE_SURFACE) return;
    TreeNode node = tree_nodes[at];
    vec3 origin = node.position + node.normal * node.gap;
    vec3 sum = vec3(0.0);
    for (uint k = first; k < first + count; ++k) {
        Vpl vpl = vpls[k];
        vec3 light = vpl_irradiance(vpl, node.position, node.normal, least);
        if (light == vec3(0.0)) continue;
        vec3 to = vpl.position + vpl.normal * vpl.gap - origin;
        uint salt = pcg4d(uvec4(node.pixel, tree_branch(at), k, seed)).x;
        if (!trace_any(Ray(origin, 0.0, to, 0.99999), TRACE_SHADOW, salt)) sum += light;
    }
    tree_nodes[at].light = node.light + node.weight * node.albedo * (sum / 3.14159265358979);
}
