// Weights of the edges of the next coarser level. An edge between two pixels of 2 × 2 stands for the two rows that cross it: between the
// centres of the pixels each row is half an edge, a whole one and half an edge behind one another (their inverses add), and rows lie side by
// side (they add themselves). This is right for the narrower last pixels of odd sizes as well.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/solve.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// 1: all weights of the fine level are 1.
layout(constant_id = 0) const uint ONES = 0;
// 1: the weights `own_…` of the coarse level itself are added.
layout(constant_id = 1) const uint HAS_OWN = 0;

layout(binding = 0) uniform sampler2D across;
layout(binding = 1) uniform sampler2D down;
layout(binding = 2) uniform sampler2D own_across;
layout(binding = 3) uniform sampler2D own_down;
layout(binding = 4, r32f) uniform writeonly image2D coarse_across;
layout(binding = 5, r32f) uniform writeonly image2D coarse_down;

layout(push_constant, scalar) uniform Push {
    ivec2 fine;  // extent of the fine level
};

float weight(ivec2 at, bool vertical) {
    if (ONES != 0u) return 1.0;
    return vertical ? texelFetch(down, at, 0).r : texelFetch(across, at, 0).r;
}

// A row or column of fine pixels, from pixel `at` along `way`; `fourth`: there is a pixel behind the third.
float behind(ivec2 at, ivec2 way, bool fourth) {
    bool vertical = way.y != 0;
    float inverse = 0.5 / weight(at, vertical) + 1.0 / weight(at + way, vertical);
    if (fourth) inverse += 0.5 / weight(at + 2 * way, vertical);
    return 1.0 / inverse;
}

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    ivec2 extent = imageSize(coarse_across);
    if (any(greaterThanEqual(at, extent))) return;
    ivec2 first = 2 * at;
    vec2 sum = vec2(0.0);
    if (at.x + 1 < extent.x) {
        bool fourth = first.x + 3 < fine.x;
        sum.x = behind(first, ivec2(1, 0), fourth);
        if (first.y + 1 < fine.y) sum.x += behind(first + ivec2(0, 1), ivec2(1, 0), fourth);
        if (HAS_OWN != 0u) sum.x += texelFetch(own_across, at, 0).r;
    }
    if (at.y + 1 < extent.y) {
        bool fourth = first.y + 3 < fine.y;
        sum.y = behind(first, ivec2(0, 1), fourth);
        if (first.x + 1 < fine.x) sum.y += behind(first + ivec2(1, 0), ivec2(0, 1), fourth);
        if (HAS_OWN != 0u) sum.y += texelFetch(own_down, at, 0).r;
    }
    imageStore(coarse_across, at, vec4(sum.x));
    imageStore(coarse_down, at, vec4(sum.y));
}
