// Base luminance of the bilateral operator.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D logarithm;
layout(binding = 1) uniform sampler2D blocks;
layout(binding = 2, r32f) uniform writeonly image2D base;
#include "tonemap/bilateral.glsl"

layout(push_constant, scalar) uniform Push { TonemapBilateral bilateral; };

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(base)))) {
        return;
    }
    float l = bilateral.side == 1 ? bilateral_literal(pixel, bilateral) : bilateral_fast(pixel, bilateral);
    imageStore(base, pixel, vec4(l));
}
