// First half of a red-black relaxation that begins with 0: pixels with an even sum of column and row.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/solve.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint ONES = 0;

layout(binding = 0) uniform sampler2D right;
layout(binding = 1) uniform sampler2D across;
layout(binding = 2) uniform sampler2D down;
layout(binding = 3, scalar) readonly buffer Solve { TonemapSolve solve; };
layout(binding = 4, r32f) uniform writeonly image2D solution;
#include "tonemap/solve_edges.glsl"

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    ivec2 extent = imageSize(solution);
    if (solve.done != 0u || any(greaterThanEqual(at, extent))) return;
    float value = 0.0;
    if (((at.x + at.y) & 1) == 0) {
        float sum = dot(edges_of(at, extent - 1), vec4(1.0));
        value = sum > 0.0 ? texelFetch(right, at, 0).r / sum : 0.0;
    }
    imageStore(solution, at, vec4(value));
}
