// Half of a red-black relaxation, in place: pixels with an even (colour 0) or odd sum of column and row.
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
layout(binding = 4, r32f) uniform image2D solution;
#include "tonemap/solve_edges.glsl"

layout(push_constant, scalar) uniform Push {
    int colour;
};

void main() {
    ivec2 at = ivec2(2 * gl_GlobalInvocationID.x, gl_GlobalInvocationID.y);
    at.x += (at.y + colour) & 1;
    ivec2 extent = imageSize(solution);
    if (solve.done != 0u || any(greaterThanEqual(at, extent))) return;
    ivec2 last = extent - 1;
    vec4 w = edges_of(at, last);
    float sum = dot(w, vec4(1.0));
    if (sum <= 0.0) return;
    // Neighbours beyond the border have the weight 0.
    vec4 around = vec4(imageLoad(solution, min(at + ivec2(1, 0), last)).r, imageLoad(solution, max(at - ivec2(1, 0), ivec2(0))).r,
                       imageLoad(solution, min(at + ivec2(0, 1), last)).r, imageLoad(solution, max(at - ivec2(0, 1), ivec2(0))).r);
    imageStore(solution, at, vec4((texelFetch(right, at, 0).r + dot(w, around)) / sum));
}
