// Traces one level of the ray trees of a range of pixels: the ray of each node, to the next surface.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/sampling.glsl"
#include "lib/bsdf.glsl"
#define ENVIRONMENT_BINDING 8
#define ENVIRONMENT_EDGES_BINDING 9
#include "lib/environment_sampling.glsl"
#define SURFACE_BINDING 60
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "igi/igi.glsl"
#include "igi/vpl_surface.glsl"
#include "igi/ray_tree.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 13, scalar) uniform SettingsBlock { IgiSettings settings; };
layout(binding = 14, rgba32f) uniform writeonly image2D sharp; // a: share of the first surface that is mirror or glass

layout(binding = 15) uniform sampler2D depth;

layout(push_constant, scalar) uniform Push {
    uint first;      // slot
    uint count;      // slots
    uint level;
    vec3 background; // radiance, added to the environment's
};

// Relative differences in depth for finding the G-buffer's surface with a ray: first within SAME, then within NEARLY. At grazing angles
// and at cut-out silhouettes a ray through the middle of the pixel hits the surface at another depth than the rasteriser.
const float SAME = 1e-4, NEARLY = 1e-2;

void leave(inout TreeNode node, HitSurface s, bool through, vec3 toward) {
    vec3 ahead = !through ? reflect(toward, s.normal) : s.thin ? toward : refract(toward, s.normal, 1.0 / s.eta);
    node.position = s.position + (through ? -s.side : s.side) * s.gap;
    node.direction = ahead;
    node.state = ahead == vec3(0.0) || node.weight == vec3(0.0) ? TREE_EMPTY : TREE_RAY;
}

void main() {
    uint at = gl_GlobalInvocationID.x;
    uint slot = tree_slot(at), branch = tree_branch(at);
    if (slot >= count) return;
    uvec2 extent = uvec2(view.extent);
    TreeNode node;
    float near = view.near / view.far, z = 1.0;
    if (level == 0u) {
        if (branch != 0u) return;
        uvec2 pixel = pixel_of(first + slot, extent);
        bool inside = all(lessThan(pixel, extent));
        if (inside) z = texelFetch(depth, ivec2(pixel), 0).r;
        vec2 uv = (vec2(pixel) + 0.5) / vec2(extent);
        vec3 direction = view_ray(view, uv);
        node = TreeNode(view_base(view, uv) + near * direction, z < 1.0 ? TREE_RAY : TREE_EMPTY, direction, 0.0,
            vec3(1.0), 1.0, vec3(0.0, 1.0, 0.0), pixel.x | pixel.y << 16u, vec3(0.0), vec3(0.0), vec3(0.0));
        // Clears the nodes that the previous range of pixels may have filled.
        for (uint other = 1u; other < TREE_WIDTH; ++other) {
            tree_nodes[tree_node_of(slot, other)].state = TREE_EMPTY;
            tree_nodes[tree_node_of(slot, other)].light = vec3(0.0);
        }
    } else {
        // Other nodes cannot hold a ray at this level.
        if (branch % max(TREE_WIDTH >> level, 1u) != 0u) return;
        node = tree_nodes[at];
        if (node.state != TREE_RAY) return;
    }
    uvec2 pixel = uvec2(node.pixel & 0xffffu, node.pixel >> 16u);
    uvec4 words = pcg4d(uvec4(node.pixel, level * TREE_WIDTH + branch, settings.seed, 0x7ee5u));
    float share = 0.0;
    if (node.state == TREE_RAY) {
        Hit hit = Hit(0.0, vec2(0.0), NONE, NONE);
        // Level 0 searches the surface in the G-buffer. The G-buffer pass has already decided at random which blended surfaces are hit, so
        // TRACE_SOLID takes all of them as solid. A loop with one call of the trace keeps the shader small.
        uint turns = level == 0u ? 2u : 1u;
        for (uint turn = 0u; turn < turns && hit.instance == NONE; ++turn) {
            float around = turn == 0u ? SAME : NEARLY;
            float from = level == 0u ? max(z * (1.0 - around) - near, 0.0) : 0.0;
            float to = level == 0u ? z * (1.0 + around) - near : 1e30;
            uint mask = level > 0u ? 0u : turn == 0u ? TRACE_CAMERA | TRACE_SOLID : TRACE_CAMERA;
            hit = trace_closest(Ray(node.position, from, node.direction, to), mask, words.x);
        }
        vec3 toward = normalize(node.direction);
        node.state = TREE_EMPTY;
        if (hit.instance == NONE) {
            // The skybox pass draws the sky that the camera sees directly.
            if (level > 0u) {
                vec3 sky = background;
                if (settings.sky != 0u) sky += environment_radiance(settings.environment, toward);
                node.light += node.weight * sky;
            }
        } else {
            HitSurface s = hit_surface(hit, toward, settings.slots, settings.diffuse_only != 0u);
            share = s.glass + s.mirror;
            // The G-buffer's passes light the rough part of the first surface and add its share of the emission. At later surfaces either
            // the rough part or the sharp part is chosen at random.
            node.light += (level > 0u ? node.weight : vec3(share)) * s.emission;
            bool rough = level > 0u && unit_float(words.y) < s.rough;
            if (rough && !s.unlit) {
                node.state = TREE_SURFACE;
                // A step back along the ray, where there is free space (see stepped_back in lib/vpl.glsl).
                node.position = s.position - toward * s.gap;
                node.gap = s.gap;
                node.direction = -toward;
                node.normal = s.normal;
                node.albedo = s.albedo;
                node.f0 = s.f0;
                node.roughness = s.roughness;
            } else if (!rough && share > 0.0 && level < settings.specular_depth) {
                if (level == 0u) node.weight = vec3(share);
                float cosine = clamp(-dot(s.normal, toward), 0.0, 1.0);
                if (unit_float(words.z) * share >= s.glass) {
                    node.weight *= schlick(s.tint, cosine);
                    leave(node, s, false, toward);
                } else {
                    float f = fresnel_dielectric(cosine, s.eta);
                    if (s.thin) f = fresnel_sheet(f);
                    vec3 passes = s.tint / (s.thin ? 1.0 : s.eta * s.eta);
                    uint free = TREE_WIDTH >> (level + 1u);
                    if (free > 0u && f < 1.0) {
                        TreeNode mirrored = node;
                        mirrored.weight *= f;
                        mirrored.light = vec3(0.0);
                        leave(mirrored, s, false, toward);
                        tree_nodes[tree_node_of(slot, branch + free)] = mirrored;
                        node.weight *= (1.0 - f) * passes;
                        leave(node, s, true, toward);
                    } else {
                        bool through = unit_float(words.w) >= f;
                        if (through) node.weight *= passes;
                        leave(node, s, through, toward);
                    }
                }
            }
        }
    }
    if (level == 0u && all(lessThan(pixel, extent))) {
        imageStore(sharp, ivec2(pixel), vec4(0.0, 0.0, 0.0, share));
    }
    tree_nodes[at] = node;
}
