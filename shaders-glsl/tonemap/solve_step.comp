// A step of the conjugate gradients: x += αp, r −= αq.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/solve.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D direction;
layout(binding = 1) uniform sampler2D image;
layout(binding = 2, scalar) readonly buffer Solve { TonemapSolve solve; };
layout(binding = 3, r32f) uniform image2D solution;
layout(binding = 4, r32f) uniform image2D rest;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (solve.done != 0u || any(greaterThanEqual(at, imageSize(solution)))) return;
    imageStore(solution, at, vec4(imageLoad(solution, at).r + solve.alpha * texelFetch(direction, at, 0).r));
    imageStore(rest, at, vec4(imageLoad(rest, at).r - solve.alpha * texelFetch(image, at, 0).r));
}
