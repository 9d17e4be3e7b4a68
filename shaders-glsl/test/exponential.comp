// The exponential shadow test on given depths.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/shadow.glsl"
layout(local_size_x = 64) in;
struct DepthProbe { float receiver; float occluder; float visibility; };
layout(binding = 0, scalar) buffer Probes { DepthProbe probes[]; };
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= probes.length()) return;
    probes[i].visibility = exponential_visibility(probes[i].receiver, probes[i].occluder, shadow_slots[0].exponent);
}
