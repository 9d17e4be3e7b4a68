// Irradiance of the visible surfaces of the occluders of one geometry, with shadows of this geometry only: a ray to
// every texel that is not black.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "lib/trace.glsl"
#include "fiv/fiv.glsl"
#include "lib/vpl.glsl"
#include "lib/spread.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3) uniform sampler2D identity;
layout(binding = 4, scalar) readonly buffer Occluders { FivOccluder occluders[]; };
layout(binding = 5, scalar) readonly buffer Texels { FivTexel texels[]; };
layout(binding = 6, scalar) readonly buffer Lit { uint lit[]; }; // texels that are not black
layout(binding = 7, scalar) readonly buffer Turns { FivTurn turns[]; };
layout(binding = 8, rgba32f) uniform image2D own; // irradiance, W/m²; a: 1 where the irradiance is known

layout(push_constant, scalar) uniform Push {
    uint first;     // first of the lit texels
    uint count;
    uint size;      // texels of the environment along an edge
    uint set;       // first set of the geometry
    uint sets;
    uint set_floats; // floats of a set
    uint seed;  // seed for blended surfaces
};

void main() {
    ivec2 pixel = spread_texel();
    if (any(greaterThanEqual(pixel, imageSize(own)))) return;
    float z = texelFetch(depth, pixel, 0).r;
    vec2 shown = texelFetch(identity, pixel, 0).rg;
    if (z >= 1.0 || shown.x < 0.5 || abs(shown.y - z) > 1e-4 * z) return;
    uint self = uint(shown.x + 0.5) - 1u;
    uint number = occluders[self].first / set_floats;
    if (number < set || number >= set + sets) return;
    FivTurn turn = turns[number];
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    vec3 p = screen_position(view, pixel, 1.0, z);
    float gap = surface_step(view, p, z);
    vec3 place = stepped_back(view, p, gap) + n * gap - occluders[self].centre;
    vec3 start = turn.centre + turn.geometry_from_world * place;
    vec3 sum = first == 0u ? vec3(0.0) : imageLoad(own, pixel).rgb;
    for (uint k = first; k < first + count; ++k) {
        uint i = lit[k];
        float cosine = dot(n, texels[i].area);
        if (cosine <= 0.0) continue;
        uint at = i % (size * size);
        vec3 direction = cube_direction(i / (size * size), (vec2(at % size, at / size) + 0.5) / float(size));
        Ray ray = Ray(start, 0.0, turn.geometry_from_world * direction, 1e30);
        if (trace_any(ray, TRACE_SHADOW, pcg4d(uvec4(pixel, i, seed)).x)) continue;
        sum += texels[i].radiance * cosine;
    }
    imageStore(own, pixel, vec4(sum, 1.0));
}
