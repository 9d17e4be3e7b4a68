// Light at the pixels: the light of the samples is gathered around each pixel, or comes from images (SPREAD), and lights the surface.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "lib/scene.glsl"
#include "lib/brdf.glsl"
#define LIGHTS_BINDING 17
#include "lib/lights.glsl"
#include "prt/prt.glsl"
#include "prt/lobe.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint SHOW = PRT_SHOW_LIGHT;
layout(constant_id = 1) const uint GLOSS = 1u;
// 1: direct light by shadow maps is in `mapped`.
layout(constant_id = 2) const uint MAPPED = 0u;
// 1: splats or vertices have left sums of weighted light in `spread_light` and `spread_visible`. Pixels that they missed are gathered.
layout(constant_id = 3) const uint SPREAD = 0u;
// 1: glossy surfaces reflect the transferred light by its directions, with `terms`.
layout(constant_id = 4) const uint DIRECTIONS = 0u;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D albedo;
layout(binding = 2) uniform sampler2D normal;
layout(binding = 3) uniform sampler2D depth;
layout(binding = 4) uniform sampler2D specular;
layout(binding = 5) uniform sampler2D emission;
layout(binding = 6) uniform sampler2D mapped;
layout(binding = 7, scalar) readonly buffer Samples { PrtSample samples[]; };
layout(binding = 8, scalar) uniform GridBlock { PrtGrid grid; };
layout(binding = 9, scalar) readonly buffer Starts { uint starts[]; };
layout(binding = 10, scalar) readonly buffer Order { uint order[]; };
layout(binding = 11, scalar) readonly buffer Irradiances { vec3 irradiances[]; };
layout(binding = 12, scalar) readonly buffer Visible { float visible[]; };
layout(binding = 13, scalar) readonly buffer Clusters { uint clusters[]; };
layout(binding = 14, rgba16f) uniform writeonly image2D total;
layout(binding = 15, rgba16f) uniform image2D direct;
layout(binding = 16, rgba16f) uniform writeonly image2D indirect;
layout(binding = 18, rgba16f) uniform writeonly image2D irradiance;
layout(binding = 19, rgba16f) uniform writeonly image2D shadow;  // share of the first light that is seen
layout(binding = 20) uniform sampler2D spread_light;    // rgb: irradiance times weight; a: weight
layout(binding = 21) uniform sampler2D spread_visible;  // shares of PRT_SPREAD_LIGHTS lights times weight
layout(binding = 22, scalar) readonly buffer Terms { vec3 terms[]; };  // directional coefficients, PRT_LOBES of each sample

layout(push_constant, scalar) uniform Push {
    uint count;        // samples
    float splat;       // standard deviation of the weights, in distances of samples
    float strength;
    uint first_light;  // of this pass
    uint last;         // 1: the last pass, which adds the indirect light
};

#include "prt/near.glsl"

PrtNear light_around(ivec2 pixel, vec3 position, vec3 n, PrtKernel kernel) {
    if (SPREAD != 0u) {
        vec4 sum = texelFetch(spread_light, pixel, 0);
        if (sum.a >= PRT_LEAST_WEIGHT) {
            vec4 seen = texelFetch(spread_visible, pixel, 0) / sum.a;
            PrtNear found;
            found.irradiance = sum.rgb / sum.a;
            // Images carry no directions, so the samples around the pixel tell them.
            found.radiance = kernel.glossy ? near_samples(position, n, kernel).radiance : vec3(0.0);
            for (uint l = 0u; l < PRT_LIGHTS; ++l) found.visible[l] = l < PRT_SPREAD_LIGHTS ? seen[l] : 0.0;
            found.nearest = NONE;
            found.away = 0.0;
            return found;
        }
    }
    return near_samples(position, n, kernel);
}

vec3 color_of(uint number) {
    uint hash = number * 2654435761u;
    hash ^= hash >> 15u;
    hash *= 2246822519u;
    hash ^= hash >> 13u;
    return 0.15 + 0.75 * vec3(hash & 255u, hash >> 8u & 255u, hash >> 16u & 255u) / 255.0;
}

void store(ivec2 pixel, vec3 of_total, vec3 of_direct, vec3 of_indirect, vec3 of_irradiance, float share) {
    imageStore(total, pixel, vec4(of_total, 1.0));
    imageStore(direct, pixel, vec4(of_direct, 1.0));
    imageStore(indirect, pixel, vec4(of_indirect, 1.0));
    imageStore(irradiance, pixel, vec4(of_irradiance, 1.0));
    imageStore(shadow, pixel, vec4(vec3(share), 1.0));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(total)))) return;
    float z = texelFetch(depth, pixel, 0).r;
    if (z >= 1.0) {
        store(pixel, vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), 0.0);
        return;
    }
    vec4 color = texelFetch(albedo, pixel, 0);
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    vec3 p = screen_position(view, pixel, 1.0, z);
    uint at_once = SPREAD != 0u ? PRT_SPREAD_LIGHTS : PRT_LIGHTS;
    uint lights = min(light_count - min(first_light, light_count), at_once);
    vec4 gloss = texelFetch(specular, pixel, 0);
    vec3 v = to_camera(view, p);
    Brdf brdf = brdf_of(color.rgb, GLOSS != 0u ? gloss.rgb : vec3(0.0), gloss.a, dot(n, v));
    bool glossy = DIRECTIONS != 0u && last != 0u && brdf.f90 > 0.0;
    PrtNear found = light_around(pixel, p, n, PrtKernel(splat, count, first_light, lights, glossy, prt_lobe(n, v, brdf.alpha)));
    if (SHOW == PRT_SHOW_SAMPLES || SHOW == PRT_SHOW_CLUSTERS) {
        vec3 shown = vec3(0.0);
        if (found.nearest != NONE) {
            bool samples_only = SHOW == PRT_SHOW_SAMPLES;
            shown = color_of(samples_only ? found.nearest : clusters[found.nearest]);
            // Dots of samples.
            if (found.away < (samples_only ? 0.2 : 0.12)) shown *= samples_only ? 0.0 : 0.6;
        }
        store(pixel, shown, shown, shown, shown, 0.0);
        return;
    }
    if (SHOW == PRT_SHOW_TRANSFER) {
        float value = found.irradiance.g;
        vec3 shown = value > 0.0 ? vec3(value, 0.0, 0.0) : vec3(0.0, 0.0, -value);
        store(pixel, shown, shown, shown, vec3(value), 0.0);
        return;
    }
    vec3 lit = vec3(0.0);
    if (MAPPED != 0u) {
        lit = texelFetch(mapped, pixel, 0).rgb;
    } else {
        lit = first_light == 0u ? texelFetch(emission, pixel, 0).rgb : imageLoad(direct, pixel).rgb;
        for (uint l = 0u; l < lights; ++l) {
            Light one = light(first_light + l);
            if (one.kind == LIGHT_DIRECTIONAL) continue;
            vec3 to_light;
            vec3 e = light_irradiance(one, p, to_light) * (strength * found.visible[l]);
            float cosine = dot(n, to_light);
            if (cosine <= 0.0) continue;
            lit += color.a * (GLOSS != 0u ? e * brdf_cosine(brdf, n, v, to_light) : color.rgb * e * cosine / BRDF_PI);
        }
    }
    vec3 e = max(found.irradiance, vec3(0.0));
    // Without directions, the microfacets reflect light that comes from everywhere alike.
    vec3 facing_light = glossy ? found.radiance : e / BRDF_PI;
    vec3 bounced = color.a * (brdf.matt * e / BRDF_PI + brdf.shine * facing_light);
    if (first_light == 0u) imageStore(shadow, pixel, vec4(vec3(found.visible[0]), 1.0));
    imageStore(direct, pixel, vec4(lit, 1.0));
    if (last != 0u) {
        imageStore(total, pixel, vec4(lit + bounced, 1.0));
        imageStore(indirect, pixel, vec4(bounced, 1.0));
        imageStore(irradiance, pixel, vec4(e, 1.0));
    }
}
