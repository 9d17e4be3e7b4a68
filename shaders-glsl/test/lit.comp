// Lambertian direct light of all lights with shadows: the least that shows a G-buffer and shadow maps.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/gbuffer.glsl"
#include "lib/shadow.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D albedo;
layout(binding = 2) uniform sampler2D normal;
layout(binding = 3) uniform sampler2D depth;
layout(binding = 4) uniform sampler2D emission;
layout(binding = 5, rgba16f) uniform writeonly image2D lit;
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(lit)))) return;
    float z = texelFetch(depth, pixel, 0).r;
    vec3 sum = vec3(0.0);
    if (z < BACKGROUND_DEPTH) {
        vec3 world = world_from_depth(view, (vec2(pixel) + 0.5) / view.extent, z);
        vec3 n = decode_normal(texelFetch(normal, pixel, 0));
        for (uint i = 0u; i < light_count; ++i) {
            Light l = light(i);
            vec3 to_light;
            vec3 e = light_irradiance(l, world, to_light);
            sum += e * max(dot(n, to_light), 0.0) * shadow_factor(l, world, n);
        }
        sum = sum * texelFetch(albedo, pixel, 0).rgb / 3.14159265 + texelFetch(emission, pixel, 0).rgb;
    }
    imageStore(lit, pixel, vec4(sum, 1.0));
}
