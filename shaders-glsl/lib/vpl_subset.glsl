// Interleaved sampling: which share of the virtual lights a texel gathers from. Before including: lib/random.glsl.
#ifndef LIB_VPL_SUBSET
#define LIB_VPL_SUBSET

// Below tile²; each once in a tile of texels.
uint vpl_subset(uvec2 texel, uint tile, bool irregular, uint seed) {
    uvec2 place = texel % tile;
    if (!irregular) return place.y * tile + place.x;
    // Turned by a number of its own.
    uvec4 words = pcg4d(uvec4(texel / tile, seed, 0x1a7e1u));
    if ((words.y & 1u) != 0u) place = place.yx;
    if ((words.z & 1u) != 0u) place.x = tile - 1u - place.x;
    // Any 3 × 3 (2 × 2) texels of a large tile have subsets far from each other and evenly between each other.
    uint side = tile % 3u == 0u ? 3u : tile % 2u == 0u ? 2u : tile;
    uint blocks = tile / side;
    uvec2 block = place / side, inner = place % side;
    uint order = block.x + blocks * (block.y + blocks * (inner.x + side * inner.y));
    return (order + words.x % (tile * tile)) % (tile * tile);
}

// Number of the i-th virtual light of a subset; divided by `subsets` and rounded down it is i. `stride`: of irregular patterns, about
// 0.62 subsets without a factor that divides both; 0: regular.
uint vpl_of_subset(uint i, uint subset, uint subsets, uint stride) {
    // Every subsets-th point of Halton's sequence has the same digits in each base that divides `subsets`: a ninth of the lights would lie
    // in a ninth of all directions. A step on from each round to the next, of about the golden ratio, gives every subset all digits.
    return i * subsets + (subset + i * stride) % subsets;
}

#endif
