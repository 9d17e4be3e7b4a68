// How often does a loop run when asked for more than 65 535 turns? Some CPU drivers stop there without a word.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 1) in;
layout(binding = 0, scalar) buffer Turns { uint turns[]; }; // [0]: asked for; [1]: done

void main() {
    uint asked = turns[0];
    uint done = 0u;
    uint value = 1u;
    for (uint i = 0u; i < asked; ++i) {
        // Not to be foreseen by an optimiser.
        value = value * 747796405u + (done ^ i);
        done += (value != 0u || i == 0u) ? 1u : 1u + (value >> 31u);
    }
    turns[1] = done;
}
