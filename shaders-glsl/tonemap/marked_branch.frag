// The local component where a branch finds the map to say important; the others end at once (thesis 4.4.2.2, the first way).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(location = 0) out float adapted;
layout(binding = 2) uniform sampler2D importance;
#include "tonemap/local.glsl"

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (texelFetch(importance, pixel, 0).r == 0.0) discard;
    adapted = tonemap_local(pixel);
}
