// Samples that are needed in a frame: a bit each, words of blocks, blocks of sets.
#ifndef LIB_FIV_ONLINE
#define LIB_FIV_ONLINE

const uint FIV_BLOCK_WORDS = 64u; // export
const uint FIV_BLOCK_SAMPLES = 2048u; // export

// The samples of one occluder, or of several that stand alike.
struct FivSet {
    uint base;     // first place in the lists of its geometry
    uint radii_at; // of its spheres' radii
};

// All sets that share a geometry.
struct FivJob {
    uint block; // first
    uint blocks;
    uint batch; // first
    uint batches;
};

// Workgroups in rows: Vulkan promises 65535 in one direction.
const uint FIV_ROW = 32768u; // export

#endif
