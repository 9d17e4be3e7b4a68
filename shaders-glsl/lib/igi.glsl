// What the passes of igi/ that meet lamps and materials are told. Before including: lib/environment_sampling.glsl.
#ifndef LIB_IGI
#define LIB_IGI

struct IgiSettings {
    EnvironmentMap environment;
    vec3 low;              // box around the scene, metres
    uint paths;
    vec3 high;
    uint bounces;          // virtual lights of a path at most
    uint specular_depth;   // mirrors and glass along a path at most
    uint diffuse_only;     // 1: no gloss, no mirrors, no glass
    uint seed;
    uint samples;          // of emissive surfaces, and of the sky, a pixel
    uint tree;             // 1: there are emissive surfaces
    uint sky;              // 1: there is an environment
    // Numbers that compilers must not know, lest they unroll loops and take minutes on CPU drivers.
    uint slots;            // TEXTURE_SLOTS
    uint two;              // 2
};

#endif
