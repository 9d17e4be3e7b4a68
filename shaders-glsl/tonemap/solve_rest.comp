// The residual b − Ax, A being the weighted differences to the four neighbours.
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
layout(binding = 4) uniform sampler2D solution;
layout(binding = 5, r32f) uniform writeonly image2D rest;
#include "tonemap/solve_edges.glsl"

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    ivec2 extent = imageSize(rest);
    if (solve.done != 0u || any(greaterThanEqual(at, extent))) return;
    ivec2 last = extent - 1;
    vec4 w = edges_of(at, last);
    float own = texelFetch(solution, at, 0).r;
    vec4 around = vec4(texelFetch(solution, min(at + ivec2(1, 0), last), 0).r, texelFetch(solution, max(at - ivec2(1, 0), ivec2(0)), 0).r,
                       texelFetch(solution, min(at + ivec2(0, 1), last), 0).r, texelFetch(solution, max(at - ivec2(0, 1), ivec2(0)), 0).r);
    imageStore(rest, at, vec4(texelFetch(right, at, 0).r + dot(w, around - own)));
}
