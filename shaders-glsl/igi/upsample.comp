// Joint bilateral upsampling of the irradiance ([IGI 2], after Kopf et al. 2007).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "igi/texel.glsl"
#include "igi/plane.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint REACH = 1; // coarse texels to each side

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3) uniform sampler2D guide;   // from igi/guide.comp
layout(binding = 4) uniform sampler2D coarse;  // irradiance of every factor-th pixel
layout(binding = 5, rgba32f) uniform writeonly image2D irradiance; // a: luminance of the brightest coarse texel in the neighbourhood
layout(binding = 6, scalar) buffer Unmatched { uint unmatched_count; uint unmatched[]; }; // pixels in any order, x | y << 16

layout(push_constant, scalar) uniform Push {
    uint factor;
    float sigma;     // of the Gaussian, coarse texels
    float sharpness; // exponent of the cosine between normals; the paper's 1
    float range;     // distance from the pixel's plane, relative to its depth, with weight 0.6; 0: the weight ignores depth (paper)
    uint scattered;  // 1: the texel's pixel changes from texel to texel (igi/texel.glsl)
    float least;     // minimum share of the Gaussian on matching coarse texels. With less, a wider Gaussian is tried; if this fails too, the
                     // pixel is listed. 0: the wider Gaussian is tried only if there is no texel at all
};

// With a smaller share of the Gaussian on matching coarse texels, no texel matches, and the most similar one is used.
const float NO_MATCH = 1e-4;

// Factor of the wider Gaussian's standard deviation, and its reach in texels on each side.
const float WIDER = 3.0;
const int WIDE_REACH = 3;

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
    PixelPlane plane = pixel_plane(view, p, z, n, range);
    ivec2 last = textureSize(coarse, 0) - 1;
    // A coarse texel holds the irradiance of the pixel in its middle.
    vec2 at = vec2(pixel - int(factor) / 2) / float(factor);
    ivec2 middle = ivec2(floor(at + 0.5));
    float fall = 0.72134752 / (sigma * sigma); // in powers of 2
    int reach = int(REACH);
    vec4 sum = vec4(0.0), likest = vec4(0.0);
    float weights = 0.0, all = 0.0, most = -1e30, brightest = 0.0;
    bool matched = false;
    for (uint turn = 0u; turn < 2u && !matched; ++turn) {
        for (int y = max(middle.y - reach, 0); y <= min(middle.y + reach, last.y); ++y) {
            for (int x = max(middle.x - reach, 0); x <= min(middle.x + reach, last.x); ++x) {
                ivec2 texel = ivec2(x, y);
                vec4 there = texelFetch(guide, texel, 0);
                if (there.w >= 1.0) continue;
                vec4 value = texelFetch(coarse, texel, 0);
                ivec2 place = texel_pixel(texel, factor, scattered != 0u, full);
                float off = off_plane(plane, (vec2(place) + 0.5) / view.extent, there.w);
                float likeness = max(dot(n, there.xyz), 1e-12);
                vec2 apart = scattered != 0u ? vec2(place - pixel) / float(factor) : vec2(texel) - at;
                if (least > 0.0) brightest = max(brightest, dot(value.rgb, vec3(0.2126, 0.7152, 0.0722)));
                all += exp2(-fall * dot(apart, apart));
                float w = exp2(sharpness * log2(likeness) - fall * dot(apart, apart) - 0.72134752 * off * off);
                sum += w * value;
                weights += w;
                if (likeness - abs(off) > most) {
                    most = likeness - abs(off);
                    likest = value;
                }
            }
        }
        // Next to the background there may be no texel at all in reach.
        matched = least > 0.0 ? all > 0.0 && weights >= least * all : most > -1e29;
        if (matched || turn > 0u) break;
        // A texel further away may have hit the same thin object.
        sum = vec4(0.0);
        weights = all = 0.0;
        reach = WIDE_REACH;
        fall *= 1.0 / (WIDER * WIDER);
    }
    if (!matched && least > 0.0) unmatched[atomicAdd(unmatched_count, 1u)] = uint(pixel.x) | uint(pixel.y) << 16u;
    vec3 found = weights > NO_MATCH * all ? sum.rgb / weights : likest.rgb; // [IGI 2]
    imageStore(irradiance, pixel, vec4(found, brightest));
}
