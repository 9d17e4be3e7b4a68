// Irradiance from a range of virtual lights at the visible surfaces (Marques and Santos, equation 1 without ρ).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#define TRACE_BOXES
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/spread.glsl"
#include "lib/gbuffer.glsl"
#include "lib/random.glsl"
#include "lib/trace.glsl"
#include "lib/vpl.glsl"
#include "lib/vpl_subset.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3, scalar) readonly buffer Vpls { Vpl vpls[]; };
layout(binding = 4, rgba32f) uniform image2D irradiance; // rgb of a white surface's, W/m²; a: rays traced

layout(push_constant, scalar) uniform Push {
    uint first;      // of the pixel's own lights
    uint count;
    uint total;      // virtual lights
    uint tile;       // side of the tiles of pixels that share the lights
    uint factor;     // pixels along the side of a texel
    float least;     // min_d of the bounded geometry term, metres; 0: none
    uint irregular;  // 1: tiles have their subsets in different orders
    uint seed;
};

void main() {
    ivec2 texel = spread_texel();
    if (any(greaterThanEqual(texel, imageSize(irradiance)))) return;
    ivec2 pixel = min(texel * int(factor) + int(factor) / 2, textureSize(depth, 0) - 1);
    vec4 sum = first == 0u ? vec4(0.0) : imageLoad(irradiance, texel);
    float z = texelFetch(depth, pixel, 0).r;
    if (z < 1.0) {
        vec3 p = screen_position(view, pixel, 1.0, z);
        vec3 n = decode_normal(texelFetch(normal, pixel, 0));
        float gap = surface_step(view, p, z);
        vec3 origin = p + n * gap;
        uint subsets = tile * tile;
        uint subset = vpl_subset(uvec2(texel), tile, irregular != 0u, seed);
        for (uint i = 0u; i < count; ++i) {
            uint k = (first + i) * subsets + subset;
            if (k >= total) break;
            Vpl vpl = vpls[k];
            vec3 light = vpl_irradiance(vpl, p, n, least) * float(subsets);
            if (light == vec3(0.0)) continue;
            vec3 to = vpl.position + vpl.normal * vpl.gap - origin;
            bool hidden = trace_any(Ray(origin, 0.0, to, 0.99999), TRACE_SHADOW, pcg4d(uvec4(pixel, k, seed)).x);
            sum += vec4(hidden ? vec3(0.0) : light, 1.0);
        }
    }
    imageStore(irradiance, texel, sum);
}
