// Chooses one visible point in each square of pixels as a probe of the history. The pixel changes from frame to frame, so that probes also
// hit small objects.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "lib/random.glsl"
#include "lib/vpl.glsl"
#include "igi/history.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3, scalar) writeonly buffer Probes { HistoryProbe probes[]; };

layout(push_constant, scalar) uniform Push {
    uint columns; // of squares
    uint rows;
    uint side;    // pixels
    uint seed;    // changes in each frame
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= columns * rows) return;
    uvec2 square = uvec2(at % columns, at / columns);
    uvec4 words = pcg4d(uvec4(square, seed, 0x9b0be5u));
    ivec2 pixel = min(ivec2(square * side + words.xy % side), textureSize(depth, 0) - 1);
    HistoryProbe probe = HistoryProbe(vec3(0.0), 0.0, vec3(0.0), 0u);
    float z = texelFetch(depth, pixel, 0).r;
    if (z < 1.0) {
        probe.position = screen_position(view, pixel, 1.0, z);
        probe.normal = decode_normal(texelFetch(normal, pixel, 0));
        probe.gap = surface_step(view, probe.position, z);
        probe.position = stepped_back(view, probe.position, probe.gap);
        probe.there = 1u;
    }
    probes[at] = probe;
}
