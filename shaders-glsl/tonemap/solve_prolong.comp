// Adds the solution of the next coarser level, bilinearly: a pixel lies a quarter of the way from its own coarse pixel to the next.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/solve.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D coarse;
layout(binding = 1, scalar) readonly buffer Solve { TonemapSolve solve; };
layout(binding = 2, r32f) uniform image2D solution;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (solve.done != 0u || any(greaterThanEqual(at, imageSize(solution)))) return;
    ivec2 near = at >> 1;
    ivec2 far = clamp(near + 2 * (at & 1) - 1, ivec2(0), textureSize(coarse, 0) - 1);
    float upper = mix(texelFetch(coarse, near, 0).r, texelFetch(coarse, ivec2(far.x, near.y), 0).r, 0.25);
    float lower = mix(texelFetch(coarse, ivec2(near.x, far.y), 0).r, texelFetch(coarse, far, 0).r, 0.25);
    imageStore(solution, at, vec4(imageLoad(solution, at).r + mix(upper, lower, 0.25)));
}
