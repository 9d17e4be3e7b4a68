// Image-space radiosity and ambient occlusion on the coarse buffers (dissertation, listing 6).
// rgb: gathered radiance for a white receiver; a: accumulated occlusion [ISR 26], not clamped.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "isr/isr.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint SAMPLES = 48;
// 0: the dissertation's (2π/N)·F [ISR 25]. 1: F alone, with the footprint of the sample's cell.
layout(constant_id = 1) const uint AREA_ESTIMATOR = 1;
layout(constant_id = 2) const uint RINGS = 1;
layout(constant_id = 3) const uint JITTER = 1;
layout(constant_id = 4) const uint INDIRECT = 1;
layout(constant_id = 5) const uint OCCLUSION = 1;
// dA in the dissertation's sum: 0 the footprint of one texel, 1 of the sample's cell.
layout(constant_id = 7) const uint PAPER_CELLS = 0;
// Depth-buffer tests between the pixel and each sender; 0: senders are taken as visible, as in the dissertation.
layout(constant_id = 6) const uint VISIBILITY_STEPS = 0;

// A sample sends the mean radiance over a quarter of the side of its cell instead of that of one texel.
layout(constant_id = 8) const uint PREFILTER = 0;

// Whether the number of samples depends on the pixel's depth beside the mean depth of the picture.
layout(constant_id = 9) const uint BY_DEPTH = 0;
// Layers behind the visible one that hide senders, 0 to 3.
layout(constant_id = 10) const uint PEELED = 0;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D sender;  // rgb radiance, a radiation mask
layout(binding = 2) uniform sampler2D albedo;  // a: radiation mask of the receiver
layout(binding = 3) uniform sampler2D normal;  // world, not normalised
layout(binding = 4) uniform sampler2D depth;   // linear z / far; background 1
layout(binding = 5, rgba16f) uniform writeonly image2D gathered;
layout(binding = 6) uniform sampler2D filtered;  // mip levels of the senders, rgb times mask
layout(binding = 7) uniform sampler2D mean_depth;  // mip levels: r linear depth of geometry, g share of geometry
layout(binding = 8) uniform sampler2D peeled[3];   // linear depth of further layers, in a picture wider by peeled_scale
layout(binding = 9, rgba16f) uniform writeonly image2D seen;  // r: sum of the form factors of the senders

layout(push_constant, scalar) uniform Push {
    float reach;            // of the indirect samples, coarse pixels
    float occlusion_reach;  // of the occlusion samples, coarse pixels
    float occluder_radius;  // sides of the sample's cell
    float occlusion_bias;   // subtracted from the cosine
    float spread;           // exponent of the ring radii
    float thickness;        // of what hides a sender, relative to its depth
    float factor;           // 2 on half-resolution buffers, 1 on full
    float peeled_scale;
};

// Bound on the sum of form factors: see reference::isr::MOST.
const float MOST = 2.0;

// Whether something lies between P and X: compares the depth buffer with the line between them, along which 1/z is linear in
// the image under perspective, and z under orthographic projection.
bool hidden(ivec2 from, ivec2 to, float z_from, float z_to) {
    for (uint i = 1u; i <= VISIBILITY_STEPS; ++i) {
        float t = float(i) / float(VISIBILITY_STEPS + 1u);
        ivec2 at = ivec2(round(mix(vec2(from), vec2(to), t)));
        if (at == from || at == to) {
            continue;
        }
        float line = view.orthographic != 0u ? mix(z_from, z_to, t) : 1.0 / mix(1.0 / z_from, 1.0 / z_to, t);
        float z = texelFetch(depth, at, 0).r;
        if (z < line * 0.98 && z > line * (0.98 - thickness)) {
            return true;
        }
        if (PEELED > 0) {
            vec2 uv = 0.5 + (screen_uv(view, at, factor) - 0.5) / peeled_scale;
            vec3 behind = vec3(texelFetch(peeled[0], ivec2(uv * vec2(textureSize(peeled[0], 0))), 0).r, 1.0, 1.0);
            if (PEELED > 1) behind.y = texelFetch(peeled[1], ivec2(uv * vec2(textureSize(peeled[1], 0))), 0).r;
            if (PEELED > 2) behind.z = texelFetch(peeled[2], ivec2(uv * vec2(textureSize(peeled[2], 0))), 0).r;
            if (any(lessThan(abs(behind - line * (0.98 - 0.5 * thickness)), vec3(line * 0.5 * thickness)))) {
                return true;
            }
        }
    }
    return false;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 extent = imageSize(gathered);
    if (any(greaterThanEqual(pixel, extent))) {
        return;
    }
    float z = texelFetch(depth, pixel, 0).r;
    float mask = texelFetch(albedo, pixel, 0).a;
    vec3 n = texelFetch(normal, pixel, 0).xyz;
    if (z >= 1.0 || dot(n, n) < 1e-8) {
        imageStore(gathered, pixel, vec4(0.0));
        imageStore(seen, pixel, vec4(0.0));
        return;
    }
    n = normalize(n);
    vec3 p = screen_position(view, pixel, factor, z);
    vec3 axis = screen_axis(view);
    vec2 jitter = JITTER != 0 ? isr_jitter(pixel) : vec2(0.5);
    uint samples = SAMPLES;
    if (BY_DEPTH != 0) {
        vec2 mean = texelFetch(mean_depth, ivec2(0), textureQueryLevels(mean_depth) - 1).rg;
        samples = isr_samples_at(z * max(mean.g, 1e-6) / max(mean.r, 1e-12), SAMPLES);
    }

    vec3 light = vec3(0.0);
    float factors = 0.0;
    if (INDIRECT != 0 && mask > 0.0) {
        for (uint i = 0u; i < samples; ++i) {
            vec3 s = isr_sample(i, samples, RINGS != 0, reach, spread, jitter, JITTER != 0);
            ivec2 at = pixel + ivec2(round(s.xy));
            if (at == pixel || any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, extent))) {
                continue;
            }
            float xz = texelFetch(depth, at, 0).r;
            vec3 xn = texelFetch(normal, at, 0).xyz;
            if (xz >= 1.0 || dot(xn, xn) < 1e-8) {
                continue;
            }
            xn = normalize(xn);
            vec2 uv = screen_uv(view, at, factor);
            vec3 x = world_from_depth(view, uv, xz);
            float cell = isr_footprint(screen_facing_area(view, factor, xz), axis, view_ray(view, uv), xn);
            float f;
            if (AREA_ESTIMATOR != 0) {
                // One pixel's area in the denominator bounds the factor of touching pixels and vanishes elsewhere.
                f = isr_form_factor(p, n, x, xn, cell) * cell * s.z;
            } else {
                f = isr_form_factor(p, n, x, xn, 0.0) * cell * (PAPER_CELLS != 0 ? s.z : 1.0);
            }
            if (f > 0.0 && VISIBILITY_STEPS > 0 && hidden(pixel, at, z, xz)) {
                continue;
            }
            vec4 l = texelFetch(sender, at, 0);
            if (PREFILTER != 0) {
                float level = max(0.5 * log2(s.z) - 2.0, 0.0);
                vec4 mean = textureLod(filtered, (vec2(at) + 0.5) / vec2(extent), level);
                l.rgb = mean.a > 1e-3 ? mean.rgb / mean.a : l.rgb;
            }
            light += f * l.a * l.rgb; // F_PX L_X of [ISR 25]
            factors += f;
        }
        // [ISR 25], or the area estimator: true form factors sum to at most one, estimates scatter about it.
        light *= AREA_ESTIMATOR != 0 ? mask / max(factors / MOST, 1.0) : mask * 2.0 * ISR_PI / float(samples);
    }

    float occlusion = 0.0;
    if (OCCLUSION != 0) {
        for (uint i = 0u; i < samples; ++i) {
            vec3 s = isr_sample(i, samples, RINGS != 0, occlusion_reach, spread, jitter, JITTER != 0);
            ivec2 at = pixel + ivec2(round(s.xy));
            if (at == pixel || any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, extent))) {
                continue;
            }
            float xz = texelFetch(depth, at, 0).r;
            if (xz >= 1.0) {
                continue;
            }
            float radius = occluder_radius * sqrt(s.z * screen_facing_area(view, factor, xz));
            occlusion += isr_occlusion(p, n, screen_position(view, at, factor, xz), radius, occlusion_bias);
        }
        occlusion *= 2.0 * ISR_PI / float(samples); // [ISR 26]
    }
    imageStore(gathered, pixel, vec4(light, occlusion));
    imageStore(seen, pixel, vec4(min(factors, MOST)));
}
