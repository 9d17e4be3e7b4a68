// Radiosity of the samples from the coefficients of the vectors of light.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "prt/receiver.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Receivers { PrtReceiver receivers[]; };
layout(binding = 1, scalar) readonly buffer Functions { float functions[]; };
layout(binding = 2, scalar) readonly buffer Coefficients { vec3 coefficients[]; };
layout(binding = 3, scalar) readonly buffer Known { vec3 known[]; };              // coefficients of `radiosities`
layout(binding = 4, scalar) readonly buffer Radiosities { vec3 radiosities[]; };
layout(binding = 5, scalar) writeonly buffer Restored { vec3 restored[]; };

layout(push_constant, scalar) uniform Push {
    uint count;
    uint exactly;  // 1: `radiosities` is exact, and the coefficients beyond those of `known` are added
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    PrtReceiver of = receivers[i];
    vec3 sum = exactly != 0u ? radiosities[i] : vec3(0.0);
    for (uint v = 0u; v < of.vectors; ++v) {
        vec3 along = coefficients[of.first_vector + v];
        if (exactly != 0u) along -= known[of.first_vector + v];
        sum += functions[of.first_function + v] * along;
    }
    restored[i] = sum;
}
