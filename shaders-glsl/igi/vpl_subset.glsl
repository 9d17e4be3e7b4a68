// Interleaved sampling: the subset of the virtual lights from which a texel gathers. Before including: lib/random.glsl.
#ifndef LIB_VPL_SUBSET
#define LIB_VPL_SUBSET

// The subset of a texel, below tile². Each subset occurs once in a tile.
uint vpl_subset(uvec2 texel, uint tile, bool irregular, uint seed) {
    uvec2 place = texel % tile;
    if (!irregular) return place.y * tile + place.x;
    // Each tile has a random reflection and offset.
    uvec4 words = pcg4d(uvec4(texel / tile, seed, 0x1a7e1u));
    if ((words.y & 1u) != 0u) place = place.yx;
    if ((words.z & 1u) != 0u) place.x = tile - 1u - place.x;
    // The subsets of any 3 × 3 (or 2 × 2) texels in a large tile are spread evenly over all subsets.
    uint side = tile % 3u == 0u ? 3u : tile % 2u == 0u ? 2u : tile;
    uint blocks = tile / side;
    uvec2 block = place / side, inner = place % side;
    uint order = block.x + blocks * (block.y + blocks * (inner.x + side * inner.y));
    return (order + words.x % (tile * tile)) % (tile * tile);
}

// Index of the i-th virtual light of a subset: one of the `subsets` lights from i × `subsets` on. `stride`: step of the irregular pattern,
// about 0.62 `subsets` and coprime to it; 0: regular pattern.
uint vpl_of_subset(uint i, uint subset, uint subsets, uint stride) {
    // Every n-th point of the Halton sequence has the same first digits in each base that divides n. With nine subsets the lights of a subset
    // would therefore lie in a ninth of all directions. The step, about the golden ratio of n, gives every subset all digits.
    return i * subsets + (subset + i * stride) % subsets;
}

#endif
