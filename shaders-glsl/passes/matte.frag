// 1 where the G-buffer shows this surface: at the depth of the pixel.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/pixel_depth.glsl"

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 4) uniform sampler2D depth; // share of the far plane's distance

layout(location = 0) in vec3 seen; // position in view space, metres

layout(location = 0) out float matte;

// Relative difference between the depths of the same surface in two passes, caused by rounding.
const float SAME = 1e-4;

void main() {
    // Before any branch: its derivatives need whole quads.
    float linear = pixel_depth(view, seen);
    float z = texelFetch(depth, ivec2(gl_FragCoord.xy), 0).r;
    if (z >= 1.0 || abs(linear - z) > SAME * z) discard;
    matte = 1.0;
}
