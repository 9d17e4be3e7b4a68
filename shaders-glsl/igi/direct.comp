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

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D albedo;
layout(binding = 2) uniform sampler2D normal;
layout(binding = 3) uniform sampler2D depth;
layout(binding = 4) uniform sampler2D specular;
layout(binding = 5) uniform sampler2D emission;
layout(binding = 6, rgba32f) uniform image2D direct; // radiance with emission, W/(sr·m²)
layout(binding = 13, scalar) uniform SettingsBlock { IgiSettings settings; };

// 1: light of emissive surfaces and of the sky goes into an image of its own, divided by soft_color(); a: difference between the luminances of
// both halves of the samples, the sum of the differences of both kinds. They do not depend on each other, so the squares add up on average.
layout(constant_id = 0) const uint APART = 0;
layout(binding = 14, rgba32f) uniform image2D soft;

layout(push_constant, scalar) uniform Push {
    uint first; // shadow ray
    uint count;
};

#include "igi/vpl_direct.glsl"
#include "igi/soft.glsl"

// soft_side() of shadow ray i, which is not to a point, spot or directional light.
float direct_side(uint i) {
    bool highlight = i >= first_highlight();
    uint j = highlight ? i - first_highlight() : (i - light_count) % settings.samples;
    return soft_side(j, highlight ? settings.glossy : settings.samples);
}

void main() {
    ivec2 pixel = spread_texel();
    if (any(greaterThanEqual(pixel, imageSize(direct)))) return;
    float z = texelFetch(depth, pixel, 0).r;
    vec3 sum = vec3(0.0);
    vec4 apart = vec4(0.0);
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
        if (APART != 0u && first != 0u) apart = imageLoad(soft, pixel);
        // Unlit surfaces show their colour, which is in the emission buffer.
        uint last = color.a > 0.5 ? min(first + count, direct_rays()) : 0u;
        for (uint i = first; i < last; ++i) {
            Ray ray;
            vec3 light = direct_ray(i, p, uvec2(pixel), ray);
            if (light == vec3(0.0)) continue;
            if (trace_any(ray, TRACE_SHADOW, pcg4d(uvec4(pixel, i, settings.seed)).y)) continue;
            if (APART != 0u && i >= light_count) {
                vec3 even = light / soft_color(color.rgb, gloss.rgb);
                apart += vec4(even, direct_side(i) * dot(even, SOFT_LUMINANCE));
            } else {
                sum += light;
            }
        }
    }
    if (APART != 0u) imageStore(soft, pixel, apart);
    imageStore(direct, pixel, vec4(sum, 1.0));
}
