// Low-discrepancy points: the first two dimensions of Sobol's sequence, which are a (0, 2)-sequence in base 2, with Owen's scrambling of the
// order and of the coordinates by hashes (Burley, Practical Hash-based Owen Scrambling, 2020). Each pair of dimensions of an integral has its
// own order and its own scrambling of the same two dimensions, so that any number of pairs is possible.
// Before including: lib/random.glsl.
#ifndef LIB_POINTS
#define LIB_POINTS

// PointPlace of points whose errors are not spread over the screen.
const uint POINTS_APART = 32u; // export
// Independent random numbers instead of low-discrepancy points.
const uint POINTS_RANDOM = 33u; // export
// Half the bits of the position of a pixel within a tile.
const uint POINTS_TILE_BITS = 6u;

// A point of one of many randomised sequences.
struct PointPlace {
    uvec2 sequence; // equal numbers: the same sequence
    uint reversed;  // number of the point, the bits in reverse order
    uint random;    // 1: independent random numbers
};

// Owen's scrambling of a number whose least significant bit is its most significant digit: each digit is flipped by a hash of the digits before
// it (Laine and Karras, Stratified Sampling for Stochastic Transparency, 2011; constants by Vegdahl, Building a Better LK Hash, 2021).
uint owen_scrambled(uint x, uint seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// The second dimension of Sobol's sequence. The least significant bit of the result is its most significant digit. The matrix is Pascal's
// triangle modulo 2, a product of five matrices that are fast to apply.
uint sobol_second(uint index) {
    index ^= (index & 0xaaaaaaaau) >> 1u;
    index ^= (index & 0xccccccccu) >> 2u;
    index ^= (index & 0xf0f0f0f0u) >> 4u;
    index ^= (index & 0xff00ff00u) >> 8u;
    index ^= index >> 16u;
    return index;
}

// The number of a pixel along a curve that fills its tile. The order of the four quarters of each square is random.
uint shuffled_morton(uvec2 pixel, uint seed) {
    uvec2 tile = pixel >> POINTS_TILE_BITS;
    uint code = 0u;
    for (uint level = POINTS_TILE_BITS; level-- > 0u;) {
        uvec2 bits = pixel >> level & 1u;
        // All 24 orders of four quarters are the affine maps of two bits: a linear map that has an inverse, and a translation.
        uint hash = pcg4d(uvec4(code | level << 16u, tile, seed)).x;
        uint map = (hash >> 8u) % 6u;
        uvec2 mapped = map < 2u ? bits : map < 4u ? uvec2(bits.x ^ bits.y, bits.y) : uvec2(bits.x, bits.x ^ bits.y);
        if ((map & 1u) != 0u) mapped = mapped.yx;
        mapped ^= uvec2(hash, hash >> 1u) & 1u;
        code = code << 2u | mapped.y << 1u | mapped.x;
    }
    return code;
}

// Sample of a pixel. `plan`: POINTS_RANDOM; or POINTS_APART, where each pixel has its own sequence, any part of which is well distributed; or the
// binary logarithm of the number of samples that are planned for each pixel. Then neighbouring pixels have neighbouring parts of one sequence,
// so that their errors have opposite signs (Ahmed and Wonka, Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical
// Ordering of Pixels, 2020). More samples than planned begin an independent sequence.
PointPlace point_place(uvec2 pixel, uint number, uint plan, uint seed) {
    PointPlace place;
    place.sequence = uvec2(pixel.x | pixel.y << 16u, 0u);
    place.reversed = bitfieldReverse(number);
    place.random = 0u;
    if (plan == POINTS_RANDOM) {
        place.sequence.y = number;
        place.random = 1u;
    } else if (plan < POINTS_APART) {
        uint part = shuffled_morton(pixel, seed);
        uvec2 tile = pixel >> POINTS_TILE_BITS;
        place.sequence = uvec2(tile.x | tile.y << 16u, number >> plan);
        place.reversed = bitfieldReverse(part << plan | number & ((1u << plan) - 1u));
    }
    return place;
}

// Two numbers of 32 bits. `dimension`: number of the pair of dimensions.
uvec2 point_words(PointPlace place, uint dimension, uint seed) {
    uvec4 hash = pcg4d(uvec4(place.sequence, dimension, seed));
    if (place.random != 0u) return hash.xy;
    uint index = bitfieldReverse(owen_scrambled(place.reversed, hash.x));
    uint second = sobol_second(index);
    return bitfieldReverse(uvec2(owen_scrambled(index, hash.y), owen_scrambled(second, hash.z)));
}

#endif
