// Morphs one stream of numbers (texture coordinates or colours) of one primitive of one node into a range of its own.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

layout(binding = 0, scalar) buffer Stream { float stream[]; };
layout(binding = 1, scalar) readonly buffer StreamDeltas { float stream_deltas[]; };
layout(binding = 2, scalar) readonly buffer Weights { float weights[]; };
layout(push_constant, scalar) uniform Push {
    uint source;      // first number at rest
    uint target;      // first number to write
    uint count;       // numbers
    uint targets;
    uint delta_first; // into stream_deltas; target t of number i at delta_first + t * count + i
    uint weight_first;
    uint limited;     // 1: colours, which stay in 0..1
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    float value = stream[source + i];
    for (uint t = 0u; t < targets; ++t) {
        value += weights[weight_first + t] * stream_deltas[delta_first + t * count + i];
    }
    stream[target + i] = limited != 0u ? clamp(value, 0.0, 1.0) : value;
}
