// Marks the pixels at which the G-buffer shows an object that was added at run time.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/pixel_depth.glsl"

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 6) uniform sampler2D depth;

layout(location = 0) in vec3 seen;

layout(location = 0) out float mask;

void main() {
    float shown = texelFetch(depth, ivec2(gl_FragCoord.xy), 0).r;
    if (abs(pixel_depth(view, seen) - shown) > 1e-4 * shown) discard;
    mask = 1.0;
}
