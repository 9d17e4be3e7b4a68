// Irradiance at the visible surfaces from a few virtual lights, picked from the light tree. The light of a pick is divided by its
// probability, so that the mean over seeds is the sum over all virtual lights.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#define TRACE_BOXES
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/spread.glsl"
#include "lib/gbuffer.glsl"
#include "igi/texel.glsl"
#include "lib/random.glsl"
#include "lib/trace.glsl"
#include "lib/vpl.glsl"
#include "igi/vpl_subset.glsl"
#define VPL_NODES_BINDING 5
#include "igi/vpl_tree.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3, scalar) readonly buffer Vpls { Vpl vpls[]; }; // sorted like the leaves of the tree
layout(binding = 4, rgba32f) uniform image2D irradiance; // rgb: irradiance, W/m²; a: number of shadow rays

#include "igi/vpl_picked.glsl"

layout(push_constant, scalar) uniform Push {
    uint first;      // pick
    uint count;
    uint picks;      // per texel
    uint proposals;  // for each pick
    uint leaves;     // of the tree
    uint tile;       // side of the tiles of texels that share stratified picks
    uint factor;     // pixels along the side of a texel
    uint scattered;  // 1: the texel's pixel changes from texel to texel (igi/texel.glsl)
    float least;     // min_d of the bounded geometry term, metres; 0: none
    uint stride;     // above 0: irregular pattern
    uint seed;
};

void main() {
    ivec2 texel = spread_texel();
    if (any(greaterThanEqual(texel, imageSize(irradiance)))) return;
    ivec2 pixel = texel_pixel(texel, factor, scattered != 0u, textureSize(depth, 0));
    vec4 sum = first == 0u ? vec4(0.0) : imageLoad(irradiance, texel);
    float z = texelFetch(depth, pixel, 0).r;
    if (z < 1.0) {
        vec3 p = screen_position(view, pixel, 1.0, z);
        vec3 n = decode_normal(texelFetch(normal, pixel, 0));
        float gap = surface_step(view, p, z);
        uint subset = vpl_subset(uvec2(texel), tile, stride != 0u, seed);
        float offset = vpl_offset(uvec2(texel) / tile, subset, tile * tile, seed);
        Receiver receiver = Receiver(p, n, stepped_back(view, p, gap) + n * gap, offset, uvec2(pixel));
        sum += vpl_picked(receiver, Picking(picks, proposals, leaves, least, seed), first, count);
    }
    imageStore(irradiance, texel, sum);
}
