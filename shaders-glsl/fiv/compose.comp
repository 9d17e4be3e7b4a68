// Radiance that the visible surfaces reflect ([FIV 3]) and emit.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "lib/brdf.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// 1: microfacets lie over the diffuse base, and another pass adds their reflection.
layout(constant_id = 0) const uint LAYERED = 0;

layout(binding = 0) uniform sampler2D albedo;
layout(binding = 1) uniform sampler2D depth;
layout(binding = 2) uniform sampler2D emission;
layout(binding = 3, rgba32f) uniform image2D irradiance; // negative values are set to zero
layout(binding = 4, rgba32f) uniform writeonly image2D total;
layout(binding = 5, scalar) uniform ViewBlock { View view; };
layout(binding = 6) uniform sampler2D normal;
layout(binding = 7) uniform sampler2D surface; // reflectance at normal incidence; a: roughness

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(total)))) return;
    float z = texelFetch(depth, pixel, 0).r;
    if (z >= 1.0) {
        imageStore(total, pixel, vec4(0.0));
        return;
    }
    vec4 color = texelFetch(albedo, pixel, 0);
    vec3 light = max(imageLoad(irradiance, pixel).rgb, vec3(0.0));
    imageStore(irradiance, pixel, vec4(light, 1.0));
    // Unlit surfaces reflect nothing.
    vec3 matt = color.a > 0.5 ? color.rgb : vec3(0.0);
    if (LAYERED != 0u && color.a > 0.5) {
        // The irradiance has no directions, so the base gets the share that it would get from constant radiance.
        vec4 gloss = texelFetch(surface, pixel, 0);
        vec3 n = decode_normal(texelFetch(normal, pixel, 0));
        vec3 v = to_camera(view, screen_position(view, pixel, 1.0, z));
        matt = brdf_of(color.rgb, gloss.rgb, gloss.a, dot(n, v)).matt;
    }
    vec3 reflected = matt * light / 3.14159265358979; // [FIV 3] with an explicit 1/π
    imageStore(total, pixel, vec4(reflected + texelFetch(emission, pixel, 0).rgb, 1.0));
}
