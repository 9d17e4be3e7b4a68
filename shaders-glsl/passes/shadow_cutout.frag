#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"

layout(binding = 1, scalar) readonly buffer Instances { Instance instances[]; };
layout(push_constant, scalar) uniform Push {
    mat4 clip_from_world;
    uint seed; // of blended surfaces
};

#include "lib/shadow_cutout.glsl"
