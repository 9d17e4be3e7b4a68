// The next direction of the conjugate gradients: p = z + βp.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/solve.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D steepest;
layout(binding = 1, scalar) readonly buffer Solve { TonemapSolve solve; };
layout(binding = 2, r32f) uniform image2D direction;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (solve.done != 0u || any(greaterThanEqual(at, imageSize(direction)))) return;
    imageStore(direction, at, vec4(texelFetch(steepest, at, 0).r + solve.beta * imageLoad(direction, at).r));
}
