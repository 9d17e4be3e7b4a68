// Many rays through the ray interface, for tests and benchmarks.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/trace.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 1) const uint COUNT = 0; // 1: `triangle` becomes the turns of the loops
layout(constant_id = 0) const uint ANY = 0; // 1: whether anything is hit; only `instance` is written then, 0 for a hit

layout(binding = 0, scalar) readonly buffer Rays { Ray rays[]; };
layout(binding = 1, scalar) writeonly buffer Hits { Hit hits[]; };
layout(push_constant, scalar) uniform Push { uint count; uint mask; uint salt; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    Hit hit = Hit(0.0, vec2(0.0), NONE, NONE);
    if (ANY != 0u) {
        hit.instance = trace_any(rays[i], mask, salt) ? 0u : NONE;
    } else {
        hit = trace_closest(rays[i], mask, salt);
    }
    if (COUNT != 0u) hit.triangle = trace_turns;
    hits[i] = hit;
}
