// Rays with the density of the cosine that meet nothing near a sample: the share of its hemisphere that is free.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/sampling.glsl"
#include "lib/points.glsl"
#include "lib/trace.glsl"
#include "prt/prt.glsl"
#include "prt/ray.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Samples { PrtPoint samples[]; };
layout(binding = 1, scalar) buffer Free { uint free[]; };  // rays that meet nothing

layout(push_constant, scalar) uniform Push {
    uint first;        // ray of each sample
    uint count;
    uint samples_all;
    float most;        // distance from which a surface is not near, metres
    uint seed;
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= samples_all) return;
    PrtPoint s = samples[i];
    mat3 frame = frame_around(s.side);
    for (uint ray = first; ray < first + count; ++ray) {
        vec3 direction = frame * prt_ray(i, ray, seed);
        Ray way = Ray(s.position + (s.side + direction) * s.gap, 0.0, direction, most);
        if (trace(way, TRACE_SHADOW, pcg4d(uvec4(i, ray, 29u, seed)).x, false).instance == NONE) ++free[i];
    }
}
