// The samples that a sample sees along rays with the density of the cosine: a row of the transport operator of one bounce. Each ray has the same
// weight, so a closed white box keeps all light.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/sampling.glsl"
#include "lib/points.glsl"
#include "lib/gbuffer.glsl"
#define SURFACE_BINDING 1
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "prt/prt.glsl"
#include "prt/ray.glsl"

layout(local_size_x = 64) in;

layout(binding = 8, scalar) readonly buffer Samples { PrtPoint samples[]; };
layout(binding = 9, scalar) uniform GridBlock { PrtGrid grid; };
layout(binding = 10, scalar) readonly buffer Starts { uint starts[]; };
layout(binding = 11, scalar) readonly buffer Order { uint order[]; };
// NONE: nothing; PRT_LOST: a surface without samples.
layout(binding = 12, scalar) writeonly buffer Seen { uint seen[]; };
layout(binding = 13, scalar) readonly buffer Candidates { PrtCandidate candidates[]; };
// The first triangle of each instance, and the connected component of each triangle.
layout(binding = 14, scalar) readonly buffer Firsts { uint firsts[]; };
layout(binding = 15, scalar) readonly buffer Components { uint components[]; };

#include "prt/find.glsl"

layout(push_constant, scalar) uniform Push {
    uint first;        // ray
    uint count;
    uint first_sample;
    uint receivers;
    uint rays;         // of each sample
    float slit;        // width of slits without samples, metres
    uint seed;
};

void main() {
    uint receiver = gl_GlobalInvocationID.x;
    if (receiver >= receivers) return;
    uint number = first_sample + receiver;
    PrtPoint s = samples[number];
    mat3 frame = frame_around(s.normal);
    for (uint i = first; i < first + count; ++i) {
        vec3 direction = frame * prt_ray(number, i, seed);
        uint found = NONE;
        if (dot(direction, s.side) > 0.0) {
            Ray ray = Ray(s.position + (s.side + direction) * s.gap, 0.0, direction, 1e30);
            Hit hit = trace(ray, TRACE_SHADOW, pcg4d(uvec4(number, i, 13u, seed)).x, false);
            if (hit.instance != NONE) {
                SurfacePoint p = surface_point(hit.instance, hit.triangle, hit.barycentrics);
                vec3 side = normalize(p.area);
                if (dot(side, direction) > 0.0) side = -side;
                uint component = components[firsts[hit.instance] + hit.triangle];
                float most = PRT_CLEAR * grid.radius;
                // The free distance above the surface tells which samples are in the same gap.
                Ray up = Ray(p.position + 2.0 * surface_gap(p) * side, 0.0, side, most);
                Hit above = trace(up, TRACE_SHADOW, pcg4d(uvec4(number, i, 23u, seed)).x, false);
                float clearance = above.instance == NONE ? most : above.t;
                // Slits have no samples and are dark.
                if (clearance >= slit) found = nearest_sample(p.position, side, component, clearance);
                if (found == NONE) {
                    found = PRT_LOST;
                } else {
                    // The samples around a point share it: a random step in its plane, as wide as the surface of a sample, leads to one of them. The mean over the
                    // steps goes smoothly from sample to sample, where the nearest one alone would make a stair of the light.
                    vec2 away = (unit_floats(pcg4d(uvec4(number, i, 29u, seed)).xy) - 0.5) * sqrt(samples[found].area);
                    uint other = nearest_sample(p.position + frame_around(side) * vec3(away, 0.0), side, component, clearance);
                    if (other != NONE) found = other;
                }
            }
        }
        seen[receiver * rays + i] = found;
    }
}
