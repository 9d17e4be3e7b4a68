// One iteration of the filter for the noise of direct light from the sky and from emissive surfaces, and of compensated light. It exchanges light with 5 × 5 pixels in the
// same plane with a similar normal, whose light differs by no more than their noise explains; their distance doubles with each iteration (Schied
// et al., Spatiotemporal Variance-Guided Filtering, HPG 2017, section 4.3, after Dammertz et al. 2010). There the weighted mean is divided by the
// sum of the weights, which loses light: a rare bright pixel becomes darker, and its neighbours do not become brighter by as much, up to 4 % of the
// direct light under a sunset. Here each pair of pixels exchanges a share of its difference, the same for both, so the sum of the light stays (the
// explicit step of Perona and Malik, Scale-Space and Edge Detection Using Anisotropic Diffusion, 1990).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "igi/soft.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D guide; // from igi/guide.comp
layout(binding = 2) uniform sampler2D light; // a: variance of the luminance; -1 where there is no lit surface
layout(binding = 3, rgba32f) uniform writeonly image2D filtered;

layout(push_constant, scalar) uniform Push {
    uint stride;     // distance of the filter's pixels
    float sharpness; // exponent of the cosine between normals
    float range;     // distance from the pixel's plane, relative to its depth, with weight 0.6
    float contrast;  // standard deviations by which the light of two pixels may differ with weight 0.37
};

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(filtered);
    if (any(greaterThanEqual(pixel, size))) return;
    vec4 own = texelFetch(light, pixel, 0);
    if (own.a < 0.0) {
        imageStore(filtered, pixel, own);
        return;
    }
    vec4 surface = texelFetch(guide, pixel, 0);
    vec3 p = world_from_depth(view, (vec2(pixel) + 0.5) / view.extent, surface.w);
    float bright = dot(own.rgb, SOFT_LUMINANCE);
    // Sum of the kernel in both directions, in which the pixel itself has a weight of 1.
    const float KERNEL = 256.0 / 36.0;
    vec3 gained = vec3(0.0);
    float variance = 0.0, exchanged = 0.0;
    for (int y = -2; y <= 2; ++y) {
        for (int x = -2; x <= 2; ++x) {
            ivec2 other = pixel + ivec2(x, y) * int(stride);
            if (other == pixel || any(lessThan(other, ivec2(0))) || any(greaterThanEqual(other, size))) continue;
            vec4 there = texelFetch(light, other, 0);
            if (there.a < 0.0) continue;
            vec4 beside = texelFetch(guide, other, 0);
            vec3 apart = world_from_depth(view, (vec2(other) + 0.5) / view.extent, beside.w) - p;
            float off = dot(surface.xyz + beside.xyz, apart) / (range * view.far * (surface.w + beside.w));
            float likeness = max(dot(surface.xyz, beside.xyz), 1e-12);
            float differs = abs(dot(there.rgb, SOFT_LUMINANCE) - bright) / (contrast * sqrt(own.a + there.a) + 1e-20);
            // The kernel 1 4 6 4 1 in both directions, as exponents of 2.
            vec2 steps = abs(vec2(x, y));
            vec2 narrow = steps * (0.70751875 * steps - 0.12255625);
            float w = exp2(sharpness * log2(likeness) - narrow.x - narrow.y - 0.72134752 * off * off - 1.44269504 * differs) / KERNEL;
            gained += w * (there.rgb - own.rgb);
            variance += w * w * there.a;
            exchanged += w;
        }
    }
    float kept = 1.0 - exchanged;
    imageStore(filtered, pixel, vec4(own.rgb + gained, variance + kept * kept * own.a));
}
