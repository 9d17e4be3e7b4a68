// Smooth edges of one picture, second part: each pixel takes its share of its own light and of the light around (`edges.comp`).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "passes/edges.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D weights_before;
layout(binding = 1) uniform sampler2D weights_after;
layout(binding = 2) uniform sampler2D light;
layout(binding = 3, rgba32f) uniform writeonly image2D smoothed;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(smoothed);
    if (any(greaterThanEqual(pixel, size))) return;

    vec4 before = texelFetch(weights_before, pixel, 0), after = texelFetch(weights_after, pixel, 0);
    vec3 around = vec3(0.0);
    float sum = 0.0;
    for (int i = 0; i < EDGE_NEIGHBOURS; ++i) {
        float weight = i < 4 ? before[i] : after[i - 4];
        // Light that is no number must not pass from one surface to another.
        if (weight <= 0.0) continue;
        around += weight * texelFetch(light, pixel + edge_neighbour(i), 0).rgb;
        sum += weight;
    }
    // The middle is one of the places, so the pixel always has a share.
    imageStore(smoothed, pixel, vec4((1.0 - sum) * texelFetch(light, pixel, 0).rgb + around, 1.0));
}
