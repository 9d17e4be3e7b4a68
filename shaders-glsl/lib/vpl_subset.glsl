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
    return (place.y * tile + place.x + words.x % (tile * tile)) % (tile * tile);
}

#endif
