// Copies the vectors of listed points to the places of their samples.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "fiv/fiv.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Found { float found[]; };
layout(binding = 1, scalar) readonly buffer Samples { uint samples[]; };
layout(binding = 2, scalar) readonly buffer Groups { uint groups[]; };
layout(binding = 3, scalar) buffer Fivs { float fivs[]; };

layout(push_constant, scalar) uniform Push {
    uint first; // first point
    uint batch;
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= groups[6u * batch]) return;
    uint to = FIV_FLOATS * samples[first + i], from = FIV_FLOATS * (first + i);
    for (uint k = 0u; k < FIV_FLOATS; ++k) fivs[to + k] = found[from + k];
}
