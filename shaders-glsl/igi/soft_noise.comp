// Light with noise, and the variance of its luminance. The squared difference between
// two halves of the samples estimates it. One pixel's difference says little, and bright samples would raise their own variance, so the mean over
// neighbours on the same surface is stored.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "igi/plane.glsl"
#include "igi/soft.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D guide; // from igi/guide.comp
layout(binding = 2) uniform sampler2D soft; // from igi/direct.comp or igi/near_end.comp; a: difference between halves of the samples
layout(binding = 3) uniform sampler2D albedo; // a: 0 for unlit surfaces
layout(binding = 4, rgba32f) uniform writeonly image2D light; // a: variance; -1 where there is no lit surface

layout(push_constant, scalar) uniform Push {
    float sharpness; // exponent of the cosine between normals
    float range;     // distance from the pixel's plane, relative to its depth, with weight 0.6
    uint rare;       // 1: a difference of the pixel itself that is larger than the mean is its variance
};

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(light);
    if (any(greaterThanEqual(pixel, size))) return;
    vec4 own = texelFetch(guide, pixel, 0);
    if (own.w >= 1.0 || texelFetch(albedo, pixel, 0).a <= 0.5) {
        imageStore(light, pixel, vec4(0.0, 0.0, 0.0, -1.0));
        return;
    }
    vec3 p = world_from_depth(view, (vec2(pixel) + 0.5) / view.extent, own.w);
    PixelPlane plane = pixel_plane(view, p, own.w, own.xyz, range);
    float sum = 0.0, weights = 0.0;
    // Every second pixel of 9 × 9.
    for (int y = -4; y <= 4; y += 2) {
        for (int x = -4; x <= 4; x += 2) {
            ivec2 other = pixel + ivec2(x, y);
            if (any(lessThan(other, ivec2(0))) || any(greaterThanEqual(other, size))) continue;
            vec4 there = texelFetch(guide, other, 0);
            if (there.w >= 1.0 || texelFetch(albedo, other, 0).a <= 0.5) continue;
            float off = off_plane(plane, (vec2(other) + 0.5) / view.extent, there.w);
            float likeness = max(dot(own.xyz, there.xyz), 1e-12);
            float w = exp2(sharpness * log2(likeness) - 0.72134752 * off * off);
            float difference = texelFetch(soft, other, 0).a;
            sum += w * difference * difference;
            weights += w;
        }
    }
    // The pixel itself has a weight of about 1.
    float variance = sum / weights;
    vec4 noisy = texelFetch(soft, pixel, 0);
    // A rare bright path stands alone among neighbours with little noise; the mean would take its light for a detail.
    if (rare != 0u) variance = max(variance, noisy.a * noisy.a);
    imageStore(light, pixel, vec4(noisy.rgb, variance));
}
