// Counts its own starts by an atomic, with the depth test forced to come first.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(early_fragment_tests) in;
layout(location = 0) out float color;
layout(binding = 0, scalar) buffer Starts { uint starts; };

void main() {
    atomicAdd(starts, 1u);  // of no effect in the helper invocations that fill up quads
    color = 1.0;
}
