// Writes the motion of the surface that the G-buffer shows. The depth comparison rejects hidden surfaces and alpha cutouts.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/pixel_depth.glsl"

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 6) uniform sampler2D depth;

layout(location = 0) in vec3 before;
layout(location = 1) in vec3 seen; // position in view space, metres

layout(location = 0) out vec4 motion; // xyz: world position in the last frame; w: 1

// Relative difference between the depths of the same surface in two passes, caused by rounding.
const float SAME = 1e-4;

void main() {
    float z = texelFetch(depth, ivec2(gl_FragCoord.xy), 0).r;
    float linear = pixel_depth(view, seen);
    if (z >= 1.0 || abs(linear - z) > SAME * z) discard;
    motion = vec4(before, 1.0);
}
