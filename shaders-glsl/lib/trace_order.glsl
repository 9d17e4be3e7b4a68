// The order in which a traversal visits the nodes of a tree, and its stack. There are two ways, which find the same hits. CPU drivers run
// the first one: TRACE_ORDERED is 1 there. `benches/rays` compares them.
//
// Ordered: the children of a node that a ray meets are sorted by the time at which the ray enters them, and a node behind the nearest hit is
// skipped. Registers hold the top of the stack. CPU drivers write to an array for one lane after the other, but move a register for all lanes
// at once, so that eight moves cost less than one write.
//
// Grouped: an entry of the stack is a node and those of its slots that are still to be visited, in the order of the ray's octant (Ylitie et
// al., section 3.3). It needs few registers and one entry a level.
//
// Rays that end at any hit begin with the far children in both ways: in rooms the walls at their ends are large. Sorting does not pay for
// such rays, so they take the farthest child first and the others as a group.
#ifndef LIB_TRACE_ORDER
#define LIB_TRACE_ORDER
#include "lib/trace_nodes.glsl"

// The engine sets this constant, for every shader alike (lucerna::gpu::Traversal).
layout(constant_id = 31) const uint TRACE_ORDERED = 0u;

// Grouped entries: a node and slots, permuted so that bit 0 is the first one; 0: the tree's end.
uint trace_stack[TRACE_DEPTH];
// Ordered: the same, or for nearest hits a node and the time at which the ray enters it. The top of the stack, then what has no place there.
uint trace_top0, trace_top1, trace_top2, trace_top3, trace_top4, trace_top5;
const uint TRACE_TOP = 6u;
uint trace_rest[7u * TRACE_DEPTH];

void trace_push(inout uint height, uint entry) {
    if (TRACE_ORDERED != 0u) {
        if (height >= TRACE_TOP) trace_rest[height - TRACE_TOP] = trace_top5;
        trace_top5 = trace_top4;
        trace_top4 = trace_top3;
        trace_top3 = trace_top2;
        trace_top2 = trace_top1;
        trace_top1 = trace_top0;
        trace_top0 = entry;
    } else {
        trace_stack[height] = entry;
    }
    ++height;
}

uint trace_pop(inout uint height) {
    --height;
    if (TRACE_ORDERED == 0u) return trace_stack[height];
    uint entry = trace_top0;
    trace_top0 = trace_top1;
    trace_top1 = trace_top2;
    trace_top2 = trace_top3;
    trace_top3 = trace_top4;
    trace_top4 = trace_top5;
    if (height >= TRACE_TOP) trace_top5 = trace_rest[height - TRACE_TOP];
    return entry;
}

// Moves bit i of a byte to bit i ^ octant.
uint trace_permuted(uint bits, uint octant) {
    bits = (octant & 1u) != 0u ? (bits & 0x55u) << 1u | (bits >> 1u & 0x55u) : bits;
    bits = (octant & 2u) != 0u ? (bits & 0x33u) << 2u | (bits >> 2u & 0x33u) : bits;
    return (octant & 4u) != 0u ? (bits & 0x0fu) << 4u | bits >> 4u : bits;
}

// The child node in a slot; `children` is word 4 of the node.
uint trace_child(uint children, uint slot) {
    return (children >> 8u) + uint(bitCount(children & ((1u << slot) - 1u)));
}

// Times of entering eight boxes as numbers of the same order, 0 or more; the lowest three bits are free.
void trace_keys(vec4 enter[2], out uvec4 low, out uvec4 high) {
    low = floatBitsToUint(mix(vec4(0.0), enter[0], greaterThan(enter[0], vec4(0.0)))) & ~7u;
    high = floatBitsToUint(mix(vec4(0.0), enter[1], greaterThan(enter[1], vec4(0.0)))) & ~7u;
}

// Times are kept in eight bits, in eighths of an octave. The first of these steps, for rays in a scene with coordinates up to `reach`: from
// 2^-22 to 2^9 of the time in which a ray crosses it.
int trace_first_step(float reach, vec3 direction) {
    return int(floatBitsToUint(reach / length(direction)) >> 20u) - 180;
}

uint trace_step_of(uint time, int first_step) {
    return uint(clamp(int(time >> 20u) - first_step, 0, 255));
}

// The next node, NONE at the tree's end: of the children in `slots` of a node, or of the stack. `enter`: times of entering the eight boxes.
// Rays that end at any hit, and all rays in groups.
uint trace_next_of_group(inout uint height, uint node, uint children, uint slots, vec4 enter[2], uint octant) {
    uint slot, others;
    if (TRACE_ORDERED != 0u) {
        uvec4 low = floatBitsToUint(enter[0]) & ~7u, high = floatBitsToUint(enter[1]) & ~7u;
        uint a = (slots & 1u) != 0u ? low.x : 0u, b = (slots & 2u) != 0u ? low.y | 1u : 0u;
        uint c = (slots & 4u) != 0u ? low.z | 2u : 0u, d = (slots & 8u) != 0u ? low.w | 3u : 0u;
        uint e = (slots & 16u) != 0u ? high.x | 4u : 0u, f = (slots & 32u) != 0u ? high.y | 5u : 0u;
        uint g = (slots & 64u) != 0u ? high.z | 6u : 0u, h = (slots & 128u) != 0u ? high.w | 7u : 0u;
        a = a > b ? a : b;
        c = c > d ? c : d;
        e = e > f ? e : f;
        g = g > h ? g : h;
        a = a > c ? a : c;
        e = e > g ? e : g;
        slot = (a > e ? a : e) & 7u;
        others = trace_permuted(slots & ~(1u << slot), octant);
    } else {
        uint permuted = trace_permuted(slots, octant);
        slot = uint(findLSB(permuted)) ^ octant;
        others = permuted & (permuted - 1u);
    }
    if (slots == 0u) {
        slots = trace_pop(height);
        node = slots >> 8u;
        children = TRACE_NODES(5u * node + 1u).x;
        slot = uint(findLSB(slots)) ^ octant;
        others = slots & (slots - 1u) & 0xffu;
    }
    if (slots == 0u) return NONE;
    if (others != 0u) trace_push(height, node << 8u | others);
    return trace_child(children, slot);
}

void trace_sort(inout uint a, inout uint b) {
    bool less = a < b;
    uint larger = less ? b : a;
    a = less ? a : b;
    b = larger;
}

// The next node of a ray to its nearest hit at time `t_max`, in order.
uint trace_next_in_order(inout uint height, uint children, uint slots, vec4 enter[2], float t_max, int first_step) {
    uvec4 low, high;
    trace_keys(enter, low, high);
    // The place of a child among the child nodes stands in the lowest bits: how many slots below are nodes.
    uint below1 = children & 1u, below2 = below1 + (children >> 1u & 1u), below3 = below2 + (children >> 2u & 1u);
    uint below4 = below3 + (children >> 3u & 1u), below5 = below4 + (children >> 4u & 1u);
    uint below6 = below5 + (children >> 5u & 1u), below7 = below6 + (children >> 6u & 1u);
    uint a = (slots & 1u) != 0u ? low.x : NONE, b = (slots & 2u) != 0u ? low.y | below1 : NONE;
    uint c = (slots & 4u) != 0u ? low.z | below2 : NONE, d = (slots & 8u) != 0u ? low.w | below3 : NONE;
    uint e = (slots & 16u) != 0u ? high.x | below4 : NONE, f = (slots & 32u) != 0u ? high.y | below5 : NONE;
    uint g = (slots & 64u) != 0u ? high.z | below6 : NONE, h = (slots & 128u) != 0u ? high.w | below7 : NONE;
    // Batcher's network for eight numbers.
    trace_sort(a, b); trace_sort(c, d); trace_sort(e, f); trace_sort(g, h);
    trace_sort(a, c); trace_sort(b, d); trace_sort(e, g); trace_sort(f, h);
    trace_sort(b, c); trace_sort(f, g); trace_sort(a, e); trace_sort(d, h);
    trace_sort(b, f); trace_sort(c, g);
    trace_sort(b, e); trace_sort(d, g);
    trace_sort(c, e); trace_sort(d, f);
    trace_sort(d, e);
    uint first = children >> 8u;
    // Nested, so that eight lanes with few children skip the rest.
#define TRACE_PUSH(key) if (key != NONE) trace_push(height, first + (key & 7u) << 8u | trace_step_of(key, first_step));
    if (b != NONE) {
        if (c != NONE) {
            if (d != NONE) {
                if (e != NONE) {
                    TRACE_PUSH(h) TRACE_PUSH(g) TRACE_PUSH(f) TRACE_PUSH(e)
                }
                TRACE_PUSH(d)
            }
            TRACE_PUSH(c)
        }
        TRACE_PUSH(b)
    }
#undef TRACE_PUSH
    if (a != NONE) return first + (a & 7u);
    uint last_step = trace_step_of(floatBitsToUint(t_max), first_step);
    uint entry;
    do entry = trace_pop(height); while ((entry & 0xffu) > last_step);
    return entry == 0u ? NONE : entry >> 8u;
}

#endif
