// Finds in which bin each of the two ranks lies, appends it to what is known of the value, and clears the bins.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 1) in;

layout(binding = 0, scalar) buffer Found {
    uint prefix[2];
    uint rank[2];  // how many of the remaining values are smaller
} found;
layout(binding = 1, scalar) buffer Bins { uint bins[]; };

layout(push_constant, scalar) uniform Push {
    uint ranks[2];  // counted from 0; used by the first digit
    uint shift;     // 20, 10, 0
};

void main() {
    bool start = shift == 20u;
    for (uint i = 0u; i < 2u; ++i) {
        uint base = start ? 0u : i * 1024u;
        uint size = start ? 2048u : 1024u;
        uint rank = start ? ranks[i] : found.rank[i];
        uint bin = 0u;
        while (bin < size - 1u && rank >= bins[base + bin]) {
            rank -= bins[base + bin];
            ++bin;
        }
        found.prefix[i] = start ? bin : found.prefix[i] << 10 | bin;
        found.rank[i] = rank;
    }
    for (uint i = 0u; i < 2048u; ++i) {
        bins[i] = 0u;
    }
}
