// The path tracer's settings, the state of a path between passes, the lists of paths for each pass, and random numbers.
// Before including: lib/random.glsl.
#ifndef LIB_PATH
#define LIB_PATH
#include "lib/environment_map.glsl"
#include "lib/points.glsl"

const uint PATH_DIFFUSE_ONLY = 1u; // export
const uint PATH_JITTER = 2u; // export
const uint PATH_SEES_EMISSION = 4u; // export
const uint PATH_SEES_ENVIRONMENT = 8u; // export
const uint PATH_NO_LIGHT_SAMPLES = 16u; // export
const uint PATH_NO_BSDF_SAMPLES = 32u; // export

const uint TEXTURE_OF_LAMP = 8u; // export

// Kinds of rays from a surface: to a light of the light tree, to a directional light, to the environment, and on to the next surface.
const uint TO_LIGHT = 0u; // export
const uint TO_SUN = 1u; // export
const uint TO_SKY = 2u; // export
const uint ON = 3u; // export

#include "reference/path_layers.glsl"

struct PathSettings {
    EnvironmentMap environment;
    uvec2 extent;              // pixels
    uint first_row;            // of the sums, which may be those of a band of the picture
    uint blocks;               // of 8 pixels in a row
    uint suns;                 // number of directional lights
    uint tree;                 // 1: the light tree has lights
    uint bounces;              // maximum of scatterings after the first surface
    uint specular_bounces;     // maximum of mirrors and glass surfaces along a path
    uint roulette;             // scatterings before Russian roulette begins
    uint flags;                // PATH_
    uint seed;
    uint textures;             // number of kinds of textures that the scene's materials have
    uint texture_slots[8];     // these kinds: TEXTURE_ of the surface, or TEXTURE_OF_LAMP plus that of a light's surface
    uint turns;                // rays per surface
    uint turn_ways[4];         // kind of each of these rays; the first is ON
    uint slots;                // of one sample
    uint first_slot;           // slot of the first pixel that has sums
    uint capacity;             // maximum of paths
    uint sum_pixels;           // pixels that have sums
    uvec2 sums_at;             // addresses (lib/scene_at.glsl)
    uvec2 paths_at;
    uvec2 hits_at;
    uvec2 lists_at;
    uvec2 light_nodes_at;
    uvec2 light_targets_at;
    uvec2 environment_at;
    uint plan;                 // of the random numbers (lib/points.glsl)
};

// A light sample whose shadow ray is not traced yet. The ray starts at PathState.light_origin.
struct WaitingLight {
    vec3 direction;    // of the ray
    vec3 radiance;     // added to the path if the ray is not occluded
};

// The state of a path in memory. Passes load and store only the members that they need.
struct PathState {
    vec3 origin;       // of the next ray
    float density;     // of the last scattering, per steradian; 0: light sampling cannot sample this direction
    vec3 direction;
    uint steps;        // Steps, packed
    vec3 throughput;
    uint salt;         // seed for alpha-blended surfaces along shadow rays
    vec3 side;         // geometric normal at the last scattering, unit, on the side where the path left
    uint to_direct;    // 1: the waiting light is scattered once
    vec3 emission;     // radiance without scattering
    vec3 direct;       // radiance after one scattering
    vec3 indirect;     // radiance after more scatterings
    vec3 albedo;       // of the first surface; this and the next three are undefined without one
    float depth;       // along the view axis, metres
    vec3 normal;       // shading normal
    vec3 position;
    vec3 light_origin;
    WaitingLight lamp; // three members, because compilers keep an array in memory and not in registers
    WaitingLight sun;
    WaitingLight sky;
};

// How far a path has come.
struct Steps {
    bool alive;
    uint vertex;       // surfaces visited
    uint scattered;    // by Lambert or GGX
    uint specular;     // by mirrors and glass
};

// Settings allow 1000 bounces and as many specular bounces.
uint packed_steps(Steps steps) {
    return uint(steps.alive) | steps.vertex << 1u | steps.scattered << 12u | steps.specular << 22u;
}

Steps unpacked_steps(uint steps) {
    return Steps((steps & 1u) != 0u, steps >> 1u & 0x7ffu, steps >> 12u & 0x3ffu, steps >> 22u);
}

// Number of paths with a ray of one kind between two surfaces. The first three members are the groups of an indirect dispatch.
struct PathCount {
    uint groups;       // of PATH_GROUP paths
    uint one;
    uint another;
    uint paths;
};
const uint PATH_GROUP = 64u; // export
// Lists of `capacity` slots: one for each kind of rays to lights; rays to the next surface have two, for even and odd numbers.
const uint PATH_LISTS = 5u; // export

// Place of a list, in capacities. `turn`: 0 for camera rays, n + 1 for rays from surface n.
uint path_list(uint way, uint turn) {
    return way == ON ? ON + (turn & 1u) : way;
}

// Number of a PathCount.
uint path_count(uint way, uint turn) {
    return 4u * turn + way;
}

// Four independent random words: a pure function of seed, pixel, sample and dimension.
uvec4 random_words(uvec2 pixel, uint sample_number, uint dimension, uint seed) {
    return pcg4d(uvec4(pixel.x | pixel.y << 16u, sample_number, dimension, seed));
}

#endif
