// One direction of a Gaussian that stops at depth steps and creases. The centre always has weight one, so that a texel with no
// like neighbour keeps its value; background neither gives nor takes.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "passes/bilateral.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D color;
layout(binding = 2) uniform sampler2D normal;  // decoded, any length
layout(binding = 3) uniform sampler2D depth;   // linear z / far
layout(binding = 4, rgba16f) uniform writeonly image2D blurred;

layout(push_constant, scalar) uniform Push {
    ivec2 direction;  // (1, 0) or (0, 1)
    int radius;       // taps to each side
    float sigma;      // pixels
    float range;      // distance from the centre's plane, relative to its depth, at which the weight falls to exp(-1/2)
    float factor;     // 2 on half-resolution buffers, 1 on full
};

vec3 unit(vec3 n) {
    return n * inversesqrt(max(dot(n, n), 1e-12));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 extent = imageSize(blurred);
    if (any(greaterThanEqual(pixel, extent))) {
        return;
    }
    float z = texelFetch(depth, pixel, 0).r;
    vec4 centre = texelFetch(color, pixel, 0);
    if (z >= 1.0) {
        imageStore(blurred, pixel, centre);
        return;
    }
    vec3 n = unit(texelFetch(normal, pixel, 0).xyz);
    vec3 p = screen_position(view, pixel, factor, z);
    vec4 sum = centre;
    float weights = 1.0;
    for (int i = -radius; i <= radius; ++i) {
        ivec2 at = pixel + i * direction;
        if (i == 0 || any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, extent))) {
            continue;
        }
        float at_z = texelFetch(depth, at, 0).r;
        if (at_z >= 1.0) {
            continue;
        }
        vec3 x = screen_position(view, at, factor, at_z);
        float off = bilateral_plane_distance(p, n, x, z * view.far) / range;
        float like = max(dot(n, unit(texelFetch(normal, at, 0).xyz)), 0.0);
        float w = exp(-float(i * i) / (2.0 * sigma * sigma) - 0.5 * off * off) * like * like * like * like;
        sum += w * texelFetch(color, at, 0);
        weights += w;
    }
    imageStore(blurred, pixel, sum / weights);
}
