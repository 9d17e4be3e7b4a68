// values[i] = first + i * step
#version 460
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 64) in;
layout(binding = 0, scalar) writeonly buffer Values { uint values[]; };
layout(push_constant, scalar) uniform Push { uint count; uint first; uint step_size; };
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < count) values[i] = first + i * step_size;
}
