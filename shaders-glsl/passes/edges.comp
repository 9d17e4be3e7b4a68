// Smooth edges of one picture: the surfaces of further places inside each pixel, without light of their own, take the light of the pixels
// around that show the same surface (subpixel reconstruction, Chajdas, McGuire and Luebke 2011). This pass adds the weights of one place of all
// pixels: the shares of the eight neighbours of each pixel in the light of the place. The rest is the share of the pixel itself.
// `edges_gather.comp` applies the weights.
//
// Two differences from the paper. Where the pixel itself shows the surface of a place, the place has the light of its pixel: the inside of a
// smooth surface stays as it is, with its noise. And colour, reflectance and emission tell surfaces apart as well as plane and normal,
// because a picture or a sheet of paper lies in the plane of its wall or table. Edges in textures and in normal maps become smooth thereby.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "passes/edges.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1, scalar) uniform PlaceBlock { View place_view; }; // looks at the place of each pixel
layout(binding = 2) uniform sampler2D normal;
layout(binding = 3) uniform sampler2D depth;
layout(binding = 4) uniform sampler2D albedo;
layout(binding = 5) uniform sampler2D specular;
layout(binding = 6) uniform sampler2D emission;
layout(binding = 7) uniform sampler2D place_normal;
layout(binding = 8) uniform sampler2D place_depth;
layout(binding = 9) uniform sampler2D place_albedo;
layout(binding = 10) uniform sampler2D place_specular;
layout(binding = 11) uniform sampler2D place_emission;
// Weights of the four neighbours before the pixel, and of the four after it: sums over the places.
layout(binding = 12, rgba32f) uniform image2D weights_before;
layout(binding = 13, rgba32f) uniform image2D weights_after;

layout(push_constant, scalar) uniform Push {
    vec2 place;  // from the middle of the pixel to the right and down, pixels
    float share; // weight of a place
};

// Cosines between normals from which surfaces differ, and from which they are alike.
const vec2 TURNED = vec2(0.8, 0.95);
// Distances from the other surface's plane at which surfaces are alike, and from which they differ, widths of a pixel there.
const vec2 APART = vec2(0.5, 2.0);
// Differences of square roots of colours and reflectances, and relative ones of emission, in the same order.
const vec2 COLOURED = vec2(0.05, 0.2);
const vec2 EMITTING = vec2(0.05, 0.2);
// How fast a pixel loses weight with the square of its distance from the place, pixels.
const float NEAR = 2.0;

struct Surface {
    bool sky;
    vec3 at;
    vec3 n;
    vec3 albedo;
    vec3 f0;
    vec3 emission;
};

float largest(vec3 v) { return max(v.x, max(v.y, v.z)); }

// 1: both texels show the same surface; 0: different ones. `width`: of a pixel, metres.
float alike(Surface a, Surface b, float width) {
    if (a.sky || b.sky) return a.sky && b.sky ? 1.0 : 0.0;
    vec3 way = b.at - a.at;
    float apart = max(abs(dot(a.n, way)), abs(dot(b.n, way)));
    float coloured = max(largest(abs(sqrt(a.albedo) - sqrt(b.albedo))), largest(abs(sqrt(a.f0) - sqrt(b.f0))));
    float emitting = largest(abs(a.emission - b.emission)) / max(max(largest(a.emission), largest(b.emission)), 1e-20);
    return smoothstep(TURNED.x, TURNED.y, dot(a.n, b.n)) * (1.0 - smoothstep(APART.x, APART.y, apart / width))
        * (1.0 - smoothstep(COLOURED.x, COLOURED.y, coloured)) * (1.0 - smoothstep(EMITTING.x, EMITTING.y, emitting));
}

Surface of_place(ivec2 texel) {
    float z = texelFetch(place_depth, texel, 0).r;
    return Surface(z >= BACKGROUND_DEPTH, screen_position(place_view, texel, 1.0, z),
        decode_normal(texelFetch(place_normal, texel, 0)), texelFetch(place_albedo, texel, 0).rgb,
        texelFetch(place_specular, texel, 0).rgb, texelFetch(place_emission, texel, 0).rgb);
}

Surface of_pixel(ivec2 texel) {
    float z = texelFetch(depth, texel, 0).r;
    return Surface(z >= BACKGROUND_DEPTH, screen_position(view, texel, 1.0, z), decode_normal(texelFetch(normal, texel, 0)),
        texelFetch(albedo, texel, 0).rgb, texelFetch(specular, texel, 0).rgb, texelFetch(emission, texel, 0).rgb);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = textureSize(depth, 0);
    if (any(greaterThanEqual(pixel, size))) return;

    Surface here = of_place(pixel);
    float z = texelFetch(place_depth, pixel, 0).r;
    float width = view.pixel_angle * (view.orthographic != 0u ? 1.0 : z * view.far);
    float mine = alike(here, of_pixel(pixel), width);
    if (mine >= 1.0) return;
    float around[EDGE_NEIGHBOURS];
    float sum = 0.0, best = 0.0;
    for (int i = 0; i < EDGE_NEIGHBOURS; ++i) {
        around[i] = 0.0;
        ivec2 offset = edge_neighbour(i);
        ivec2 texel = pixel + offset;
        if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, size))) continue;
        vec2 way = vec2(offset) - place;
        float same = alike(here, of_pixel(texel), width);
        around[i] = exp(-NEAR * dot(way, way)) * same;
        best = max(best, same);
        sum += around[i];
    }
    if (sum <= 0.0) return; // a thing that no pixel shows
    // Pixels that are hardly alike have a small share.
    float scale = share * (1.0 - mine) * best / sum;
    vec4 before = vec4(around[0], around[1], around[2], around[3]);
    vec4 after = vec4(around[4], around[5], around[6], around[7]);
    imageStore(weights_before, pixel, imageLoad(weights_before, pixel) + scale * before);
    imageStore(weights_after, pixel, imageLoad(weights_after, pixel) + scale * after);
}
