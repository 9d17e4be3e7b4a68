// Trees for compute traversal: a top tree over instances, below each a bottom tree over triangles that instances of the
// same shape share (built by lucerna::rays, refitted by rays/refit.comp).
#ifndef LIB_TRACE_NODES
#define LIB_TRACE_NODES

// A bottom tree where it stands.
struct TraceInstance {
    vec4 object_from_world[3]; // rows
    uint first_instance;       // added to the instances of the records
    uint root;                 // node
    float reach;               // no coordinate in the tree is larger
    uint only;                 // of the top tree: 1 if it has one instance
};

// Words of a node (Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017,
// with one triangle a leaf):
//  0.. 2  lowest corner, floats
//  3      biased exponents of the size of a step, 8 bits an axis
//  4      slots that are nodes (8 bits), first of those nodes (24 bits); the others follow it
//  5      slots that are leaves (8 bits), first of their records, or of their instances in the top tree
//  6..11  lower bounds of the eight boxes in steps, a byte each: x of slots 0 to 3, of 4 to 7, then y, z
// 12..17  upper bounds
// 18, 19  unused
const uint TRACE_NODE_WORDS = 20u; // export

// Nodes from the root to a leaf of both trees together, and two; lucerna::rays keeps to it.
const uint TRACE_DEPTH = 32u; // export
// Turns of the traversal's loops for one ray; a ray that needs more ends with what it has. CPU drivers stop loops at 65,535.
const uint TRACE_STEPS = 30000u; // export

#endif
