// Irradiance from a range of virtual lights at the visible surfaces ([IGI 1] without ρ).
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

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3, scalar) readonly buffer Vpls { Vpl vpls[]; };
#include "igi/vpl_gather.glsl"
layout(binding = 4, rgba32f) uniform image2D irradiance; // rgb: irradiance, W/m²; a: number of shadow rays

layout(push_constant, scalar) uniform Push {
    uint first;      // index of the first light within the pixel's subset
    uint count;
    uint total;      // virtual lights
    uint tile;       // side of the interleaving tiles, texels
    uint factor;     // pixels along the side of a texel
    uint scattered;  // 1: the texel's pixel changes from texel to texel (igi/texel.glsl)
    float least;     // min_d of the bounded geometry term, metres; 0: none
    uint stride;     // step of the irregular pattern (vpl_of_subset); 0: regular pattern
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
        uint subset = vpl_subset(uvec2(texel), tile, stride != 0u, seed);
        Gathering how = Gathering(first, count, total, subset, tile * tile, stride, least, seed);
        float gap = surface_step(view, p, z);
        vpl_gather(sum, p, n, stepped_back(view, p, gap) + n * gap, uvec2(pixel), how);
    }
    imageStore(irradiance, texel, sum);
}
