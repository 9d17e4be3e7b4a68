// Irradiance of the visible surfaces by brute force: a shadow ray to every texel of the environment that is not black
// ([FIV 6]). It is the reference of all figures of the thesis (Michael 2010, section 5.2.1).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/spread.glsl"
#include "lib/gbuffer.glsl"
#include "lib/trace.glsl"
#include "fiv/fiv.glsl"
#include "lib/vpl.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3, scalar) readonly buffer Texels { FivTexel texels[]; };
layout(binding = 4, scalar) readonly buffer Lit { uint lit[]; }; // texels that are not black
layout(binding = 5, rgba32f) uniform image2D irradiance;         // W/m²
layout(binding = 6, scalar) readonly buffer Boxes { vec3 boxes[]; }; // least and greatest corners of boxes around all instances that block light

layout(push_constant, scalar) uniform Push {
    uint first; // first of the lit texels
    uint count;
    uint size;  // texels of the environment along an edge
    uint around; // number of boxes; 0: there are too many
    uint seed;  // seed for blended surfaces
};

// Whether a box lies on the ray. Where a few objects stand on a ground, most rays pass all boxes.
bool near_anything(vec3 origin, vec3 direction) {
    if (around == 0u) return true;
    vec3 each = 1.0 / mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
    for (uint k = 0u; k < around; ++k) {
        vec3 a = (boxes[2u * k] - origin) * each, b = (boxes[2u * k + 1u] - origin) * each;
        vec3 enter = min(a, b), leave = max(a, b);
        if (max(max(enter.x, enter.y), max(enter.z, 0.0)) <= min(leave.x, min(leave.y, leave.z))) return true;
    }
    return false;
}

void main() {
    ivec2 pixel = spread_texel();
    if (any(greaterThanEqual(pixel, imageSize(irradiance)))) return;
    float z = texelFetch(depth, pixel, 0).r;
    if (z >= 1.0) {
        imageStore(irradiance, pixel, vec4(0.0));
        return;
    }
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    vec3 p = screen_position(view, pixel, 1.0, z);
    float gap = surface_step(view, p, z);
    vec3 origin = stepped_back(view, p, gap) + n * gap;
    vec3 sum = first == 0u ? vec3(0.0) : imageLoad(irradiance, pixel).rgb;
    for (uint k = first; k < first + count; ++k) {
        uint i = lit[k];
        float cosine = dot(n, texels[i].area);
        if (cosine <= 0.0) continue;
        uint place = i % (size * size);
        vec3 direction = cube_direction(i / (size * size), (vec2(place % size, place / size) + 0.5) / float(size));
        if (near_anything(origin, direction) && trace_any(Ray(origin, 0.0, direction, 1e30), TRACE_SHADOW, pcg4d(uvec4(pixel, i, seed)).x)) continue;
        sum += texels[i].radiance * cosine; // [FIV 6]
    }
    imageStore(irradiance, pixel, vec4(sum, 1.0));
}
