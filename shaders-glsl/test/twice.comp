// values_out[i] = 2 * values[i] + bias, with the bias from a uniform block
#version 460
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 64) in;
struct Bias { uint count; uint bias; };
layout(binding = 0, scalar) readonly buffer Values { uint values[]; };
layout(binding = 1, scalar) writeonly buffer ValuesOut { uint values_out[]; };
layout(binding = 2, scalar) uniform BiasBlock { Bias bias; };
layout(constant_id = 0) const uint FACTOR = 2;
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < bias.count) values_out[i] = FACTOR * values[i] + bias.bias;
}
