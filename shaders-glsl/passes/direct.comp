// Direct light of all punctual lights on the G-buffer, with shadows.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#define LIGHTS_BINDING 8
#define SHADOWS_BINDING 9
#define SHADOW_MAPS_BINDING 10
#include "lib/shadow.glsl"
#include "lib/brdf.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// 0: radiometry of glTF lights, reflected by a matt base under microfacets (lib/brdf.glsl). 1: the dissertation's k_dl: colour relative to the
// brightest light, [ISR 16] over distance, cosine; no π; microfacets are added to it.
layout(constant_id = 0) const uint PAPER_LAW = 0;
layout(constant_id = 1) const uint SPECULAR = 1; // 0: Lambert's law alone
layout(constant_id = 2) const uint SCREENED = 0; // lights whose shadows are in `screened`

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D albedo;
layout(binding = 2) uniform sampler2D normal;
layout(binding = 3) uniform sampler2D depth;
layout(binding = 4) uniform sampler2D specular;
layout(binding = 5) uniform sampler2D emission;
layout(binding = 6, rgba16f) uniform writeonly image2D direct;   // all that leaves towards the camera, with emission
layout(binding = 7, rgba16f) uniform writeonly image2D diffuse;  // what leaves in all directions: by Lambert's law, and emission if `glow` is 1

layout(binding = 11) uniform sampler2D screened[4]; // filtered shadows, a channel for each light

layout(push_constant, scalar) uniform Push {
    float light_radius;  // l_r of lights without a range, metres; 0: the camera's far distance
    float light_power;   // l_pow
    uint suns;           // 1: directional lights light, too
    float strength;      // factor on the light of all lights
    uint glow;           // 1: `diffuse` contains emission
};

// [ISR 16]
float paper_attenuation(float distance, float radius) {
    float q = distance / radius;
    return clamp(1.0 - q * q, 0.0, 1.0);
}

// Filtered shadow of a light.
float screened_shadow(uint light, ivec2 pixel) {
    vec4 four;
    switch (light / 4u) {
        case 0u: four = texelFetch(screened[0], pixel, 0); break;
        case 1u: four = texelFetch(screened[1], pixel, 0); break;
        case 2u: four = texelFetch(screened[2], pixel, 0); break;
        default: four = texelFetch(screened[3], pixel, 0); break;
    }
    uint channel = light % 4u;
    return channel == 0u ? four.x : channel == 1u ? four.y : channel == 2u ? four.z : four.w;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(direct)))) {
        return;
    }
    float z = texelFetch(depth, pixel, 0).r;
    if (z >= 1.0) {
        imageStore(direct, pixel, vec4(0.0));
        imageStore(diffuse, pixel, vec4(0.0));
        return;
    }
    vec4 color = texelFetch(albedo, pixel, 0);
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    vec4 gloss = texelFetch(specular, pixel, 0);
    vec3 emitted = texelFetch(emission, pixel, 0).rgb;
    vec3 p = screen_position(view, pixel, 1.0, z);
    vec3 v = to_camera(view, p);

    float brightest = 1e-20;
    if (PAPER_LAW != 0) {
        for (uint i = 0u; i < light_count; ++i) {
            vec3 c = light(i).intensity;
            brightest = max(brightest, max(c.r, max(c.g, c.b)));
        }
    }
    bool layered = SPECULAR != 0 && PAPER_LAW == 0;
    Brdf brdf = brdf_of(color.rgb, SPECULAR != 0 ? gloss.rgb : vec3(0.0), gloss.a, dot(n, v));
    vec3 matt = vec3(0.0);
    vec3 shine = vec3(0.0);
    for (uint i = 0u; i < light_count; ++i) {
        Light one = light(i);
        if (suns == 0u && one.kind == LIGHT_DIRECTIONAL) continue;
        vec3 to_light;
        vec3 e = light_irradiance(one, p, to_light);
        float cosine = dot(n, to_light);
        if (PAPER_LAW != 0) {
            e = one.intensity / brightest * light_power;
            if (one.kind != LIGHT_DIRECTIONAL) {
                float radius = one.range > 0.0 ? one.range : light_radius > 0.0 ? light_radius : view.far;
                e *= paper_attenuation(distance(one.position, p), radius) * light_cone(one, to_light);
            }
        }
        if (cosine <= 0.0 || e == vec3(0.0)) {
            continue;
        }
        e *= strength * (i < SCREENED ? screened_shadow(i, pixel) : shadow_factor(one, p, n));
        matt += e * cosine;
        if (SPECULAR != 0) {
            shine += e * (layered ? brdf_cosine(brdf, n, v, to_light) : brdf_specular_cosine(brdf, n, v, to_light));
        }
    }
    if (gbuffer_unlit(color, gloss)) shine = vec3(0.0);
    vec3 reflected = color.rgb * matt * (PAPER_LAW != 0 ? 1.0 : 1.0 / BRDF_PI);
    imageStore(diffuse, pixel, vec4(reflected + (glow != 0u ? emitted : vec3(0.0)), 1.0));
    imageStore(direct, pixel, vec4((layered ? vec3(0.0) : reflected) + shine + emitted, 1.0));
}
