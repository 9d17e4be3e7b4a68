// Like igi/gather.comp, with shadow maps of a range of virtual lights instead of shadow rays.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/spread.glsl"
#include "lib/gbuffer.glsl"
#include "igi/texel.glsl"
#include "lib/random.glsl"
#include "lib/vpl.glsl"
#include "igi/vpl_subset.glsl"
#include "lib/sampling.glsl"
#include "igi/vpl_map.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3, scalar) readonly buffer Vpls { Vpl vpls[]; };
layout(binding = 4, rgba32f) uniform image2D irradiance; // rgb: irradiance, W/m²; a: number of map lookups
layout(binding = 5) uniform sampler2DArray maps; // VPL_MAPS layers for each light, starting with light `first`

layout(push_constant, scalar) uniform Push {
    uint first;      // virtual light, a multiple of tile²
    uint count;
    uint tile;       // side of the interleaving tiles, texels
    uint factor;     // pixels along the side of a texel
    uint scattered;  // 1: the texel's pixel changes from texel to texel (igi/texel.glsl)
    float least;     // min_d of the bounded geometry term, metres; 0: none
    uint stride;     // step of the irregular pattern (vpl_of_subset); 0: regular pattern
    uint seed;
    float nearest;   // near plane of the maps, metres
};

// Relative rounding error of a receiver's depth.
const float SLACK = 1e-3;

// Bilinear share of the four texels around `place` that see it from the light.
float unhidden(Vpl vpl, uint number, vec3 place) {
    vec3 from = vpl.position + vpl.normal * vpl.gap;
    vec3 d = transpose(vpl_map_axes(vpl.normal)) * (place - from);
    uint face = vpl_map_face(d);
    vec3 v = vpl_map_turned(d, face);
    // The place lies in front of the near plane, where the map has no casters.
    if (v.z <= nearest) return 1.0;
    vec2 ndc = (v.xy / v.z + 0.5) / 1.5;
    vec2 uv = vec2(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y);
    float own = nearest / v.z * (1.0 + SLACK);
    vec4 stored = textureGather(maps, vec3(uv, float(VPL_MAPS * number + face)));
    vec4 seen = vec4(lessThanEqual(stored, vec4(own)));
    vec2 f = fract(uv * vec2(textureSize(maps, 0).xy) - 0.5);
    return mix(mix(seen.w, seen.z, f.x), mix(seen.x, seen.y, f.x), f.y);
}

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
        vec3 place = stepped_back(view, p, gap) + n * gap;
        uint subsets = tile * tile;
        uint subset = vpl_subset(uvec2(texel), tile, stride != 0u, seed);
        for (uint turn = 0u; turn * subsets < count; ++turn) {
            uint i = vpl_of_subset(first / subsets + turn, subset, subsets, stride) - first;
            if (i >= count) continue;
            Vpl vpl = vpls[first + i];
            vec3 light = vpl_irradiance(vpl, p, n, least) * float(subsets);
            if (light == vec3(0.0)) continue;
            sum += vec4(light * unhidden(vpl, i, place), 1.0);
        }
    }
    imageStore(irradiance, texel, sum);
}
