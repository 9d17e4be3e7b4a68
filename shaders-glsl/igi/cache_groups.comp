// Size of the indirect dispatches that gather without the cache: zero workgroups if all cells fit into the cache.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "igi/cache.glsl"

layout(local_size_x = 1) in;

layout(binding = 0, scalar) writeonly buffer Groups { uint groups[]; };

layout(push_constant, scalar) uniform Push {
    uint most; // maximum of cells
    uint full; // workgroups if there are more cells
};

void main() {
    groups[0] = cache_count > most ? full : 0u;
    groups[1] = 1u;
    groups[2] = 1u;
}
