// Distances to the nearest surface from the samples of a cluster, in all directions of its cap: the hemispherical depth buffers of section 4.2.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/sampling.glsl"
#include "lib/trace.glsl"
#include "prt/prt.glsl"
#include "prt/cap.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform CapBlock { PrtCap cap; };
layout(binding = 1, scalar) readonly buffer Samples { PrtPoint samples[]; };
// Metres; negative: the direction is below the horizon of the sample.
layout(binding = 2, scalar) writeonly buffer Depths { float depths[]; };

layout(push_constant, scalar) uniform Push {
    uint first;    // direction
    uint count;
    float far;     // distance of nothing, metres
    uint seed;
};

void main() {
    uint sample_number = gl_GlobalInvocationID.x;
    if (sample_number >= cap.samples) return;
    PrtPoint s = samples[cap.first_sample + sample_number];
    uint all = cap.side * cap.side;
    for (uint i = first; i < first + count; ++i) {
        vec3 direction = cap_direction(cap, (vec2(i % cap.side, i / cap.side) + 0.5) / float(cap.side));
        float depth = -1.0;
        if (dot(direction, s.side) > 0.0) {
            Ray ray = Ray(s.position + (s.side + direction) * s.gap, 0.0, direction, far);
            Hit hit = trace(ray, TRACE_SHADOW, pcg4d(uvec4(cap.first_sample + sample_number, i, 11u, seed)).x, false);
            depth = hit.instance == NONE ? far : hit.t;
        }
        depths[sample_number * all + i] = depth;
    }
}
