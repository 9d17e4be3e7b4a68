// Light of the sky: the paths that left the scene, sorted by the patches of the sky.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/sampling.glsl"
#include "daylight/daylight.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform SettingsBlock { DaySettings settings; };
layout(binding = 10, scalar) readonly buffer Escapes { DayEscape escapes[]; };
// Sums of irradiance for a radiance of 1 W/(sr m²) of each patch: patch after patch for each receiver. Even and odd samples apart.
layout(binding = 12, scalar) buffer Sums { vec3 sums[]; };

layout(push_constant, scalar) uniform Push {
    uint first;    // sample of this batch
    uint count;
};

void main() {
    uint receiver = gl_GlobalInvocationID.x;
    if (receiver >= settings.receivers) return;
    for (uint i = first; i < first + count; ++i) {
        DayEscape escape = escapes[receiver * settings.samples + i];
        if (escape.weight == vec3(0.0)) continue;
        uint odd = (settings.first_sample + i) & 1u;
        sums[2u * (receiver * SKY_PATCHES + sky_patch(escape.direction)) + odd] += escape.weight;
    }
}
