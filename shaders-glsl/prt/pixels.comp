// Light of the samples at the pixels: a mean over the samples around a point, with Gaussian weights, of the same surface. Each
// pixel gathers the sum that elliptical splats would add up, so that the sum of the weights is one and no order of drawing matters.
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

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint SHOW = PRT_SHOW_LIGHT;
layout(constant_id = 1) const uint GLOSS = 1u;
// 1: direct light by shadow maps is in `mapped`.
layout(constant_id = 2) const uint MAPPED = 0u;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D albedo;
layout(binding = 2) uniform sampler2D normal;
layout(binding = 3) uniform sampler2D depth;
layout(binding = 4) uniform sampler2D specular;
layout(binding = 5) uniform sampler2D emission;
layout(binding = 6) uniform sampler2D mapped;
layout(binding = 7, scalar) readonly buffer Samples { PrtPoint samples[]; };
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

layout(push_constant, scalar) uniform Push {
    uint count;        // samples
    float splat;       // standard deviation of the weights, in distances of samples
    float strength;
    uint first_light;  // of this pass
    uint last;         // 1: the last pass, which adds the indirect light
};

// The light of the samples around a point.
struct PrtNear {
    vec3 irradiance;
    float visible[PRT_LIGHTS];
    uint nearest;
    float away;        // of the nearest one, in distances of samples
};

PrtNear near_samples(vec3 position, vec3 n) {
    PrtNear found;
    found.irradiance = vec3(0.0);
    found.nearest = NONE;
    found.away = 1e30;
    float lights[PRT_LIGHTS];
    uint used = min(light_count - min(first_light, light_count), PRT_LIGHTS);
    for (uint l = 0u; l < PRT_LIGHTS; ++l) lights[l] = 0.0;
    float sum = 0.0;
    float inverse = 0.5 / (splat * splat * grid.radius * grid.radius);
    ivec3 middle = ivec3(floor((position - grid.origin) / grid.cell));
    ivec3 low = max(middle - 1, ivec3(0)), high = min(middle + 1, ivec3(grid.counts) - 1);
    // First with samples that face as the pixel does; a leaf or an edge may have none.
    for (uint turn = 0u; turn < 2u && sum <= 0.0; ++turn) {
        for (int z = low.z; z <= high.z; ++z) {
            for (int y = low.y; y <= high.y; ++y) {
                if (low.x > high.x) continue;
                uint row = prt_cell(grid, ivec3(low.x, y, z));
                uint to = starts[row + uint(high.x - low.x) + 1u];
                for (uint k = starts[row]; k < to; ++k) {
                    uint i = order[k];
                    vec3 way = samples[i].position - position;
                    float facing = dot(samples[i].normal, n);
                    float square = dot(way, way);
                    if (facing <= (turn == 0u ? 0.5 : 0.0)) continue;
                    // Away from the tangent plane counts more, so that light does not leak over steps and between sheets.
                    float off = dot(way, n);
                    square += 64.0 * off * off;
                    float weight = exp(-square * inverse) * facing * facing;
                    if (turn == 1u) weight += 1e-12 / (1e-9 + square);
                    if (square < found.away) {
                        found.away = square;
                        found.nearest = i;
                    }
                    if (weight < 1e-9 && turn == 0u) continue;
                    sum += weight;
                    found.irradiance += weight * irradiances[i];
                    for (uint l = 0u; l < used; ++l) lights[l] += weight * visible[(first_light + l) * count + i];
                }
            }
        }
    }
    float scale = sum > 0.0 ? 1.0 / sum : 0.0;
    found.irradiance *= scale;
    for (uint l = 0u; l < PRT_LIGHTS; ++l) found.visible[l] = lights[l] * scale;
    found.away = sqrt(found.away) / grid.radius;
    return found;
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
    PrtNear found = near_samples(p, n);
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
    vec4 gloss = texelFetch(specular, pixel, 0);
    vec3 lit = vec3(0.0);
    if (MAPPED != 0u) {
        lit = texelFetch(mapped, pixel, 0).rgb;
    } else {
        vec3 v = to_camera(view, p);
        Brdf brdf = brdf_of(color.rgb, GLOSS != 0u ? gloss.rgb : vec3(0.0), gloss.a, dot(n, v));
        lit = first_light == 0u ? texelFetch(emission, pixel, 0).rgb : imageLoad(direct, pixel).rgb;
        for (uint l = 0u; l < PRT_LIGHTS && first_light + l < light_count; ++l) {
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
    // All reflected energy of the light that comes from everywhere, as `albedo.comp` counts it.
    vec3 reflectance = color.rgb + (GLOSS != 0u ? max(gloss.rgb - 0.04, 0.0) : vec3(0.0));
    vec3 bounced = color.a * reflectance * e / BRDF_PI;
    if (first_light == 0u) imageStore(shadow, pixel, vec4(vec3(found.visible[0]), 1.0));
    imageStore(direct, pixel, vec4(lit, 1.0));
    if (last != 0u) {
        imageStore(total, pixel, vec4(lit + bounced, 1.0));
        imageStore(indirect, pixel, vec4(bounced, 1.0));
        imageStore(irradiance, pixel, vec4(e, 1.0));
    }
}
