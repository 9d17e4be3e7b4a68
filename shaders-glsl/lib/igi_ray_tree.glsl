// Trees of mirrored and refracted rays (Whitted 1980), grown a level a dispatch. A pixel has TREE_WIDTH nodes; a ray that splits keeps its
// node for what goes on through and gives the reflection a free one. Where none is left one of the two is taken at random.
#ifndef LIB_IGI_RAY_TREE
#define LIB_IGI_RAY_TREE

const uint TREE_WIDTH = 4u; // export

// TreeNode.state
const uint TREE_EMPTY = 0u;
const uint TREE_RAY = 1u;     // goes on in the next level
const uint TREE_SURFACE = 2u; // lit by the passes that follow

struct TreeNode {
    vec3 position;  // of the ray's start, or of the surface, metres
    uint state;     // TREE_
    vec3 direction; // of the ray (the first one as long as the view), or towards where the surface is seen from
    float gap;      // step off the surface, metres
    vec3 weight;    // share of the light that reaches the pixel
    float roughness;
    vec3 normal;
    uint pixel;     // x | y << 16
    vec3 albedo;
    vec3 f0;
    vec3 light;     // what has reached the pixel from here, W/(sr·m²)
};

layout(binding = 70, scalar) buffer TreeNodes { TreeNode tree_nodes[]; };

// Slots run through blocks of 8 × 8 pixels, so that a workgroup's rays are neighbours.
uvec2 pixel_of(uint slot, uvec2 extent) {
    uint blocks = (extent.x + 7u) / 8u;
    uint block = slot / 64u, inside = slot % 64u;
    return 8u * uvec2(block % blocks, block / blocks) + uvec2(inside % 8u, inside / 8u);
}

#endif
