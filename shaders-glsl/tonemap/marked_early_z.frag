// The local component wherever the depth test lets a fragment start. The test is forced to come first: an unimportant pixel costs
// no invocation on any device (thesis 4.4.2.2, the second way).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(early_fragment_tests) in;
layout(location = 0) out float adapted;
#include "tonemap/local.glsl"

void main() {
    adapted = tonemap_local(ivec2(gl_FragCoord.xy));
}
