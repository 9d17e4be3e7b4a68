// One direction of the logarithmic Gaussian prefilter of exponential shadow maps: the logarithm of the weighted mean of
// exp(c depth), divided by c, so that nothing overflows whatever c is. The first direction also turns hardware depth into
// linear depth.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#define LIGHTS_BINDING 20
#define SHADOW_MAPS_BINDING 22
#include "lib/shadow.glsl"

layout(local_size_x = 8, local_size_y = 8) in; // z: slots
layout(constant_id = 0) const uint FROM_HARDWARE = 0;
layout(binding = 1, r32f) uniform writeonly image2DArray filtered;
layout(push_constant, scalar) uniform Push {
    ivec2 step;
    int radius;      // texels to each side; 0: copy
    float deviation; // texels
    uint slots;
};

float depth_at(ivec2 at) {
    uint slot = gl_GlobalInvocationID.z;
    float stored = shadow_texel(at, slot);
    if (FROM_HARDWARE == 0u) return stored;
    vec2 ndc = (vec2(at) + 0.5) / shadow_settings.size * vec2(2.0, -2.0) + vec2(-1.0, 1.0);
    return shadow_linear_depth(shadow_slots[slot], ndc, shadow_axis_depth(shadow_slots[slot], stored));
}

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    int size = int(shadow_settings.size);
    if (any(greaterThanEqual(at, ivec2(size))) || gl_GlobalInvocationID.z >= slots) return;
    float c = shadow_slots[gl_GlobalInvocationID.z].exponent;
    // Sum of weights * exp(c (depth - most)), with the largest depth so far taken out of it.
    float most = depth_at(at);
    float sum = 1.0;
    float total = 1.0;
    for (int i = -radius; i <= radius; ++i) {
        if (i == 0) continue;
        float x = float(i) / deviation;
        float w = exp(-0.5 * x * x);
        float depth = depth_at(clamp(at + i * step, ivec2(0), ivec2(size - 1)));
        float larger = max(depth, most);
        sum = sum * exp(c * (most - larger)) + w * exp(c * (depth - larger));
        most = larger;
        total += w;
    }
    imageStore(filtered, ivec3(at, int(gl_GlobalInvocationID.z)), vec4(most + log(sum / total) / c));
}
