// Size of the dispatches over the pixels that no coarse texel matches.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 1) in;

layout(binding = 0, scalar) readonly buffer Unmatched { uint unmatched_count; uint unmatched[]; };
layout(binding = 1, scalar) writeonly buffer Groups { uint groups[]; };

void main() {
    groups[0] = (unmatched_count + 63u) / 64u;
    groups[1] = 1u;
    groups[2] = 1u;
}
