// The part of a splat in the light of a pixel: a Gaussian of the distance on the surface, and not where the pixel shows another side or plane.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "prt/prt.glsl"

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 4) uniform sampler2D pixel_normal;
layout(binding = 5) uniform sampler2D depth;

layout(location = 0) flat in vec4 place;
layout(location = 1) flat in vec3 normal;
layout(location = 2) flat in vec4 light;    // irradiance; weight
layout(location = 3) flat in vec4 seen;

layout(location = 0) out vec4 light_sum;
layout(location = 1) out vec4 seen_sum;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float z = texelFetch(depth, pixel, 0).r;
    if (z >= 1.0) discard;
    vec3 way = screen_position(view, pixel, 1.0, z) - place.xyz;
    // Away from the tangent plane counts more, so that light does not leak over steps and between sheets.
    vec3 n = decode_normal(texelFetch(pixel_normal, pixel, 0));
    float off = max(abs(dot(way, normal)), abs(dot(way, n)));
    float square = (dot(way, way) + PRT_STEP * off * off) / (place.w * place.w);
    if (square >= PRT_SPLAT_END * PRT_SPLAT_END) discard;
    float facing = dot(n, normal);
    if (facing <= 0.5) discard;
    // Without a step at the rim.
    float weight = (exp(-0.5 * square) - exp(-0.5 * PRT_SPLAT_END * PRT_SPLAT_END)) * facing * facing * light.a;
    light_sum = vec4(light.rgb * weight, weight);
    seen_sum = seen * weight;
}
