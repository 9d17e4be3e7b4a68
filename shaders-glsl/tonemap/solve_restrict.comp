// The right side of the next coarser level, by the transpose of solve_prolong.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/solve.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D rest;
layout(binding = 1, scalar) readonly buffer Solve { TonemapSolve solve; };
layout(binding = 2, r32f) uniform writeonly image2D coarse;

// Share of the coarse pixel `at` in the fine pixel `fine`, along one axis.
float share(int fine, int at, int last) {
    int near = fine >> 1;
    int far = clamp(near + ((fine & 1) == 0 ? -1 : 1), 0, last);
    return (near == at ? 0.75 : 0.0) + (far == at ? 0.25 : 0.0);
}

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    ivec2 extent = imageSize(coarse);
    if (solve.done != 0u || any(greaterThanEqual(at, extent))) return;
    ivec2 last = textureSize(rest, 0) - 1;
    float sum = 0.0;
    for (int y = max(2 * at.y - 1, 0); y <= min(2 * at.y + 2, last.y); ++y) {
        float line = 0.0;
        for (int x = max(2 * at.x - 1, 0); x <= min(2 * at.x + 2, last.x); ++x) {
            line += share(x, at.x, extent.x - 1) * texelFetch(rest, ivec2(x, y), 0).r;
        }
        sum += share(y, at.y, extent.y - 1) * line;
    }
    imageStore(coarse, at, vec4(sum));
}
