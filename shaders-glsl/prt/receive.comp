// Indirect irradiance of the samples (equation 10), with the light of linked samples.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "prt/receiver.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Receivers { PrtReceiver receivers[]; };
layout(binding = 1, scalar) readonly buffer Words { uint words[]; };   // halves
layout(binding = 2, scalar) readonly buffer Mixed { vec3 mixed[]; };
layout(binding = 3, scalar) readonly buffer Senders { uint senders[]; };     // of links
layout(binding = 4, scalar) readonly buffer Shares { float shares[]; };      // of the hemisphere
layout(binding = 5, scalar) readonly buffer Radiosities { vec3 radiosities[]; };
layout(binding = 6, scalar) writeonly buffer Irradiances { vec3 irradiances[]; };

layout(push_constant, scalar) uniform Push { uint count; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    PrtReceiver of = receivers[i];
    vec3 sum = vec3(0.0);
    for (uint k = 0u; k < of.count; k += 2u) {
        vec2 pair = unpackHalf2x16(words[of.first_word + k / 2u]);
        sum += pair.x * mixed[of.first_mixed + k];
        if (k + 1u < of.count) sum += pair.y * mixed[of.first_mixed + k + 1u];
    }
    for (uint k = of.first_link; k < of.first_link + of.links; ++k) {
        sum += shares[k] * radiosities[senders[k]];
    }
    irradiances[i] = sum;
}
