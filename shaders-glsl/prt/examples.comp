// Irradiance at the samples of a cluster by example lights of 1 W/sr.
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
layout(binding = 1, scalar) readonly buffer Places { vec3 places[]; };
// Light after light for each sample.
layout(binding = 2, scalar) writeonly buffer Irradiances { float irradiances[]; };

layout(push_constant, scalar) uniform Push {
    uint first;         // light
    uint count;
    uint first_sample;
    uint receivers;
    uint lights;
    float nearest;      // distances below this one count as this one, metres
    uint seed;
};

void main() {
    uint receiver = gl_GlobalInvocationID.x;
    if (receiver >= receivers) return;
    PrtPoint s = samples[first_sample + receiver];
    for (uint i = first; i < first + count; ++i) {
        vec3 way = places[i] - s.position;
        float far = length(way);
        float cosine = dot(way, s.normal) / far;
        float e = 0.0;
        if (cosine > 0.0 && dot(way, s.side) > 0.0) {
            vec3 direction = way / far;
            Ray ray = Ray(s.position + (s.side + direction) * s.gap, 0.0, direction, far * 0.9999);
            if (!trace_any(ray, TRACE_SHADOW, pcg4d(uvec4(first_sample + receiver, i, 17u, seed)).x)) {
                e = cosine / max(far * far, nearest * nearest);
            }
        }
        irradiances[receiver * lights + i] = e;
    }
}
