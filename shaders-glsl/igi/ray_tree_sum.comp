// Sums the light of the ray tree nodes of each pixel.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "igi/ray_tree.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, rgba32f) uniform image2D sharp;

layout(push_constant, scalar) uniform Push {
    uint first; // slot
    uint count; // slots
};

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= count) return;
    uvec2 extent = uvec2(imageSize(sharp));
    uvec2 pixel = pixel_of(first + slot, extent);
    if (any(greaterThanEqual(pixel, extent))) return;
    vec3 sum = vec3(0.0);
    for (uint branch = 0u; branch < TREE_WIDTH; ++branch) sum += tree_nodes[tree_node_of(slot, branch)].light;
    imageStore(sharp, ivec2(pixel), vec4(sum, imageLoad(sharp, ivec2(pixel)).a));
}
