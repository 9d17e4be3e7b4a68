// Particles that scatter at random through the scene (Leonhardt and Bohn, section 4.1). Their hits from the sixth on are candidates for samples.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/sampling.glsl"
#include "lib/points.glsl"
#define SURFACE_BINDING 1
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "prt/prt.glsl"

layout(local_size_x = 64) in;

layout(binding = 8, scalar) readonly buffer Starts { vec3 starts[]; };
layout(binding = 9, scalar) writeonly buffer Points { PrtPoint points[]; };
// Hits of each particle, without those that are not kept.
layout(binding = 10, scalar) writeonly buffer Counts { uint counts[]; };

layout(push_constant, scalar) uniform Push {
    uint particles;
    uint first;     // number of the first particle
    uint starts_of; // number of starts
    uint seed;
    float most;     // of the free distances above hits, metres; 0: they are not measured
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= particles) return;
    uint number = first + i;
    PointPlace place = point_place(uvec2(0u), number, POINTS_APART, seed);
    vec3 origin = starts[number % starts_of];
    vec3 direction = sample_sphere(unit_floats(point_words(place, 0u, seed)));
    uint kept = 0u;
    for (uint hits = 0u; hits < PRT_FIRST_HIT + PRT_HITS; ++hits) {
        uint salt = pcg4d(uvec4(number, hits, 7u, seed)).x;
        Hit hit = trace(Ray(origin, 0.0, direction, 1e30), TRACE_SHADOW, salt, false);
        if (hit.instance == NONE) break;
        SurfacePoint p = surface_point(hit.instance, hit.triangle, hit.barycentrics);
        vec3 side = normalize(p.area);
        vec3 normal = normalize(surface_normal(hit.instance, p));
        if (dot(side, direction) > 0.0) {
            side = -side;
            normal = -normal;
        }
        if (any(isnan(side))) break;
        if (any(isnan(normal)) || dot(normal, side) <= 0.0) normal = side;
        float gap = surface_gap(p);
        if (hits >= PRT_FIRST_HIT) {
            float clearance = 0.0;
            if (most > 0.0) {
                Hit above = trace(Ray(p.position + 2.0 * gap * side, 0.0, side, most), TRACE_SHADOW, salt, false);
                clearance = above.instance == NONE ? most : above.t;
            }
            points[i * PRT_HITS + kept] = PrtPoint(p.position, hit.instance, side, hit.triangle, normal,
                INSTANCE_AT(hit.instance).material, hit.barycentrics, gap, clearance, 1.0);
            ++kept;
        }
        // The way that the particle came is free. A step along the normal may end behind another surface that touches this one, inside of furniture.
        origin = p.position - direction * min(gap / max(dot(side, -direction), 1e-4), 0.5 * hit.t);
        direction = frame_around(side) * sample_cosine(unit_floats(point_words(place, hits + 1u, seed)));
    }
    counts[i] = kept;
}
