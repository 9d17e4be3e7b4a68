// The free distance above each sample, for surfaces that lie close to each other.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/trace.glsl"
#include "prt/prt.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Samples { PrtPoint samples[]; };
layout(binding = 1, scalar) writeonly buffer Clearances { float clearances[]; };  // metres

layout(push_constant, scalar) uniform Push {
    uint count;
    float most;    // metres; distances beyond do not differ
    uint seed;
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    PrtPoint s = samples[i];
    Ray ray = Ray(s.position + 2.0 * s.gap * s.side, 0.0, s.side, most);
    Hit hit = trace(ray, TRACE_SHADOW, pcg4d(uvec4(i, 0u, 19u, seed)).x, false);
    clearances[i] = hit.instance == NONE ? most : hit.t;
}
