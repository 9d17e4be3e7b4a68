#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"

layout(binding = 1, scalar) readonly buffer Instances { Instance instances[]; };
layout(push_constant, scalar) uniform Push {
    uint light;    // virtual light
    uint face;     // which of the light's three maps
    float nearest; // near plane, metres
    uint seed;     // seed for alpha-blended surfaces
};

#include "lib/shadow_cutout.glsl"
