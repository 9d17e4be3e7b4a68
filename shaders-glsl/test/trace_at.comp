// Many rays through the ray interface, for the benchmark: rays and hits by address, as in reference/path_trace.comp.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "lib/ray.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint ANY = 0; // 1: whether anything is hit; only `instance` is written then, 0 for a hit
layout(constant_id = 1) const uint COUNT = 0; // 1: `triangle` becomes the turns of the loops

layout(push_constant, scalar) uniform Push {
    uvec2 rays_at;
    uvec2 hits_at;
    uint count;
};

#include "lib/trace.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer RaysAt { Ray of[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer HitsAt { Hit of[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    Ray ray = RaysAt(rays_at).of[i];
    Hit hit = Hit(0.0, vec2(0.0), NONE, NONE);
    if (ANY != 0u) {
        hit.instance = trace_any(ray, 0u, 0u) ? 0u : NONE;
    } else {
        hit = trace_closest(ray, 0u, 0u);
    }
    if (COUNT != 0u) hit.triangle = trace_turns;
    HitsAt(hits_at).of[i] = hit;
}
