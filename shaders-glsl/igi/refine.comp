// Irradiance of the pixels without a matching coarse texel: each gathers from a subset of the virtual lights.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#define TRACE_BOXES
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "lib/random.glsl"
#include "lib/trace.glsl"
#include "lib/vpl.glsl"
#include "igi/vpl_subset.glsl"
#include "igi/speck.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3, scalar) readonly buffer Vpls { Vpl vpls[]; };
layout(binding = 4, rgba32f) uniform image2D irradiance; // a: luminance of the brightest coarse texel in the neighbourhood
layout(binding = 5, scalar) readonly buffer Unmatched { uint unmatched_count; uint unmatched[]; }; // pixels, x | y << 16
#include "igi/vpl_gather.glsl"

layout(push_constant, scalar) uniform Push {
    uint first;      // index of the first light within the pixel's subset
    uint count;
    uint total;      // virtual lights
    uint tile;       // side of the interleaving tiles, texels
    float least;     // min_d of the bounded geometry term, metres; 0: none
    uint stride;     // step of the irregular pattern (vpl_of_subset); 0: regular pattern
    uint seed;
    uint own;        // lights per subset
    uint begin;      // list entry of the first pixel
    float limit;     // above 0: maximum ratio to the luminance of the brightest coarse texel in the neighbourhood
};

void main() {
    uint at = begin + gl_GlobalInvocationID.x;
    if (at >= unmatched_count) return;
    ivec2 pixel = ivec2(unmatched[at] & 0xffffu, unmatched[at] >> 16u);
    vec4 before = imageLoad(irradiance, pixel);
    vec4 sum = first == 0u ? vec4(0.0) : vec4(before.rgb, 0.0);
    float z = texelFetch(depth, pixel, 0).r;
    vec3 p = screen_position(view, pixel, 1.0, z);
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    uint subset = vpl_subset(uvec2(pixel), tile, stride != 0u, seed);
    Gathering how = Gathering(first, count, total, subset, tile * tile, stride, least, seed);
    float gap = surface_step(view, p, z);
    vpl_gather(sum, p, n, stepped_back(view, p, gap) + n * gap, uvec2(pixel), how);
    vec3 light = first + count >= own ? dimmed(sum.rgb, before.a, limit) : sum.rgb;
    imageStore(irradiance, pixel, vec4(light, before.a));
}
