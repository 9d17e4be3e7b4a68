// One level of the operator A (or of the right side b): the flow from a pixel along its edges, and its share of the flow from the
// pixel of the next coarser level, of which it is one of up to four. Along an edge flows weight · (own − other), or minus the value of `flow_…`.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/solve.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint ONES = 0;
// 1: there is a coarser level.
layout(constant_id = 1) const uint HAS_COARSE = 0;
// 1: the flow is given, and is in `across` and `down`.
layout(constant_id = 2) const uint GIVEN = 0;

layout(binding = 0) uniform sampler2D values;
layout(binding = 1) uniform sampler2D across;
layout(binding = 2) uniform sampler2D down;
layout(binding = 3) uniform sampler2D coarse;
layout(binding = 4, scalar) readonly buffer Solve { TonemapSolve solve; };
layout(binding = 5, r32f) uniform writeonly image2D flow;
#include "tonemap/solve_edges.glsl"

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    ivec2 extent = imageSize(flow);
    if (solve.done != 0u || any(greaterThanEqual(at, extent))) return;
    ivec2 last = extent - 1;
    vec4 w = edges_of(at, last);
    float sum;
    if (GIVEN != 0u) {
        sum = w.y - w.x + w.w - w.z;
    } else {
        float own = texelFetch(values, at, 0).r;
        vec4 around = vec4(texelFetch(values, min(at + ivec2(1, 0), last), 0).r, texelFetch(values, max(at - ivec2(1, 0), ivec2(0)), 0).r,
                           texelFetch(values, min(at + ivec2(0, 1), last), 0).r, texelFetch(values, max(at - ivec2(0, 1), ivec2(0)), 0).r);
        sum = dot(w, own - around);
    }
    if (HAS_COARSE != 0u) {
        ivec2 members = min(extent - (at & ~1), ivec2(2));
        sum += texelFetch(coarse, at >> 1, 0).r / float(members.x * members.y);
    }
    imageStore(flow, at, vec4(sum));
}
