// Glossy reflection of the environment at the visible surfaces by brute force: a shadow ray to every texel that is not black.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/spread.glsl"
#include "lib/gbuffer.glsl"
#include "lib/trace.glsl"
#include "fiv/fiv.glsl"
#include "fiv/specular.glsl"
#include "lib/vpl.glsl"

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
    uint size;  // texels of the environment along an edge
    uint seed;  // seed for blended surfaces
};

void main() {
    ivec2 pixel = spread_texel();
    if (any(greaterThanEqual(pixel, imageSize(reflected)))) return;
    float z = texelFetch(depth, pixel, 0).r;
    if (z >= 1.0) {
        imageStore(reflected, pixel, vec4(0.0));
        return;
    }
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    vec3 p = screen_position(view, pixel, 1.0, z);
    vec3 v = to_camera(view, p);
    float gap = surface_step(view, p, z);
    vec3 origin = stepped_back(view, p, gap) + n * gap;
    vec4 material = texelFetch(surface, pixel, 0);
    float a2 = fiv_width2(material.a);
    vec3 sum = first == 0u ? vec3(0.0) : imageLoad(reflected, pixel).rgb;
    for (uint k = first; k < first + count; ++k) {
        uint i = lit[k];
        FivTexel t = texels[i];
        if (dot(n, t.area) <= 0.0) continue;
        uint place = i % (size * size);
        vec3 direction = cube_direction(i / (size * size), (vec2(place % size, place / size) + 0.5) / float(size));
        if (trace_any(Ray(origin, 0.0, direction, 1e30), TRACE_SHADOW, pcg4d(uvec4(pixel, i, seed)).x)) continue;
        vec3 l = normalize(t.area);
        sum += t.radiance * (t.angle * fiv_specular_texel(n, v, l, material.rgb, a2, t.angle));
    }
    imageStore(reflected, pixel, vec4(sum, 1.0));
}
