// Adds the direct light of the visible surfaces for a range of their shadow rays.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/spread.glsl"
#include "lib/gbuffer.glsl"
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/lights.glsl"
#include "lib/sampling.glsl"
#include "lib/brdf.glsl"
#define ENVIRONMENT_BINDING 8
#define ENVIRONMENT_EDGES_BINDING 9
#include "lib/environment_sampling.glsl"
#define LIGHT_COLUMNS_BINDING 10
#define LIGHT_TARGETS_BINDING 11
#define INSTANCE_LIGHTS_BINDING 12
#define LIGHT_NODES_BINDING 16
#include "lib/light_sampling.glsl"
#define SURFACE_BINDING 60
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "igi/igi.glsl"
#include "lib/vpl.glsl"
#include "igi/vpl_surface.glsl"
#include "igi/soft.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D albedo;
layout(binding = 2) uniform sampler2D normal;
layout(binding = 3) uniform sampler2D depth;
layout(binding = 4) uniform sampler2D specular;
layout(binding = 5) uniform sampler2D emission;
layout(binding = 6, rgba32f) uniform image2D direct; // radiance with emission, W/(sr·m²)
layout(binding = 13, scalar) uniform SettingsBlock { IgiSettings settings; };

// 1: light of emissive surfaces and of the sky goes into images of its own, divided by soft_color(); a: difference between
// the luminances of both halves of the samples.
layout(constant_id = 0) const uint APART = 0;
layout(binding = 14, rgba32f) uniform image2D lamps;
layout(binding = 15, rgba32f) uniform image2D sky;

layout(push_constant, scalar) uniform Push {
    uint first; // shadow ray
    uint count;
};

#include "igi/vpl_direct.glsl"

void main() {
    ivec2 pixel = spread_texel();
    if (any(greaterThanEqual(pixel, imageSize(direct)))) return;
    float z = texelFetch(depth, pixel, 0).r;
    vec3 sum = vec3(0.0);
    vec4 from_lamps = vec4(0.0), from_sky = vec4(0.0);
    if (z < 1.0) {
        vec4 color = texelFetch(albedo, pixel, 0);
        vec4 gloss = texelFetch(specular, pixel, 0);
        sum = first == 0u ? texelFetch(emission, pixel, 0).rgb : imageLoad(direct, pixel).rgb;
        LitPoint p;
        p.position = screen_position(view, pixel, 1.0, z);
        p.normal = decode_normal(texelFetch(normal, pixel, 0));
        float gap = surface_step(view, p.position, z);
        p.above = stepped_back(view, p.position, gap) + p.normal * gap;
        p.viewer = to_camera(view, p.position);
        p.brdf = lit_brdf(color.rgb, gloss.rgb, gloss.a, dot(p.normal, p.viewer));
        // Unlit surfaces show their colour, which is in the emission buffer.
        if (APART != 0u && first != 0u) {
            from_lamps = imageLoad(lamps, pixel);
            from_sky = imageLoad(sky, pixel);
        }
        uint sky_from = light_count + settings.tree * settings.samples;
        uint last = color.a > 0.5 ? min(first + count, direct_rays()) : 0u;
        for (uint i = first; i < last; ++i) {
            Ray ray;
            vec3 light = direct_ray(i, p, uvec2(pixel), ray);
            if (light == vec3(0.0)) continue;
            if (trace_any(ray, TRACE_SHADOW, pcg4d(uvec4(pixel, i, settings.seed)).y)) continue;
            if (APART != 0u && i >= light_count) {
                vec3 even = light / soft_color(color.rgb, gloss.rgb);
                uint soft = i - light_count, kinds = (settings.tree + settings.sky) * settings.samples;
                float side = soft < kinds ? soft_side(soft % settings.samples, settings.samples) : soft_side(soft - kinds, settings.glossy);
                vec4 part = vec4(even, side * dot(even, SOFT_LUMINANCE));
                if (i < sky_from) from_lamps += part;
                else from_sky += part;
            } else {
                sum += light;
            }
        }
    }
    if (APART != 0u) {
        imageStore(lamps, pixel, from_lamps);
        imageStore(sky, pixel, from_sky);
    }
    imageStore(direct, pixel, vec4(sum, 1.0));
}
