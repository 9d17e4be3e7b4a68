// Adds the filtered light of the sky and of emissive surfaces, with the surface's colour, to direct light.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "igi/soft.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D albedo;
layout(binding = 1) uniform sampler2D specular;
layout(binding = 2) uniform sampler2D light; // a: below 0 where there is no lit surface
layout(binding = 3, rgba32f) uniform image2D direct;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(direct)))) return;
    vec4 soft = texelFetch(light, pixel, 0);
    if (soft.a < 0.0) return;
    vec3 color = soft_color(texelFetch(albedo, pixel, 0).rgb, texelFetch(specular, pixel, 0).rgb);
    imageStore(direct, pixel, imageLoad(direct, pixel) + vec4(soft.rgb * color, 0.0));
}
