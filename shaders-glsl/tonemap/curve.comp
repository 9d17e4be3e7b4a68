// From luminance and its local adaptation to display luminance, and from there to colour; curves of colour directly.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/tonemap.glsl"
#include "tonemap/ashikhmin.glsl"
#include "tonemap/curves.glsl"

// An invocation has a column of TONEMAP_CURVE_ROWS pixels.
layout(local_size_x = 64) in;

layout(constant_id = 0) const uint OPERATOR = 0;
layout(constant_id = 1) const uint GLOBAL = 0;

layout(binding = 0) uniform sampler2D color;
layout(binding = 2) uniform sampler2D adaptation;  // local adaptation; of the bilateral operator, the base; not read where GLOBAL
layout(binding = 3, scalar) readonly buffer Statistics { TonemapStatistics statistics; };
layout(binding = 4, rgba32f) uniform writeonly image2D mapped;

layout(push_constant, scalar) uniform Push {
    float exposure;       // factor
    float display;        // cd/m²
    float key;
    float white;          // 0: the largest luminance
    float log_contrast;   // log10 of the contrast of the base
    float detail;
    float saturation;
    float bias;           // Drago
    float limit;          // largest ratio of luminance and local adaptation, either way; 0: none
};

float extended_reinhard(float l, float largest) {
    // In this order no intermediate overflows.
    return (1.0 + l / largest / largest) * l / (1.0 + l);
}

// ln(1 + x) that keeps its digits where x is small.
float drago_log(float x) {
    return x < 0.01 ? x * (1.0 - x * (0.5 - x * (1.0 / 3.0 - x * 0.25))) : log(1.0 + x);
}

// `range`: Ashikhmin, of the whole picture.
float display_luminance(float l, float a, float range) {
    TonemapStatistics s = statistics;
    if (OPERATOR == TONEMAP_SOLVED) {
        return a;
    }
    if (OPERATOR == TONEMAP_ASHIKHMIN) {
        return ashikhmin_display(l * s.scale, a * s.scale, s.low * s.scale, s.high * s.scale, range, display) / display;
    }
    if (OPERATOR == TONEMAP_REINHARD) {
        float factor = key / s.log_average;
        if (GLOBAL != 0u) {
            float largest = white > 0.0 ? white : s.high * factor;
            return extended_reinhard(l * factor, max(largest, TONEMAP_SMALLEST));
        }
        return l * factor / (1.0 + a * factor);
    }
    if (OPERATOR == TONEMAP_BILATERAL) {
        const float decade = 0.30102999566;  // log10(2)
        float top = decade * log2(max(s.high, TONEMAP_SMALLEST));
        float bottom = max(decade * log2(max(s.low, TONEMAP_SMALLEST)), top - 4.0);
        float decades = top - bottom;
        float gamma = decades > 0.0 ? min(log_contrast / decades, 1.0) : 1.0;
        float whole = decade * log2(max(l, max(1e-6 * s.high, TONEMAP_SMALLEST)));
        float base = GLOBAL != 0u ? whole : decade * log2(max(a, max(1e-6 * s.high, TONEMAP_SMALLEST)));
        if (limit > 0.0) {
            float most = decade * log2(limit);
            base = clamp(base, whole - most, whole + most);
        }
        return exp2((gamma * (base - top) + detail * (whole - base)) / decade);
    }
    if (OPERATOR == TONEMAP_DRAGO) {
        // Equation 4 of Drago 2003, in units of the adaptation luminance.
        float adapted = s.log_average / pow(1.0 + bias - 0.85, 5.0);
        float most = max(s.high, TONEMAP_SMALLEST) / adapted;
        float share = pow(min(l / max(s.high, TONEMAP_SMALLEST), 1.0), log2(bias) / log2(0.5));
        return drago_log(l / adapted) / log(2.0 + 8.0 * share) / (drago_log(most) / log(10.0));
    }
    float largest = white > 0.0 ? white : s.high * s.scale;
    return extended_reinhard(l * s.scale, max(largest, TONEMAP_SMALLEST));
}

void shade(ivec2 pixel, float range) {
    vec4 texel = texelFetch(color, pixel, 0);
    precise vec3 rgb = exposure * tonemap_clean(texel.rgb);
    vec3 result;
    if (OPERATOR == TONEMAP_LINEAR || OPERATOR >= TONEMAP_ACES && OPERATOR <= TONEMAP_NEUTRAL) {
        rgb *= statistics.scale;
        result = OPERATOR == TONEMAP_LINEAR ? rgb
               : OPERATOR == TONEMAP_ACES   ? tonemap_aces(rgb)
               : OPERATOR == TONEMAP_AGX    ? tonemap_agx(rgb)
                                            : tonemap_neutral(rgb);
    } else {
        float l = tonemap_luminance(rgb);
        float a = GLOBAL != 0u ? l : texelFetch(adaptation, pixel, 0).r;
        if (limit > 0.0 && OPERATOR != TONEMAP_BILATERAL) {
            a = clamp(a, l / limit, l * limit);
        }
        float shown = l > 0.0 ? max(display_luminance(l, a, range), 0.0) : 0.0;
        // Ratios below 1e-30 in l were set to 0 above, so this is finite.
        vec3 ratio = l > 0.0 ? rgb / l : vec3(0.0);
        result = shown * (saturation == 1.0 ? ratio : pow(ratio, vec3(saturation)));
    }
    imageStore(mapped, pixel, vec4(result, texel.a));
}

void main() {
    ivec2 extent = imageSize(mapped);
    ivec2 pixel = ivec2(gl_GlobalInvocationID.x, gl_GlobalInvocationID.y * TONEMAP_CURVE_ROWS);
    if (any(greaterThanEqual(pixel, extent))) {
        return;
    }
    float range = 0.0;
    if (OPERATOR == TONEMAP_ASHIKHMIN) {
        range = ashikhmin_range(statistics.low * statistics.scale, statistics.high * statistics.scale);
    }
    int end = min(pixel.y + int(TONEMAP_CURVE_ROWS), extent.y);
    for (; pixel.y < end; ++pixel.y) {
        shade(pixel, range);
    }
}
