// Whether surfaces must gather for themselves: groups of the dispatches that let them.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/igi_cache.glsl"

layout(local_size_x = 1) in;

layout(binding = 0, scalar) writeonly buffer Groups { uint groups[]; };

layout(push_constant, scalar) uniform Push {
    uint most; // cells
    uint full; // groups if there are more
};

void main() {
    groups[0] = cache_count > most ? full : 0u;
    groups[1] = 1u;
    groups[2] = 1u;
}
