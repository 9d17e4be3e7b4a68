// The settings block of the passes of igi/ that trace rays and evaluate materials. Before including: lib/environment_sampling.glsl.
#ifndef LIB_IGI
#define LIB_IGI

struct IgiSettings {
    EnvironmentMap environment;
    vec3 low;              // corner of the scene's bounding box, metres
    uint paths;
    vec3 high;             // opposite corner, metres
    uint bounces;          // maximum of virtual lights per path
    uint specular_depth;   // maximum of mirrors and glass surfaces along a path
    uint diffuse_only;     // 1: no gloss, no mirrors, no glass
    uint seed;
    uint samples;          // shadow rays per pixel to emissive surfaces, and as many to the environment
    uint glossy;           // shadow rays per pixel to highlights of the environment on smooth surfaces
    uint tree;             // 1: the scene has emissive surfaces
    uint sky;              // 1: the scene has an environment
    // Loop bounds that are not compile-time constants: compilers of CPU drivers would unroll the loops, which takes minutes.
    uint slots;            // TEXTURE_SLOTS
    uint two;              // 2
};

#endif
