// Workgroups for a list of `count` items: rows of at most MAX_X, for devices that allow few in one direction.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

#include "tonemap/list.glsl"

layout(local_size_x = 1) in;

layout(binding = 0, scalar) readonly buffer Count { uint count; };
layout(binding = 1, scalar) writeonly buffer Groups { uint groups[3]; };

layout(push_constant, scalar) uniform Push {
    uint items;  // of a workgroup
};

void main() {
    uint needed = count / items + uint(count % items != 0u);
    groups[0] = min(needed, LIST_ROW);
    groups[1] = (needed + LIST_ROW - 1u) / LIST_ROW;
    groups[2] = uint(needed > 0u);
}
