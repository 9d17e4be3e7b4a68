// The sums over samples by address. The layers lie one after the other, each row by row.
#ifndef LIB_PATH_SUMS_AT
#define LIB_PATH_SUMS_AT
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "reference/path_layers.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer SumsAt { vec4 of[]; };
#define SUM_AT(address, i) SumsAt(address).of[i]

#endif
