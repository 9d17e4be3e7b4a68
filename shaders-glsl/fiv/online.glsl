// Samples that a frame needs: a bit for each sample. Words form blocks, and blocks form sets.
#ifndef LIB_FIV_ONLINE
#define LIB_FIV_ONLINE

const uint FIV_BLOCK_WORDS = 64u; // export
const uint FIV_BLOCK_SAMPLES = 2048u; // export

// The samples of one occluder, or of several occluders with the same geometry, rotation and scale.
struct FivSet {
    uint base;     // first entry in the lists of its geometry
    uint radii_at; // first entry of its spheres' radii
};

// All sets of one geometry.
struct FivJob {
    uint block; // first
    uint blocks;
    uint batch; // first
    uint batches;
};

// Workgroups per row, because Vulkan guarantees only 65535 in one direction.
const uint FIV_ROW = 32768u; // export

#endif
