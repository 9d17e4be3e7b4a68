// The next coarser level of a pyramid of means: of 2 × 2 pixels, or of as many as there are at the end of odd sizes.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/solve.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D fine;
layout(binding = 1, scalar) readonly buffer Solve { TonemapSolve solve; };
layout(binding = 2, r32f) uniform writeonly image2D coarse;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (solve.done != 0u || any(greaterThanEqual(at, imageSize(coarse)))) return;
    // Where a pixel is missing, the other one counts twice.
    ivec2 first = 2 * at;
    ivec2 second = min(first + 1, textureSize(fine, 0) - 1);
    float upper = texelFetch(fine, first, 0).r + texelFetch(fine, ivec2(second.x, first.y), 0).r;
    float lower = texelFetch(fine, ivec2(first.x, second.y), 0).r + texelFetch(fine, second, 0).r;
    imageStore(coarse, at, vec4(0.25 * (upper + lower)));
}
