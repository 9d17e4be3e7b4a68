// Traces one segment of the short paths: a cosine-distributed ray, as long as the bound removes light.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/sampling.glsl"
#define SURFACE_BINDING 60
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "lib/vpl.glsl"
#include "igi/vpl_surface.glsl"
#include "igi/near.glsl"

layout(local_size_x = 64) in;

layout(push_constant, scalar) uniform Push {
    uint count;  // paths
    uint turn;   // number of segments traced before
    uint number; // which path of the receiver
    float least; // min_d of the bounded geometry term, metres
    uint diffuse_only;
    uint slots;  // TEXTURE_SLOTS; not a constant, because compilers would unroll the loop
    uint seed;
};

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= count || near_paths[slot].alive == 0u) return;
    NearPath path = near_paths[slot];
    path.alive = 0u;
    // The R2 sequence (Roberts) spreads the directions of the paths from the same receiver.
    uvec4 words = pcg4d(uvec4(path.salt, turn, seed, 0x6ea5u));
    vec2 u = fract(unit_floats(words.xy) + float(number) * vec2(0.75487767, 0.56984029));
    vec3 direction = normalize(frame_around(path.normal) * sample_cosine(u));
    Ray ray = Ray(path.position + path.side * path.gap, 0.0, direction, 1.2 * least);
    if (dot(direction, path.side) > 0.0) {
        Hit hit = trace_closest(ray, TRACE_SHADOW, pcg4d(uvec4(words.zw, number, turn)).x);
        if (hit.instance != NONE) {
            HitSurface s = hit_surface(hit, direction, slots, diffuse_only != 0u);
            float taken = 1.0 - vpl_bound(least, distance(s.position, path.position));
            path.weight *= s.albedo * (s.rough * taken);
            path.position = s.position;
            path.normal = s.normal;
            path.side = s.side;
            path.gap = s.gap;
            path.alive = path.weight == vec3(0.0) ? 0u : 1u;
        }
    }
    near_paths[slot] = path;
}
