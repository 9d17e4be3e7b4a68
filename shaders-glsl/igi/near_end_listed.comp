// Adds the light of the short paths to the irradiance of the listed pixels, and dims specks.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "igi/near.glsl"
#include "igi/speck.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, rgba32f) uniform image2D irradiance; // a: luminance of the brightest coarse texel in the neighbourhood
layout(binding = 1, scalar) readonly buffer Unmatched { uint unmatched_count; uint unmatched[]; }; // pixels, x | y << 16

layout(push_constant, scalar) uniform Push {
    uint first;  // first list entry
    uint count;  // list entries
    float limit; // as in igi/refine.comp
};

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= count || first + slot >= unmatched_count) return;
    uint at = unmatched[first + slot];
    ivec2 pixel = ivec2(at & 0xffffu, at >> 16u);
    vec4 before = imageLoad(irradiance, pixel);
    imageStore(irradiance, pixel, vec4(dimmed(before.rgb + near_paths[slot].light, before.a, limit), before.a));
}
