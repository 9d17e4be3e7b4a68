// Surface attributes of the nearest visible surface; see lib/gbuffer.glsl for what each attachment holds.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "passes/gbuffer_fragment.glsl"
