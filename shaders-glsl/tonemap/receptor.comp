// The response of every pixel, its range over the picture stretched onto that of the display.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/tonemap.glsl"
#include "tonemap/receptor.glsl"

// An invocation has a column of TONEMAP_CURVE_ROWS pixels.
layout(local_size_x = 64) in;

layout(binding = 0) uniform sampler2D color;
layout(binding = 1, scalar) readonly buffer Statistics { TonemapStatistics statistics; };
layout(binding = 2, scalar) readonly buffer Sums {
    uint least;
    uint largest;
    uint log_low;
    uint log_high;
    uint lit;
} sums;
layout(binding = 3, scalar) readonly buffer Receptor { TonemapReceptor receptor; };
layout(binding = 4, rgba32f) uniform writeonly image2D mapped;

layout(push_constant, scalar) uniform Push {
    TonemapReceptorSettings settings;
};
#include "tonemap/receptor_response.glsl"

void main() {
    ivec2 extent = imageSize(mapped);
    ivec2 pixel = ivec2(gl_GlobalInvocationID.x, gl_GlobalInvocationID.y * TONEMAP_CURVE_ROWS);
    if (any(greaterThanEqual(pixel, extent))) return;
    Adapted adapted = receptor_adapted();
    float low = uintBitsToFloat(receptor.least);
    float range = uintBitsToFloat(receptor.largest) - low;
    int end = min(pixel.y + int(TONEMAP_CURVE_ROWS), extent.y);
    for (; pixel.y < end; ++pixel.y) {
        vec4 texel = texelFetch(color, pixel, 0);
        vec3 response = receptor_response(settings.exposure * tonemap_clean(texel.rgb), adapted);
        // A single response is white, as the single luminance of a picture is to other operators.
        vec3 shown = range > 0.0 ? (response - low) / range : vec3(greaterThan(response, vec3(0.0)));
        imageStore(mapped, pixel, vec4(shown, texel.a));
    }
}
