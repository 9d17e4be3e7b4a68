// Position reconstruction on the GPU: for each probe uv and linear depth, the world position and its round trip.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
layout(local_size_x = 64) in;
struct ViewProbe { vec2 uv; float z; vec3 world; vec2 uv_back; float z_back; };
layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1, scalar) buffer Probes { ViewProbe probes[]; };
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= probes.length()) return;
    vec3 world = world_from_depth(view, probes[i].uv, probes[i].z);
    probes[i].world = world;
    probes[i].uv_back = uv_of(view, world);
    probes[i].z_back = depth_of(view, world);
}
