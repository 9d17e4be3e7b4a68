// The path tracer's settings, the state of a path between dispatches, and its random numbers.
// Before including: lib/environment_sampling.glsl, lib/random.glsl, lib/sampling.glsl.
#ifndef LIB_PATH
#define LIB_PATH

const uint PATH_DIFFUSE_ONLY = 1u; // export
const uint PATH_JITTER = 2u; // export
const uint PATH_SEES_EMISSION = 4u; // export
const uint PATH_SEES_ENVIRONMENT = 8u; // export
const uint PATH_NO_LIGHT_SAMPLES = 16u; // export
const uint PATH_NO_BSDF_SAMPLES = 32u; // export

// Ways from a surface: to a light of the tree, to a sun, into the sky, and on to the next surface.
const uint TO_LIGHT = 0u; // export
const uint TO_SUN = 1u; // export
const uint TO_SKY = 2u; // export
const uint ON = 3u; // export

// Layers of the sums; see lib/path_sums.glsl.
const uint PATH_SUMS = 6u; // export
// Of these, from the first on, the rounding errors are kept too.
const uint PATH_EXACT_SUMS = 3u; // export

struct PathSettings {
    EnvironmentMap environment;
    uvec2 extent;              // pixels
    uint blocks;               // of 8 pixels in a row
    uint suns;                 // number of columns to pick from
    uint tree;                 // 1: there are lights in the tree
    uint bounces;              // scatterings after the first surface
    uint specular_bounces;     // mirrors and glass along a path
    uint roulette;             // scatterings before paths may be ended at random
    uint flags;                // PATH_
    uint seed;
    // Numbers that compilers must not know, lest they unroll loops and take minutes on CPU drivers.
    uint slots;                // TEXTURE_SLOTS + 2
    uint two;                  // 2
    uint turns;                // rays from one surface to the next
    uint turn_ways[4];         // which way each of them goes; the first: ON
};

// A light that counts if nothing is in the way.
struct WaitingLight {
    vec3 direction;    // of the ray
    float limit;       // in lengths of direction
    vec3 radiance;     // what it adds
};

struct PathState {
    vec3 origin;
    float limit;       // of the ray, in lengths of direction
    vec3 direction;
    float density;     // per steradian, of the last scattering; 0: light from there could not be sampled otherwise
    vec3 throughput;
    uint alive;
    uint vertex;       // surfaces visited
    uint scattered;    // by Lambert or GGX
    uint specular;     // by mirrors and glass
    vec3 emission;     // no scattering
    vec3 direct;       // one
    vec3 indirect;     // more
    vec3 side;         // unit normal of the surface of the last scattering, where the path left it
    uint waiting;      // bit i: the light in way i waits for its ray
    uint salt;         // for surfaces in the way that are blended
    vec3 light_origin;
    uint light_scatterings;
    WaitingLight lamp; // not an array: compilers keep those in memory
    WaitingLight sun;
    WaitingLight sky;
};

// Four independent random words: a pure function of seed, pixel, sample and dimension.
uvec4 random_words(uvec2 pixel, uint sample_number, uint dimension, uint seed) {
    return pcg4d(uvec4(pixel.x | pixel.y << 16u, sample_number, dimension, seed));
}

#endif
