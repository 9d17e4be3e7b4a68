// Marks the samples that the lookups of the visible surfaces read, with the same loop over occluders as light.comp.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "fiv/fiv.glsl"
#define FIV_NO_VECTORS
#include "fiv/lookup.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint PARTIAL = 1;
layout(constant_id = 1) const uint OWN = 1;
layout(constant_id = 2) const uint TRILINEAR = 1;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3) uniform sampler2D identity;
layout(binding = 4, scalar) readonly buffer Occluders { FivOccluder occluders[]; };
layout(binding = 5, scalar) buffer Marks { uint marks[]; }; // a bit for each sample

layout(binding = 6, scalar) readonly buffer Near { uint near[]; }; // occluders that may affect a tile of pixels, a bit each

layout(push_constant, scalar) uniform Push {
    uint first; // first word of the occluders
    uint count;
    uint words; // words of a tile
};

void mark(FivOccluder o, vec3 offset) {
    FivCell cell = fiv_cell(o, offset, TRILINEAR != 0u);
    for (uint k = 0u; k < 8u; ++k) {
        uint number;
        if (fiv_corner(o, cell, k, number) <= 0.0) continue;
        uint at = o.first / FIV_FLOATS + number;
        uint bit = 1u << (at & 31u);
        // Neighbouring pixels mark the same samples, and the test saves most atomic operations.
        if ((marks[at >> 5u] & bit) == 0u) atomicOr(marks[at >> 5u], bit);
    }
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, textureSize(depth, 0)))) return;
    float z = texelFetch(depth, pixel, 0).r;
    if (z >= 1.0) return;
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    vec3 p = screen_position(view, pixel, 1.0, z);
    vec2 shown = texelFetch(identity, pixel, 0).rg;
    uint self = 0xffffffffu;
    if (shown.x > 0.5 && abs(shown.y - z) <= 1e-4 * z) self = uint(shown.x + 0.5) - 1u;
    uint tile = fiv_tile(pixel, textureSize(depth, 0).x) * words;
    for (uint w = first; w < first + count; ++w) {
        for (uint bits = near[tile + w]; bits != 0u; bits &= bits - 1u) {
            uint i = 32u * w + uint(findLSB(bits));
            vec3 offset = occluders[i].centre - p;
            if (i == self) {
                if (OWN == 0u) continue;
            } else if (dot(offset, n) <= (PARTIAL != 0u ? -occluders[i].radius : 0.0)) {
                continue;
            }
            mark(occluders[i], offset);
        }
    }
}
