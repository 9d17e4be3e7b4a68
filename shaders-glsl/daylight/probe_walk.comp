// The paths of probes.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#define PROBES
#include "daylight/walk.glsl"
