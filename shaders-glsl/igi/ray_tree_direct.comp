// Adds direct light to the ray tree nodes for a range of their shadow rays.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/lights.glsl"
#include "lib/sampling.glsl"
#include "lib/brdf.glsl"
#define ENVIRONMENT_BINDING 8
#define ENVIRONMENT_EDGES_BINDING 9
#include "lib/environment_sampling.glsl"
#define LIGHT_COLUMNS_BINDING 10
#define LIGHT_TARGETS_BINDING 11
#define INSTANCE_LIGHTS_BINDING 12
#define LIGHT_NODES_BINDING 16
#include "lib/light_sampling.glsl"
#define SURFACE_BINDING 60
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "igi/igi.glsl"
#include "igi/vpl_surface.glsl"
#include "igi/ray_tree.glsl"

layout(local_size_x = 64) in;

layout(binding = 13, scalar) uniform SettingsBlock { IgiSettings settings; };

layout(push_constant, scalar) uniform Push {
    uint first; // shadow ray
    uint count;
    uint nodes;
};

#include "igi/vpl_direct.glsl"

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= nodes || tree_nodes[at].state != TREE_SURFACE) return;
    TreeNode node = tree_nodes[at];
    Brdf brdf = lit_brdf(node.albedo, node.f0, node.roughness, dot(node.normal, node.direction));
    LitPoint p = LitPoint(node.position, node.position + node.normal * node.gap, node.normal, node.direction, brdf);
    uvec2 place = uvec2(node.pixel, tree_branch(at));
    vec3 sum = vec3(0.0);
    uint last = min(first + count, direct_rays());
    for (uint i = first; i < last; ++i) {
        Ray ray;
        vec3 light = direct_ray(i, p, place, ray);
        if (light == vec3(0.0)) continue;
        if (!trace_any(ray, TRACE_SHADOW, pcg4d(uvec4(place, i, settings.seed)).y)) sum += light;
    }
    tree_nodes[at].light = node.light + node.weight * sum;
}
