// Counts its own starts by an atomic; when the depth test comes is left to the driver, who may only do it first where nobody can tell: here a store tells.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(location = 0) out float color;
layout(binding = 0, scalar) buffer Starts { uint starts; };

void main() {
    atomicAdd(starts, 1u);  // of no effect in the helper invocations that fill up quads
    color = 1.0;
}
