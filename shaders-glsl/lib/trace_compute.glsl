// Tracing by a compute traversal of the trees of lib/trace_nodes.glsl.
#ifndef LIB_TRACE_COMPUTE
#define LIB_TRACE_COMPUTE
#include "lib/trace_nodes.glsl"

// Five vectors a node: CPU drivers load a vector as fast as a number.
layout(binding = 40, scalar) readonly buffer TraceNodes { uvec4 trace_nodes[]; };
// A record is three vectors: corners in xyz; in w the bits of surface (TRACE_SINGLE_SIDED …), instance, triangle.
layout(binding = 41, scalar) readonly buffer TraceTriangles { vec4 trace_triangles[]; };
// The first is the top tree itself, in world space.
layout(binding = 42, scalar) readonly buffer TraceInstances { TraceInstance trace_instances[]; };

// A ray as the nodes of one tree see it.
struct TraceSlabs {
    vec3 origin;
    vec3 inverse;
    vec3 pad;    // boxes are grown by this much time
    uint octant; // bits of the axes along which it goes up
};

TraceSlabs trace_slabs(vec3 origin, vec3 direction, float reach) {
    // No component is zero then, and no product below infinite.
    float tiny = 1e-20 * max(abs(direction.x), max(abs(direction.y), abs(direction.z)));
    vec3 d = mix(max(direction, vec3(tiny)), min(direction, vec3(-tiny)), lessThan(direction, vec3(0.0)));
    TraceSlabs slabs;
    slabs.origin = origin;
    slabs.inverse = 1.0 / d;
    // More than what the triangle test rounds, so that no box hides what that test hits.
    float size = max(reach, max(abs(origin.x), max(abs(origin.y), abs(origin.z))));
    slabs.pad = abs(slabs.inverse) * (size * 1e-6);
    slabs.octant = (d.x > 0.0 ? 1u : 0u) | (d.y > 0.0 ? 2u : 0u) | (d.z > 0.0 ? 4u : 0u);
    return slabs;
}

// Four bytes of a word as floats.
vec4 trace_bytes(uint word) {
    return vec4(ivec4(word & 0xffu, word >> 8u & 0xffu, word >> 16u & 0xffu, word >> 24u));
}

#ifdef TRACE_BOXES
// Boxes of the last node that the ray enters and leaves between its ends.
uint trace_between = 0u;
#endif

// Which of four boxes the ray meets between t_min and t_max: bounds in steps, near ones first.
uint trace_boxes(uvec3 near_words, uvec3 far_words, vec3 step_time, vec3 near_time, vec3 far_time, float t_min, float t_max) {
    vec4 near = max(trace_bytes(near_words.x) * step_time.x + near_time.x, trace_bytes(near_words.y) * step_time.y + near_time.y);
    near = max(max(near, trace_bytes(near_words.z) * step_time.z + near_time.z), t_min);
    vec4 far = min(trace_bytes(far_words.x) * step_time.x + far_time.x, trace_bytes(far_words.y) * step_time.y + far_time.y);
    far = min(min(far, trace_bytes(far_words.z) * step_time.z + far_time.z), t_max);
    bvec4 hit = lessThanEqual(near, far);
#ifdef TRACE_BOXES
    bvec4 past = greaterThan(near, vec4(t_min)), before = lessThan(far, vec4(t_max));
    trace_between = uint(past.x && before.x) | uint(past.y && before.y) << 1u | uint(past.z && before.z) << 2u
        | uint(past.w && before.w) << 3u;
#endif
    return uint(hit.x) | uint(hit.y) << 1u | uint(hit.z) << 2u | uint(hit.w) << 3u;
}

// Slots of a node that the ray meets, as bits; also words 4 and 5 of the node.
uint trace_node(uint node, TraceSlabs slabs, float t_min, float t_max, out uvec2 children) {
    uint w = 5u * node;
    uvec4 a = trace_nodes[w], b = trace_nodes[w + 1u], c = trace_nodes[w + 2u], d = trace_nodes[w + 3u];
    uvec2 e = trace_nodes[w + 4u].xy;
    children = b.xy;
    uvec3 steps = uvec3(a.w << 23u, a.w << 15u, a.w << 7u) & 0x7f800000u;
    vec3 step_time = uintBitsToFloat(steps) * slabs.inverse;
    vec3 time = (uintBitsToFloat(a.xyz) - slabs.origin) * slabs.inverse;
    vec3 near_time = time - slabs.pad, far_time = time + slabs.pad;
    uvec3 low0 = uvec3(b.z, c.x, c.z), low1 = uvec3(b.w, c.y, c.w);
    uvec3 high0 = uvec3(d.x, d.z, e.x), high1 = uvec3(d.y, d.w, e.y);
    bvec3 backward = lessThan(slabs.inverse, vec3(0.0));
#ifdef TRACE_BOXES
    uint first = trace_boxes(mix(low0, high0, backward), mix(high0, low0, backward), step_time, near_time, far_time, t_min, t_max);
    uint first_between = trace_between;
    uint second = trace_boxes(mix(low1, high1, backward), mix(high1, low1, backward), step_time, near_time, far_time, t_min, t_max);
    trace_between = first_between | trace_between << 4u;
    return first | second << 4u;
#else
    return trace_boxes(mix(low0, high0, backward), mix(high0, low0, backward), step_time, near_time, far_time, t_min, t_max)
        | trace_boxes(mix(low1, high1, backward), mix(high1, low1, backward), step_time, near_time, far_time, t_min, t_max) << 4u;
#endif
}

// Moves bit i of a byte to bit i ^ octant.
uint trace_permuted(uint bits, uint octant) {
    bits = (octant & 1u) != 0u ? (bits & 0x55u) << 1u | (bits >> 1u & 0x55u) : bits;
    bits = (octant & 2u) != 0u ? (bits & 0x33u) << 2u | (bits >> 2u & 0x33u) : bits;
    return (octant & 4u) != 0u ? (bits & 0x0fu) << 4u | bits >> 4u : bits;
}

// Order in which the rasteriser draws surfaces with these bits: opaque ones first, single-sided before double-sided ones
// (scene::resident::Batches).
uint trace_rank(uint surface) {
    uint sides = (surface & TRACE_SINGLE_SIDED) == 0u ? 2u : (surface & TRACE_REVERSED) != 0u ? 1u : 0u;
    return (surface & TRACE_CUTOUT) != 0u ? 4u + sides : sides;
}

Hit trace(Ray ray, uint mask, uint salt, bool any) {
    Hit hit = Hit(ray.t_max, vec2(0.0), NONE, NONE);
    uint best = NONE; // record of the hit
    // Entries: a node and the slots that are still to be visited, permuted so that bit 0 is the nearest; 0: the tree's end.
    uint stack[TRACE_DEPTH];
    uint height = 0u;
    TraceSlabs slabs = trace_slabs(ray.origin, ray.direction, trace_instances[0].reach);
    TraceShear shear = trace_shear(ray.direction);
    uint first_instance = 0u;
    bool inside = false;
    stack[height++] = 0u;
    uint next = trace_instances[0].root; // node to visit, NONE: the tree is done
    uint leaves = 0u;                    // first record and the slots that were hit and not yet looked at
    uint leaf_slots = 0u;
#ifdef TRACE_BOXES
    uint boxes = 0u;                     // of these slots, those whose boxes stand for their triangles
#endif
    uint above = 0u, above_slots = 0u;   // the same of the top tree while inside
    int left = int(TRACE_STEPS);
    bool done = false;
    // CPU drivers run both sides of every branch for all their lanes and skip only loops: what is rare stands outside.
    while (!done) {
        // Until something rare comes: a place to enter or to leave, a surface that may be cut out, the end.
        uint candidate = NONE;
        vec3 candidate_at = vec3(0.0);
        bool rare = false;
        --left;
        while (!rare) {
            --left;
            while (leaf_slots == 0u && next != NONE) {
                uvec2 children;
                uint hits = trace_node(next, slabs, ray.t_min, hit.t, children);
                leaves = children.y;
                leaf_slots = hits & leaves & 0xffu;
#ifdef TRACE_BOXES
                boxes = IMPERFECT != 0u && any ? trace_between & leaf_slots : 0u;
#endif
                uint slots = trace_permuted(hits & children.x & 0xffu, slabs.octant);
                uint entry = next << 8u | slots;
                if (slots == 0u) {
                    entry = stack[--height];
                }
                if (entry == 0u) {
                    next = NONE;
                } else {
                    uint slot = uint(findLSB(entry)) ^ slabs.octant;
                    uint nodes = trace_nodes[5u * (entry >> 8u) + 1u].x;
                    next = (nodes >> 8u) + uint(bitCount(nodes & ((1u << slot) - 1u)));
                    entry &= entry - 1u;
                    if ((entry & 0xffu) != 0u) {
                        stack[height++] = entry;
                    }
                }
                if (--left <= 0) {
                    next = NONE;
                    leaf_slots = 0u;
                }
            }
            rare = !inside || leaf_slots == 0u;
#ifdef TRACE_BOXES
            // Whatever side is seen and whatever is cut out of it. Nearly always the first one ends the ray.
            leaf_slots &= inside ? ~boxes : ~0u;
            while (inside && boxes != 0u) {
                uint slot = uint(findLSB(boxes));
                boxes &= boxes - 1u;
                --left;
                uint record = (leaves >> 8u) + uint(bitCount(leaves & ((1u << slot) - 1u)));
                uint surface = floatBitsToUint(trace_triangles[3u * record].w);
                if (trace_counts(surface & TRACE_UNLIT, 1.0, mask)) {
                    hit.t = ray.t_min;
                    hit.instance = first_instance;
                    boxes = 0u;
                    done = true;
                    rare = true;
                }
            }
#endif
            while (!rare && leaf_slots != 0u) {
                uint slot = uint(findLSB(leaf_slots));
                uint record = (leaves >> 8u) + uint(bitCount(leaves & ((1u << slot) - 1u)));
                leaf_slots &= leaf_slots - 1u;
                --left;
                vec4 a = trace_triangles[3u * record];
                vec3 b = trace_triangles[3u * record + 1u].xyz, c = trace_triangles[3u * record + 2u].xyz;
                vec3 at;
                float side = trace_triangle(a.xyz, b, c, slabs.origin, shear, at);
                uint surface = floatBitsToUint(a.w);
                if (at.x >= ray.t_min && at.x <= hit.t && trace_counts(surface, side, mask)) {
                    bool equal = at.x == hit.t;
                    if ((surface & TRACE_CUTOUT) != 0u || equal) {
                        candidate = record;
                        candidate_at = at;
                        rare = true;
                    } else {
                        hit.t = at.x;
                        hit.barycentrics = at.yz;
                        best = record;
                        hit.instance = first_instance;
                        done = any;
                        rare = any;
                    }
                }
            }
        }
        if (candidate != NONE) {
            uint instance = first_instance + floatBitsToUint(trace_triangles[3u * candidate + 1u].w);
            uint triangle = floatBitsToUint(trace_triangles[3u * candidate + 2u].w);
            uint surface = floatBitsToUint(trace_triangles[3u * candidate].w);
            // Of equals that which the rasteriser draws first, then the first instance's first triangle, whatever the order of the tree.
            bool nearer = candidate_at.x < hit.t;
            if (!nearer && best != NONE) {
                uint other = hit.instance + floatBitsToUint(trace_triangles[3u * best + 1u].w);
                uint other_triangle = floatBitsToUint(trace_triangles[3u * best + 2u].w);
                uint rank = trace_rank(surface), other_rank = trace_rank(floatBitsToUint(trace_triangles[3u * best].w));
                nearer = rank < other_rank || (rank == other_rank && (instance < other || (instance == other && triangle < other_triangle)));
            }
            bool there = (surface & TRACE_CUTOUT) == 0u;
            if (nearer && (there || trace_covered(instance, triangle, candidate_at.yz, mask, salt))) {
                hit.t = candidate_at.x;
                hit.barycentrics = candidate_at.yz;
                hit.instance = first_instance;
                best = candidate;
                done = any;
            }
        } else if (leaf_slots != 0u && !done) {
            // Down into the next instance.
            uint slot = uint(findLSB(leaf_slots));
            uint place = (leaves >> 8u) + uint(bitCount(leaves & ((1u << slot) - 1u)));
            above = leaves;
            above_slots = leaf_slots & (leaf_slots - 1u);
            leaf_slots = 0u;
            stack[height++] = next;
            stack[height++] = 0u;
            TraceInstance instance = trace_instances[place];
            vec4 x = instance.object_from_world[0], y = instance.object_from_world[1], z = instance.object_from_world[2];
            vec3 origin = vec3(dot(x.xyz, ray.origin) + x.w, dot(y.xyz, ray.origin) + y.w, dot(z.xyz, ray.origin) + z.w);
            vec3 direction = vec3(dot(x.xyz, ray.direction), dot(y.xyz, ray.direction), dot(z.xyz, ray.direction));
            slabs = trace_slabs(origin, direction, instance.reach);
            shear = trace_shear(direction);
            first_instance = instance.first_instance;
            next = instance.root;
            inside = true;
        } else if (inside && !done) {
            // Up again.
            inside = false;
            slabs = trace_slabs(ray.origin, ray.direction, trace_instances[0].reach);
            leaves = above;
            leaf_slots = above_slots;
            next = stack[--height];
            done = next == NONE && leaf_slots == 0u;
        } else {
            done = true;
        }
        done = done || left <= 0;
    }
    trace_turns = TRACE_STEPS - uint(max(left, 0));
    if (best != NONE) {
        hit.instance += floatBitsToUint(trace_triangles[3u * best + 1u].w);
        hit.triangle = floatBitsToUint(trace_triangles[3u * best + 2u].w);
    }
    return hit;
}

#endif
