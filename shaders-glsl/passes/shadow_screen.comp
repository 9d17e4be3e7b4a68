// Shadows of up to four lights at every pixel, for a filter over the picture: the separate screen-sized buffer of the dissertation's section 4.6.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#define LIGHTS_BINDING 4
#define SHADOWS_BINDING 5
#define SHADOW_MAPS_BINDING 6
#include "lib/shadow.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3, rgba16f) uniform writeonly image2D shadow; // a channel for each light: 1 lit, 0 in shadow

layout(push_constant, scalar) uniform Push {
    uint first; // light of the first channel
};

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(shadow)))) {
        return;
    }
    float z = texelFetch(depth, pixel, 0).r;
    vec4 lit = vec4(1.0);
    if (z < 1.0) {
        vec3 n = decode_normal(texelFetch(normal, pixel, 0));
        vec3 p = screen_position(view, pixel, 1.0, z);
        for (uint i = 0u; i < 4u; ++i) {
            if (first + i >= light_count) break;
            float one = shadow_factor(light(first + i), p, n);
            if (i == 0u) lit.x = one;
            else if (i == 1u) lit.y = one;
            else if (i == 2u) lit.z = one;
            else lit.w = one;
        }
    }
    imageStore(shadow, pixel, lit);
}
