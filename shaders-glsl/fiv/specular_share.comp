// Glossily reflected light of the visible surfaces that occluders leave visible, cell by cell of the environment.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/spread.glsl"
#include "lib/gbuffer.glsl"
#include "fiv/fiv.glsl"
#include "fiv/specular.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint TRILINEAR = 1; // interpolation between samples

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3) uniform sampler2D surface; // reflectance at normal incidence; a: roughness
layout(binding = 4) uniform sampler2D identity;
layout(binding = 5, scalar) readonly buffer Occluders { FivOccluder occluders[]; };
layout(binding = 6, scalar) readonly buffer Fivs { float fivs[]; };
layout(binding = 7, scalar) readonly buffer Lobes { FivLobe lobes[]; };   // one for each cell
layout(binding = 8, scalar) readonly buffer Shares { uint shares[]; };    // a byte for each sample and cell
layout(binding = 9, scalar) readonly buffer Places { uvec2 places[]; };   // first word of each occluder's samples, and of the next rotation sample
layout(binding = 10, scalar) readonly buffer Near { uint near[]; };       // occluders that may affect a tile of pixels, a bit each
layout(binding = 11, rgba32f) uniform image2D whole;                      // reflected light of the cells without occluders, W/(sr·m²)
layout(binding = 12, rgba32f) uniform image2D left;                       // the same with occluders

layout(push_constant, scalar) uniform Push {
    uint first;  // first group of sixteen cells, four words
    uint count;
    uint all;    // words of a sample
    uint words;  // words of a tile of pixels
};

#include "fiv/lookup.glsl"

// Shares that occluder `o` hides of the sixteen cells from word `at` on, if its centre lies at the offset of `cell`.
// Columns are words.
mat4 hidden_of(FivOccluder o, uint first_float, uint begin, FivCell cell, float beyond, uint at) {
    mat4 sum = mat4(0.0);
    float weights = 0.0;
    for (uint k = 0u; k < 8u; ++k) {
        uint number;
        float weight = fiv_corner(o, cell, k, number);
        // Samples inside the occluder are left out, as for irradiance.
        if (weight <= 0.0 || fivs[first_float + FIV_FLOATS * number] >= FIV_INSIDE) continue;
        uint from = begin + number * all + at;
        sum[0] += weight * unpackUnorm4x8(shares[from]);
        sum[1] += weight * unpackUnorm4x8(shares[from + 1u]);
        sum[2] += weight * unpackUnorm4x8(shares[from + 2u]);
        sum[3] += weight * unpackUnorm4x8(shares[from + 3u]);
        weights += weight;
    }
    sum *= weights > 0.0 ? beyond / weights : 0.0;
    // If most of the nearest samples lie inside the occluder, the receiver does too, and all light is hidden.
    float inside = clamp(1.0 - 2.0 * weights, 0.0, 1.0);
    return sum * (1.0 - inside) + mat4(vec4(inside), vec4(inside), vec4(inside), vec4(inside));
}

void main() {
    ivec2 pixel = spread_texel();
    if (any(greaterThanEqual(pixel, imageSize(left)))) return;
    float z = texelFetch(depth, pixel, 0).r;
    if (z >= 1.0) {
        imageStore(whole, pixel, vec4(0.0));
        imageStore(left, pixel, vec4(0.0));
        return;
    }
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    vec3 p = screen_position(view, pixel, 1.0, z);
    vec3 v = to_camera(view, p);
    vec4 material = texelFetch(surface, pixel, 0);
    float a2 = fiv_width2(material.a);
    vec2 shown = texelFetch(identity, pixel, 0).rg;
    uint self = FIV_NONE;
    if (shown.x > 0.5 && abs(shown.y - z) <= 1e-4 * z) self = uint(shown.x + 0.5) - 1u;
    uint tile = fiv_tile(pixel, imageSize(left).x) * words;
    vec3 all_light = first == 0u ? vec3(0.0) : imageLoad(whole, pixel).rgb;
    vec3 left_light = first == 0u ? vec3(0.0) : imageLoad(left, pixel).rgb;
    for (uint at = 4u * first; at < 4u * (first + count); at += 4u) {
        bool front = false;
        for (uint c = 4u * at; c < 4u * at + 16u; ++c) front = front || dot(n, lobes[c].direction) > 0.0;
        if (!front) continue;
        // Several occluders hide independent parts of a cell.
        mat4 seen = mat4(vec4(1.0), vec4(1.0), vec4(1.0), vec4(1.0));
        for (uint w = 0u; w < words; ++w) {
            for (uint bits = near[tile + w]; bits != 0u; bits &= bits - 1u) {
                uint i = 32u * w + uint(findLSB(bits));
                if (i == self) continue;
                FivOccluder o = occluders[i];
                vec3 offset = o.centre - p;
                float rho = length(offset);
                FivCell cell = fiv_cell(o, offset, TRILINEAR != 0u);
                // Beyond the last sphere the hidden light is proportional to the solid angle of the occluder.
                float beyond = min(o.farthest / max(rho, 1e-30), 1.0);
                beyond *= beyond;
                mat4 hidden = hidden_of(o, o.first, places[i].x, cell, beyond, at);
                if (o.blend > 0.0) {
                    hidden = hidden * (1.0 - o.blend) + hidden_of(o, o.second, places[i].y, cell, beyond, at) * o.blend;
                }
                for (uint k = 0u; k < 4u; ++k) seen[k] *= 1.0 - clamp(hidden[k], vec4(0.0), vec4(1.0));
            }
        }
        for (uint k = 0u; k < 16u; ++k) {
            FivLobe lobe = lobes[4u * at + k];
            vec3 light = lobe.power * fiv_specular(n, v, lobe.direction, material.rgb, a2, lobe.spread, lobe.least);
            all_light += light;
            left_light += light * seen[k >> 2u][k & 3u];
        }
    }
    imageStore(whole, pixel, vec4(all_light, 1.0));
    imageStore(left, pixel, vec4(left_light, 1.0));
}
