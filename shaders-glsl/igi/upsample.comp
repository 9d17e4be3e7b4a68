// Joint bilateral upsampling of the irradiance (Marques and Santos, equation 2, after Kopf et al. 2007).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "lib/bilateral.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3) uniform sampler2D coarse;  // irradiance of every factor-th pixel
layout(binding = 4, rgba32f) uniform writeonly image2D irradiance;

layout(push_constant, scalar) uniform Push {
    uint factor;
    float sigma;     // of the Gaussian, coarse texels
    float sharpness; // exponent of the cosine between normals; the paper's 1
    float range;     // distance from the pixel's plane relative to its depth that weighs 0.6; 0: depth does not count (paper)
};

// Below this share of the largest possible weight no coarse texel matches, and the likest is taken.
const float NO_MATCH = 1e-4;
const int REACH = 2;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 full = textureSize(depth, 0);
    if (any(greaterThanEqual(pixel, full))) return;
    float z = texelFetch(depth, pixel, 0).r;
    if (z >= 1.0) {
        imageStore(irradiance, pixel, vec4(0.0));
        return;
    }
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    vec3 p = screen_position(view, pixel, 1.0, z);
    ivec2 last = textureSize(coarse, 0) - 1;
    // A coarse texel holds the light of the pixel in the middle of those it stands for.
    vec2 at = vec2(pixel - int(factor) / 2) / float(factor);
    ivec2 middle = ivec2(floor(at + 0.5));
    vec4 sum = vec4(0.0), likest = vec4(0.0);
    float weights = 0.0, most = -1e30;
    for (int y = -REACH; y <= REACH; ++y) {
        for (int x = -REACH; x <= REACH; ++x) {
            ivec2 texel = middle + ivec2(x, y);
            if (any(lessThan(texel, ivec2(0))) || any(greaterThan(texel, last))) continue;
            ivec2 there = min(texel * int(factor) + int(factor) / 2, full - 1);
            float there_z = texelFetch(depth, there, 0).r;
            if (there_z >= 1.0) continue;
            vec4 value = texelFetch(coarse, texel, 0);
            float likeness = dot(n, decode_normal(texelFetch(normal, there, 0)));
            float off = 0.0;
            if (range > 0.0) off = bilateral_plane_distance(p, n, screen_position(view, there, 1.0, there_z), z * view.far) / range;
            vec2 apart = vec2(texel) - at;
            float w = exp(-0.5 * dot(apart, apart) / (sigma * sigma)) * pow(max(likeness, 0.0), sharpness) * exp(-0.5 * off * off);
            sum += w * value;
            weights += w;
            if (likeness - off > most) {
                most = likeness - off;
                likest = value;
            }
        }
    }
    imageStore(irradiance, pixel, weights < NO_MATCH ? likest : sum / weights);
}
