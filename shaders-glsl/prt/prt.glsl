// Precomputed radiance transfer: samples on surfaces, and the grid in which they are found.
#ifndef LIB_PRT
#define LIB_PRT

// Hits of a particle that are not kept, and those after them that are.
const uint PRT_FIRST_HIT = 5u; // export
const uint PRT_HITS = 8u; // export
// A ray met a surface without samples.
const uint PRT_LOST = 0xfffffffeu; // export
// Samples on a plane whose least distance is 1, of one square metre, when no further sample fits in (random sequential adsorption: discs of half that
// radius cover 0.547 of the plane).
const float PRT_DENSITY = 0.697; // export
// Weight of the square of a way off a tangent plane beside that of a way along this plane: samples on a step, on another sheet or behind it count as far
// away.
const float PRT_STEP = 64.0; // export
// Factor on the square of the distance to a sample of another connected component: books on a shelf have colours of their own.
const float PRT_STRANGE = 16.0; // export
// Free distance above a surface that counts as wide, in distances of samples.
const float PRT_CLEAR = 2.0; // export
// Lights whose visibility is gathered at once.
const uint PRT_LIGHTS = 8u; // export
// Scatterings of the paths that a bake is compared with.
const uint PRT_CHECK_BOUNCES = 256u;
// Parts of the paths of a sample. Each one has a mean of its own.
const uint PRT_CHECK_PARTS = 4u; // export
// Lights whose visibility splats and vertices carry to the pixels at once: the channels of an image.
const uint PRT_SPREAD_LIGHTS = 4u; // export
// Sums of weights below this one are too small to divide by.
const float PRT_LEAST_WEIGHT = 1e-3; // export
// Standard deviations at which a splat ends.
const float PRT_SPLAT_END = 3.0; // export
// Kinds of pictures.
const uint PRT_SHOW_LIGHT = 0u; // export
const uint PRT_SHOW_SAMPLES = 1u; // export
const uint PRT_SHOW_CLUSTERS = 2u; // export
const uint PRT_SHOW_TRANSFER = 3u; // export
// Directional coefficients of a sample beside its irradiance.
const uint PRT_LOBES = 5u; // export

// A place where a particle hit a surface, or a sample.
struct PrtPoint {
    vec3 position;      // metres
    uint instance;      // NONE: the particle left the scene before
    vec3 side;          // normal of the triangle on the lit side, unit
    uint triangle;
    vec3 normal;        // shading normal on the same side, unit
    uint material;
    vec2 barycentrics;
    float gap;          // distance by which rays start off the surface, metres
    float area;         // of the surface that the sample stands for, m²; of a hit: free distance above the surface, metres
    float open;         // share of the hemisphere, weighted by the cosine, that is free within a distance of samples; 0.1 at least
};

// A sample as the passes of a picture read it.
struct PrtSample {
    vec3 position;      // metres
    float weight;       // in the mean over the samples around a pixel; about 1 on open surfaces
    vec3 normal;        // shading normal on the lit side, unit
    vec3 side;          // normal of the triangle on the lit side, unit
};

// What decides which sample stands for a point.
struct PrtCandidate {
    vec3 position;      // metres
    uint side;          // normal of the triangle on the lit side: octahedral, two signed words of 16 bits
    uint surface;       // last 16 bits of the number of the connected component; above: free distance above the sample, 1: PRT_CLEAR distances of samples or more, a half
};

// Cells of equal size that cover all samples. `starts` has the first sample of each cell, `order` the samples cell after cell.
struct PrtGrid {
    vec3 origin;
    float cell;         // side, metres
    uvec3 counts;
    float radius;       // least distance of two samples on a plane, metres
};

// Directions of a cluster: equal cells of a spherical cap, by the concentric map of a square to a disc.
struct PrtCap {
    vec3 axis;          // unit
    float cos_most;     // cosine of the largest angle to the axis
    uint side;          // cells along a side of the square
    uint first_sample;
    uint samples;
    uint first_row;     // of the rows of its directions, in words
    uint first_sample_row; // of the rows of its samples, in words
    uint words;         // of a row: 1 and the coefficients of a sample, or the mean and the vectors of a direction; halves
};

// A disc on a surface that carries the light of a sample, or of several samples of a plane.
struct PrtSplat {
    vec3 position;      // metres
    float spacing;      // distance of such splats on a plane, metres
    vec3 normal;        // unit
    uint first;         // of its samples in the list of members
    uint count;
};

// Where the light at the vertices of an instance lies.
struct PrtMesh {
    uint first;         // of its values
    uint sides;         // 1, or 2 for double-sided surfaces: front and back of each vertex
};

uint prt_cell(PrtGrid grid, ivec3 at) {
    return (uint(at.z) * grid.counts.y + uint(at.y)) * grid.counts.x + uint(at.x);
}

#endif
