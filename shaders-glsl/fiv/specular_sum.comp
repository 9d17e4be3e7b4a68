// Glossy reflection of the whole environment at the visible surfaces without occluders: a sum over the texels that are
// not black.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "fiv/fiv.glsl"
#include "fiv/specular.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3) uniform sampler2D surface; // reflectance at normal incidence; a: roughness
layout(binding = 4, scalar) readonly buffer Texels { FivTexel texels[]; };
layout(binding = 5, scalar) readonly buffer Lit { uint lit[]; }; // texels that are not black
layout(binding = 6, rgba32f) uniform image2D reflected;          // W/(sr·m²)

layout(push_constant, scalar) uniform Push {
    uint first; // first of the lit texels
    uint count;
};

const uint BLOCK = 64u; // sums of partial sums, so that rounding errors grow with the square root only

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(reflected)))) return;
    float z = texelFetch(depth, pixel, 0).r;
    if (z >= 1.0) {
        imageStore(reflected, pixel, vec4(0.0));
        return;
    }
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    vec3 v = to_camera(view, screen_position(view, pixel, 1.0, z));
    vec4 material = texelFetch(surface, pixel, 0);
    float a2 = fiv_width2(material.a);
    vec3 sum = first == 0u ? vec3(0.0) : imageLoad(reflected, pixel).rgb;
    for (uint block = 0u; block < count; block += BLOCK) {
        vec3 part = vec3(0.0);
        uint end = min(block + BLOCK, count);
        for (uint k = first + block; k < first + end; ++k) {
            FivTexel t = texels[lit[k]];
            vec3 l = normalize(t.area);
            part += t.radiance * (t.angle * fiv_specular_texel(n, v, l, material.rgb, a2, t.angle));
        }
        sum += part;
    }
    imageStore(reflected, pixel, vec4(sum, 1.0));
}
