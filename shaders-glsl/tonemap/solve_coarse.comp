// The coarsest level, of at most TONEMAP_COARSE² pixels, by one group: relaxations red-black and then as many black-red, which makes
// the whole symmetric, as conjugate gradients need it. Right side and solution are freed of their means: the sum of a right side is 0 but for
// rounding, and relaxation would amplify the rest.
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
shared float columns[16];

// Mean over the level of the values of the invocations; 0 outside.
float mean(float value, ivec2 at, ivec2 extent) {
    barrier();
    values[at.y + 1][at.x + 1] = value;
    barrier();
    if (at.y == 0) {
        precise float sum = 0.0;
        for (int y = 1; y <= 16; ++y) {
            sum += values[y][at.x + 1];
        }
        columns[at.x] = sum;
    }
    barrier();
    precise float sum = 0.0;
    for (int x = 0; x < 16; ++x) {
        sum += columns[x];
    }
    barrier();
    return sum / float(extent.x * extent.y);
}

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
    float excess = mean(b, at, extent);
    b = inside ? b - excess : 0.0;
    values[y][x] = 0.0;
    barrier();
    for (int i = 0; i < 4 * SWEEPS; ++i) {
        int colour = i < 2 * SWEEPS ? i & 1 : 1 - (i & 1);
        if (((at.x + at.y) & 1) == colour && sum > 0.0) {
            vec4 around = vec4(values[y][x + 1], values[y][x - 1], values[y + 1][x], values[y - 1][x]);
            values[y][x] = (b + dot(w, around)) / sum;
        }
        barrier();
    }
    float found = values[y][x];
    excess = mean(found, at, extent);
    if (inside) {
        imageStore(solution, at, vec4(found - excess));
    }
}
