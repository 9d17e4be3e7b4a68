// Trees of reflected and refracted rays (Whitted 1980). Each dispatch traces one level. A pixel has TREE_WIDTH nodes. When a ray splits,
// the refracted ray keeps the node, and the reflected ray gets a free node. If no node is free, one of the two rays is chosen at random.
#ifndef LIB_IGI_RAY_TREE
#define LIB_IGI_RAY_TREE

const uint TREE_WIDTH = 4u; // export

// TreeNode.state
const uint TREE_EMPTY = 0u;
const uint TREE_RAY = 1u;     // a ray for the next level
const uint TREE_SURFACE = 2u; // a surface, to be lit by the following passes

struct TreeNode {
    vec3 position;  // of the ray's origin, or of the surface, metres
    uint state;     // TREE_
    vec3 direction; // of the ray (camera rays have the length of view_ray), or from the surface towards the viewer
    float gap;      // step off the surface, metres
    vec3 weight;    // share of the radiance that reaches the pixel
    float roughness;
    vec3 normal;
    uint pixel;     // x | y << 16
    vec3 albedo;
    vec3 f0;
    vec3 light;     // radiance that has reached the pixel from this node, W/(sr·m²)
};

layout(binding = 70, scalar) buffer TreeNodes { TreeNode tree_nodes[]; };

// The nodes of one branch of this many slots lie side by side. Most trees have one or two nodes, so this gives neighbouring invocations equal
// work. A range of pixels has a multiple of this many slots.
const uint TREE_BLOCK = 64u; // export

// Number of a node.
uint tree_node_of(uint slot, uint branch) {
    return (slot / TREE_BLOCK * TREE_WIDTH + branch) * TREE_BLOCK + slot % TREE_BLOCK;
}

uint tree_slot(uint node) {
    return node / (TREE_BLOCK * TREE_WIDTH) * TREE_BLOCK + node % TREE_BLOCK;
}

uint tree_branch(uint node) {
    return node / TREE_BLOCK % TREE_WIDTH;
}

// Pixel of a slot. Slots are ordered by blocks of 8 × 8 pixels, so that the rays of a workgroup are close to each other.
uvec2 pixel_of(uint slot, uvec2 extent) {
    uint blocks = (extent.x + 7u) / 8u;
    uint block = slot / 64u, inside = slot % 64u;
    return 8u * uvec2(block % blocks, block / blocks) + uvec2(inside % 8u, inside / 8u);
}

#endif
