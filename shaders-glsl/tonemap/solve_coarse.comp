// The coarsest level, of at most TONEMAP_COARSE² pixels, by one group: relaxations red-black and then as many black-red, which makes
// the whole symmetric, as conjugate gradients need it.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/solve.glsl"

layout(local_size_x = 16, local_size_y = 16) in;

layout(constant_id = 0) const uint ONES = 0;

layout(binding = 0) uniform sampler2D right;
layout(binding = 1) uniform sampler2D across;
layout(binding = 2) uniform sampler2D down;
layout(binding = 3, scalar) readonly buffer Solve { TonemapSolve solve; };
layout(binding = 4, r32f) uniform writeonly image2D solution;
#include "tonemap/solve_edges.glsl"

const int SWEEPS = 24;

shared float values[18][18];

void main() {
    ivec2 at = ivec2(gl_LocalInvocationID.xy);
    ivec2 extent = imageSize(solution);
    if (solve.done != 0u) return;
    bool inside = all(lessThan(at, extent));
    vec4 w = vec4(0.0);
    float b = 0.0;
    if (inside) {
        w = edges_of(at, extent - 1);
        b = texelFetch(right, at, 0).r;
    }
    float sum = dot(w, vec4(1.0));
    int x = at.x + 1;
    int y = at.y + 1;
    for (int i = int(gl_LocalInvocationIndex); i < 18 * 18; i += 256) {
        values[i / 18][i % 18] = 0.0;
    }
    barrier();
    for (int i = 0; i < 4 * SWEEPS; ++i) {
        int colour = i < 2 * SWEEPS ? i & 1 : 1 - (i & 1);
        if (((at.x + at.y) & 1) == colour && sum > 0.0) {
            vec4 around = vec4(values[y][x + 1], values[y][x - 1], values[y + 1][x], values[y - 1][x]);
            values[y][x] = (b + dot(w, around)) / sum;
        }
        barrier();
    }
    if (inside) {
        imageStore(solution, at, vec4(values[y][x]));
    }
}
