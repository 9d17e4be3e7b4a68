// Stores for the next frame which candidate each virtual light is, and the ratio of their fluxes.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/vpl.glsl"
#include "igi/history.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Candidates { Vpl candidates[]; }; // first the lights at the first hits of all paths, then those at the second hits, …
layout(binding = 1, scalar) readonly buffer Vpls { Vpl vpls[]; };
layout(binding = 2, scalar) writeonly buffer Kept { HistoryVpl kept[]; };

layout(push_constant, scalar) uniform Push {
    uint count; // virtual lights
    uint paths;
    uint total; // candidates
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= count) return;
    Vpl vpl = vpls[at];
    uint candidate = vpl.depth * paths + vpl.path;
    float has = dot(vpl.flux, vec3(1.0));
    float had = candidate < total ? dot(candidates[candidate].flux, vec3(1.0)) : 0.0;
    kept[at] = HistoryVpl(candidate, has > 0.0 && had > 0.0 ? has / had : 0.0);
}
