// One iteration of smoothing the coarse irradiance, or, with a limit, of dimming specks. The filter reads 5 × 5 texels in the same plane
// with a similar normal; their distance doubles with each iteration (Dammertz et al., Edge-Avoiding À-Trous Wavelet Transform for fast
// Global Illumination Filtering, 2010).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "igi/texel.glsl"
#include "igi/plane.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D guide;  // from igi/guide.comp
layout(binding = 2) uniform sampler2D coarse; // irradiance of every factor-th pixel
layout(binding = 3, rgba32f) uniform writeonly image2D irradiance;

layout(push_constant, scalar) uniform Push {
    uint factor;     // pixels along the side of a texel
    uint scattered;  // 1: the texel's pixel changes from texel to texel (igi/texel.glsl)
    uint stride;     // distance of the filter's texels
    float sharpness; // exponent of the cosine between normals
    float range;     // distance from the texel's plane, relative to its depth, with weight 0.6; 0: the weight ignores depth
    float limit;     // above 0: does not smooth, but dims the texel to this ratio to the mean of its neighbours
};

// Minimum weight of the neighbours on the same surface (the texel itself would have 1). With less weight the texel is compared with the
// mean of all neighbours.
const float LEAST_NEIGHBOURS = 0.6;

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = textureSize(coarse, 0);
    if (any(greaterThanEqual(texel, size))) return;
    vec4 own = texelFetch(guide, texel, 0);
    if (own.w >= 1.0) {
        imageStore(irradiance, texel, vec4(0.0));
        return;
    }
    ivec2 full = ivec2(view.extent);
    vec2 at = vec2(texel_pixel(texel, factor, scattered != 0u, full)) + 0.5;
    vec3 p = world_from_depth(view, at / view.extent, own.w);
    PixelPlane plane = pixel_plane(view, p, own.w, own.xyz, range);
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    vec4 around = vec4(0.0); // on any surface
    for (int y = -2; y <= 2; ++y) {
        for (int x = -2; x <= 2; ++x) {
            ivec2 other = texel + ivec2(x, y) * int(stride);
            if (any(lessThan(other, ivec2(0))) || any(greaterThanEqual(other, size))) continue;
            if (limit > 0.0 && other == texel) continue;
            vec4 there = texelFetch(guide, other, 0);
            if (there.w >= 1.0) continue;
            vec2 place = vec2(texel_pixel(other, factor, scattered != 0u, full)) + 0.5;
            float off = off_plane(plane, place / view.extent, there.w);
            float likeness = max(dot(own.xyz, there.xyz), 1e-12);
            // The kernel 1 4 6 4 1 in both directions, as exponents of 2.
            vec2 steps = abs(vec2(x, y));
            vec2 narrow = steps * (0.70751875 * steps - 0.12255625);
            float w = exp2(sharpness * log2(likeness) - narrow.x - narrow.y - 0.72134752 * off * off);
            vec3 value = texelFetch(coarse, other, 0).rgb;
            sum.rgb += w * value;
            weights += w;
            if (limit > 0.0) around += exp2(-narrow.x - narrow.y) * vec4(value, 1.0);
        }
    }
    if (limit > 0.0) {
        vec4 here = texelFetch(coarse, texel, 0);
        const vec3 luminance = vec3(0.2126, 0.7152, 0.0722);
        vec3 usual = weights > LEAST_NEIGHBOURS ? sum.rgb / weights : around.rgb / max(around.a, 1e-30);
        float most = limit * dot(usual, luminance), bright = dot(here.rgb, luminance);
        if (around.a > 0.0 && bright > most) here.rgb *= most / bright;
        imageStore(irradiance, texel, here);
        return;
    }
    // The sum of weights is above 0, because the texel itself has a weight of about 1.
    imageStore(irradiance, texel, vec4(sum.rgb / weights, 0.0));
}
