// Adds the light of what one more view sees to the gathered light of the frame, or of another of these views.
//
// A surface counts once: not at all as far as the frame has gathered from what it shows itself, and in shares if several of the views show it, in proportion to
// the number of texels that each has on it (the balance heuristic).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "isr/isr.glsl"
#include "isr/views.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint SAMPLES = 48;
layout(constant_id = 1) const uint VISIBILITY_STEPS = 0;
layout(constant_id = 2) const uint PREFILTER = 1;
layout(constant_id = 3) const uint JITTER = 1;
// Whether the receiving view has gathered from its own picture.
layout(constant_id = 4) const uint GATHERED = 1;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D albedo;  // of the receiving view; a: radiation mask
layout(binding = 2) uniform sampler2D normal;
layout(binding = 3) uniform sampler2D depth;
layout(binding = 4) uniform sampler2D before;  // gathered so far
layout(binding = 5, scalar) readonly buffer SenderViews { SenderView sender_views[]; };
layout(binding = 6) uniform sampler2DArray their_radiance;  // rgb times mask, a mask; mip levels
layout(binding = 7) uniform sampler2DArray their_normal;
layout(binding = 8) uniform sampler2DArray their_depth;
layout(binding = 9, rgba16f) uniform writeonly image2D gathered;

layout(push_constant, scalar) uniform Push {
    float factor;  // of the coarse buffers
    float thickness;
    uint number;  // of the view
    uint count;   // of views
};

const float MOST = 2.0;

// Share of the surface at x that the frame's own gather does not count.
float unseen(vec3 x, vec3 xn) {
    if (GATHERED == 0) {
        return 1.0;
    }
    ivec2 texel = isr_texel(view, textureSize(depth, 0), x);
    if (texel.x < 0) {
        return 1.0;
    }
    float z = texelFetch(depth, texel, 0).r;
    if (!isr_shows(view, texel, factor, z, texelFetch(normal, texel, 0).xyz, x, xn)) {
        return 1.0;
    }
    vec3 ray = view_ray(view, screen_uv(view, texel, factor));
    // The frame's footprints stop growing at this cosine.
    return 1.0 - min(abs(dot(xn, ray)) / (ISR_GRAZING * dot(screen_axis(view), ray)), 1.0);
}

// Texels per m² that a view has on the surface at x; 0 if it does not show it.
float density(uint i, vec3 x, vec3 xn) {
    View other = sender_views[i].view;
    ivec2 texel = isr_texel(other, textureSize(their_depth, 0).xy, x);
    if (texel.x < 0) {
        return 0.0;
    }
    vec2 uv = screen_uv(other, texel, 1.0);
    if (sender_views[i].hole > 0.0 && all(lessThan(abs(uv * 2.0 - 1.0), vec2(sender_views[i].hole)))) {
        return 0.0;
    }
    float z = texelFetch(their_depth, ivec3(texel, i), 0).r;
    vec3 n = texelFetch(their_normal, ivec3(texel, i), 0).xyz;
    if (!isr_shows(other, texel, 1.0, z, n, x, xn)) {
        return 0.0;
    }
    return 1.0 / isr_footprint(screen_facing_area(other, 1.0, z), screen_axis(other), view_ray(other, uv), xn);
}

// Whether the frame or the view itself shows something between two points.
bool hidden(vec3 from, vec3 to) {
    View other = sender_views[number].view;
    for (uint i = 1u; i <= VISIBILITY_STEPS; ++i) {
        vec3 at = mix(from, to, float(i) / float(VISIBILITY_STEPS + 1u));
        ivec2 texel = isr_texel(view, textureSize(depth, 0), at);
        if (texel.x >= 0 && isr_behind(depth_of(view, at), texelFetch(depth, texel, 0).r, thickness)) {
            return true;
        }
        texel = isr_texel(other, textureSize(their_depth, 0).xy, at);
        if (texel.x >= 0
            && isr_behind(depth_of(other, at), texelFetch(their_depth, ivec3(texel, number), 0).r, thickness)) {
            return true;
        }
    }
    return false;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(gathered)))) {
        return;
    }
    vec4 sum = GATHERED != 0 || number > 0u ? texelFetch(before, pixel, 0) : vec4(0.0);
    float z = texelFetch(depth, pixel, 0).r;
    float mask = texelFetch(albedo, pixel, 0).a;
    vec3 n = texelFetch(normal, pixel, 0).xyz;
    if (z >= 1.0 || mask <= 0.0 || dot(n, n) < 1e-8) {
        imageStore(gathered, pixel, sum);
        return;
    }
    n = normalize(n);
    vec3 p = screen_position(view, pixel, factor, z);
    View other = sender_views[number].view;
    float hole = sender_views[number].hole;
    ivec2 extent = textureSize(their_depth, 0).xy;
    vec3 axis = screen_axis(other);
    // Image area that a sample stands for, texels.
    float area = (1.0 - hole * hole) * float(extent.x * extent.y) / float(SAMPLES);
    float level = PREFILTER != 0 ? max(0.5 * log2(area) - 2.0, 0.0) : 0.0;
    vec2 start = JITTER != 0 ? isr_jitter(pixel) : vec2(0.5);

    vec3 light = vec3(0.0);
    float factors = 0.0;
    for (uint i = 0u; i < SAMPLES; ++i) {
        vec2 ab = vec2(fract(start.x + float(i) * 0.7548776662 + 0.31 * float(number)), (float(i) + start.y) / float(SAMPLES));
        vec2 uv = 0.5 + 0.5 * isr_around(ab, hole);
        ivec2 at = clamp(ivec2(uv * vec2(extent)), ivec2(0), extent - 1);
        float xz = texelFetch(their_depth, ivec3(at, number), 0).r;
        vec3 xn = texelFetch(their_normal, ivec3(at, number), 0).xyz;
        if (xz >= 1.0 || dot(xn, xn) < 1e-8) {
            continue;
        }
        xn = normalize(xn);
        uv = screen_uv(other, at, 1.0);
        vec3 x = world_from_depth(other, uv, xz);
        float cell = isr_footprint(screen_facing_area(other, 1.0, xz), axis, view_ray(other, uv), xn);
        float f = isr_form_factor(p, n, x, xn, cell) * cell * area;
        if (f <= 0.0) {
            continue;
        }
        f *= unseen(x, xn);
        if (f <= 0.0) {
            continue;
        }
        float own = 1.0 / cell;
        float all_of_them = own;
        for (uint j = 0u; j < count; ++j) {
            all_of_them += j == number ? 0.0 : density(j, x, xn);
        }
        f *= own / all_of_them;
        if (VISIBILITY_STEPS > 0 && hidden(p, x)) {
            continue;
        }
        vec4 l = textureLod(their_radiance, vec3((vec2(at) + 0.5) / vec2(extent), float(number)), level);
        float own_mask = texelFetch(their_radiance, ivec3(at, number), 0).a;
        light += f * own_mask * (l.a > 1e-3 ? l.rgb / l.a : vec3(0.0));
        factors += f;
    }
    sum.rgb += light * mask / max(factors / MOST, 1.0);
    imageStore(gathered, pixel, sum);
}
