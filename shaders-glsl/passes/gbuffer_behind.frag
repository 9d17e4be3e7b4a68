// The G-buffer of the nearest surface behind another layer of it (depth peeling, Everitt 2001), backs of solid bodies included.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#define BEHIND
#include "passes/gbuffer_fragment.glsl"
