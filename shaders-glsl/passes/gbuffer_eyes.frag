// The G-buffer of two eyes in one pass: each view is a layer of the images.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_multiview : require
#define EYES
#include "passes/gbuffer_fragment.glsl"
