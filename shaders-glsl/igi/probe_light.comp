// Adds the irradiance from a range of virtual lights at the probes.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#define TRACE_BOXES
#include "lib/view.glsl"
#include "lib/random.glsl"
#include "lib/trace.glsl"
#include "lib/vpl.glsl"
#include "igi/history.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Probes { HistoryProbe probes[]; };
layout(binding = 1, scalar) readonly buffer Vpls { Vpl vpls[]; };
layout(binding = 2, scalar) buffer Lit { vec4 lit[]; }; // rgb: irradiance, W/m²

layout(push_constant, scalar) uniform Push {
    uint probe_count;
    uint first;     // group of `stride` virtual lights
    uint count;     // groups
    uint stride;    // one light of each group of this size is used
    uint total;     // virtual lights
    float least;    // min_d, metres
    uint seed;
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= probe_count) return;
    HistoryProbe probe = probes[at];
    if (probe.there == 0u) return;
    vec3 origin = probe.position + probe.normal * probe.gap;
    vec3 sum = vec3(0.0);
    for (uint i = first; i < first + count; ++i) {
        // A random light of the group, different for each probe. With regular steps all chosen lights would come from one part of a lamp's
        // directions, because every n-th Halton point has the same first digits. The next frame uses the same seed and so the same lights.
        uint k = i * stride + pcg4d(uvec4(at, i, seed, 0x57e9u)).x % stride;
        if (k >= total) break;
        Vpl vpl = vpls[k];
        vec3 light = vpl_irradiance(vpl, probe.position, probe.normal, least);
        if (light == vec3(0.0)) continue;
        vec3 to = vpl.position + vpl.normal * vpl.gap - origin;
        if (!trace_any(Ray(origin, 0.0, to, 0.99999), TRACE_SHADOW, pcg4d(uvec4(at, k, seed, 0x9b0be5u)).x)) sum += light;
    }
    lit[at] += vec4(sum, 0.0);
}
