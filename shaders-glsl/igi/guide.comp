// The guide image of the filters: decoded normal and depth of the pixel for which each coarse texel gathers.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/gbuffer.glsl"
#include "igi/texel.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D normal;
layout(binding = 1) uniform sampler2D depth;
layout(binding = 2, rgba32f) uniform writeonly image2D guide; // xyz: unit normal; w: linear depth / far

layout(push_constant, scalar) uniform Push {
    uint factor;    // pixels along the side of a texel
    uint scattered; // 1: the texel's pixel changes from texel to texel (igi/texel.glsl)
};

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(texel, imageSize(guide)))) return;
    ivec2 pixel = texel_pixel(texel, factor, scattered != 0u, textureSize(depth, 0));
    imageStore(guide, texel, vec4(decode_normal(texelFetch(normal, pixel, 0)), texelFetch(depth, pixel, 0).r));
}
