// Sizes of the indirect dispatches over the pixels without a matching coarse texel, one for each range of the list.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Unmatched { uint unmatched_count; uint unmatched[]; };
layout(binding = 1, scalar) writeonly buffer Groups { uint groups[]; }; // three values per range

layout(push_constant, scalar) uniform Push {
    uint ranges;
    uint pixels; // per range; small enough for the device's maximum of workgroups
};

void main() {
    uint range = gl_GlobalInvocationID.x;
    if (range >= ranges) return;
    uint left = unmatched_count - min(range * pixels, unmatched_count);
    groups[3u * range] = (min(left, pixels) + 63u) / 64u;
    groups[3u * range + 1u] = 1u;
    groups[3u * range + 2u] = 1u;
}
