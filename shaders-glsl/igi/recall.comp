// The virtual lights of the last frame, recomputed from the same paths in this frame's scene.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/vpl.glsl"
#include "igi/history.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Candidates { Vpl candidates[]; }; // from the last frame's random numbers, in this frame's scene
layout(binding = 1, scalar) readonly buffer Kept { HistoryVpl kept[]; };
layout(binding = 2, scalar) writeonly buffer Vpls { Vpl vpls[]; };

layout(push_constant, scalar) uniform Push {
    uint count; // virtual lights
    uint total; // candidates
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= count) return;
    HistoryVpl was = kept[at];
    Vpl vpl = candidates[min(was.candidate, total - 1u)];
    vpl.flux *= was.candidate < total ? was.ratio : 0.0;
    vpls[at] = vpl;
}
