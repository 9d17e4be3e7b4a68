// Tracing by a compute traversal of the trees of lib/trace_nodes.glsl.
#ifndef LIB_TRACE_COMPUTE
#define LIB_TRACE_COMPUTE
#include "lib/scene_at.glsl"
#include "lib/trace_nodes.glsl"

// Five vectors a node: CPU drivers load a vector as fast as a number.
layout(binding = 40, scalar) readonly buffer TraceNodes { uvec4 trace_nodes[]; };
// A record is three vectors: corners in xyz; in w the bits of surface (TRACE_SINGLE_SIDED …), instance, triangle.
layout(binding = 41, scalar) readonly buffer TraceTriangles { vec4 trace_triangles[]; };
// The first is the top tree itself, in world space.
layout(binding = 42, scalar) readonly buffer TraceInstances { TraceInstance trace_instances[]; };

#define TRACE_NODES(i) TraceNodesAt(scene_at.nodes).of[i]
#define TRACE_TRIANGLES(i) VectorsOf4At(scene_at.triangles).of[i]

#include "lib/trace_order.glsl"

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

// The larger and the smaller of two numbers. CPU drivers have one instruction for each of them. max() and min() take three instructions,
// because they return the other number where one is NaN.
vec4 trace_larger(vec4 a, vec4 b) {
    return vec4(a.x > b.x ? a.x : b.x, a.y > b.y ? a.y : b.y, a.z > b.z ? a.z : b.z, a.w > b.w ? a.w : b.w);
}

vec4 trace_smaller(vec4 a, vec4 b) {
    return vec4(a.x < b.x ? a.x : b.x, a.y < b.y ? a.y : b.y, a.z < b.z ? a.z : b.z, a.w < b.w ? a.w : b.w);
}

// Which of four boxes the ray meets between t_min and t_max, and when it enters them: bounds in steps, near ones first.
uint trace_boxes(uvec3 near_words, uvec3 far_words, vec3 step_time, vec3 near_time, vec3 far_time, float t_min, float t_max, out vec4 near) {
    near = trace_larger(trace_bytes(near_words.x) * step_time.x + near_time.x, trace_bytes(near_words.y) * step_time.y + near_time.y);
    near = trace_larger(trace_larger(near, trace_bytes(near_words.z) * step_time.z + near_time.z), vec4(t_min));
    vec4 far = trace_smaller(trace_bytes(far_words.x) * step_time.x + far_time.x, trace_bytes(far_words.y) * step_time.y + far_time.y);
    far = trace_smaller(trace_smaller(far, trace_bytes(far_words.z) * step_time.z + far_time.z), vec4(t_max));
    bvec4 hit = lessThanEqual(near, far);
#ifdef TRACE_BOXES
    bvec4 past = greaterThan(near, vec4(t_min)), before = lessThan(far, vec4(t_max));
    trace_between = uint(past.x && before.x) | uint(past.y && before.y) << 1u | uint(past.z && before.z) << 2u
        | uint(past.w && before.w) << 3u;
#endif
    return uint(hit.x) | uint(hit.y) << 1u | uint(hit.z) << 2u | uint(hit.w) << 3u;
}

// Slots of a node that the ray meets, as bits; also words 4 and 5 of the node, and the times at which the ray enters the boxes.
uint trace_node(uint node, TraceSlabs slabs, float t_min, float t_max, out uvec2 children, out vec4 enter[2]) {
    uint w = 5u * node;
    uvec4 a = TRACE_NODES(w), b = TRACE_NODES(w + 1u), c = TRACE_NODES(w + 2u), d = TRACE_NODES(w + 3u);
    uvec2 e = TRACE_NODES(w + 4u).xy;
    children = b.xy;
    uvec3 steps = uvec3(a.w << 23u, a.w << 15u, a.w << 7u) & 0x7f800000u;
    vec3 step_time = uintBitsToFloat(steps) * slabs.inverse;
    vec3 time = (uintBitsToFloat(a.xyz) - slabs.origin) * slabs.inverse;
    vec3 near_time = time - slabs.pad, far_time = time + slabs.pad;
    uvec3 low0 = uvec3(b.z, c.x, c.z), low1 = uvec3(b.w, c.y, c.w);
    uvec3 high0 = uvec3(d.x, d.z, e.x), high1 = uvec3(d.y, d.w, e.y);
    bvec3 backward = lessThan(slabs.inverse, vec3(0.0));
    uint first = trace_boxes(mix(low0, high0, backward), mix(high0, low0, backward), step_time, near_time, far_time, t_min, t_max, enter[0]);
#ifdef TRACE_BOXES
    uint first_between = trace_between;
#endif
    uint second = trace_boxes(mix(low1, high1, backward), mix(high1, low1, backward), step_time, near_time, far_time, t_min, t_max, enter[1]);
#ifdef TRACE_BOXES
    trace_between = first_between | trace_between << 4u;
#endif
    return first | second << 4u;
}

// Order in which the rasteriser draws surfaces with these bits: opaque ones first, single-sided before double-sided ones
// (scene::resident::Batches).
uint trace_rank(uint surface) {
    uint sides = (surface & TRACE_SINGLE_SIDED) == 0u ? 2u : (surface & TRACE_REVERSED) != 0u ? 1u : 0u;
    return (surface & TRACE_CUTOUT) != 0u ? 4u + sides : sides;
}

// A ray on its way through the trees.
struct Traversal {
    Ray ray;
    uint mask;
    uint salt;
    Hit hit;           // `instance` without that of the record, no `triangle`
    uint best;         // record of the hit
    TraceSlabs slabs;  // of the tree in which the ray is
    TraceShear shear;
    uint first_instance;
    uint next;         // node to visit, NONE: the tree is done
    uint leaves;       // first record and the slots that are leaves
    uint leaf_slots;   // those that were hit and not yet looked at
    uint boxes;        // those whose boxes stand for their triangles (TRACE_BOXES)
    uint above;        // `leaves` and `leaf_slots` of the top tree while inside
    uint above_slots;
    bool inside;       // of an instance
    bool done;
    uint height;       // of the stack
    int first_step;    // of the times in the stack
    int left;          // turns
};

// Down into an instance.
void trace_enter(inout Traversal t, uint place) {
    trace_push(t.height, t.next);
    trace_push(t.height, 0u);
    TraceInstance instance = trace_instances[place];
    vec4 x = instance.object_from_world[0], y = instance.object_from_world[1], z = instance.object_from_world[2];
    Ray ray = t.ray;
    vec3 origin = vec3(dot(x.xyz, ray.origin) + x.w, dot(y.xyz, ray.origin) + y.w, dot(z.xyz, ray.origin) + z.w);
    vec3 direction = vec3(dot(x.xyz, ray.direction), dot(y.xyz, ray.direction), dot(z.xyz, ray.direction));
    t.slabs = trace_slabs(origin, direction, instance.reach);
    t.shear = trace_shear(direction);
    t.first_instance = instance.first_instance;
    t.next = instance.root;
    t.inside = true;
}

Traversal trace_begin(Ray ray, uint mask, uint salt) {
    Traversal t;
    t.ray = ray;
    t.mask = mask;
    t.salt = salt;
    t.hit = Hit(ray.t_max, vec2(0.0), NONE, NONE);
    t.best = NONE;
    t.first_instance = 0u;
    t.leaves = 0u;
    t.leaf_slots = 0u;
    t.boxes = 0u;
    t.above = 0u;
    t.above_slots = 0u;
    t.inside = false;
    t.done = false;
    t.first_step = trace_first_step(trace_instances[0].reach, ray.direction);
    t.height = 0u;
    t.left = int(TRACE_STEPS);
    if (trace_instances[0].only != 0u) {
        // The top tree has one leaf; the ray begins inside.
        t.next = NONE;
        trace_enter(t, 1u);
    } else {
        t.slabs = trace_slabs(ray.origin, ray.direction, trace_instances[0].reach);
        t.shear = trace_shear(ray.direction);
        t.next = trace_instances[0].root;
        trace_push(t.height, 0u);
    }
    return t;
}

// Visits a node: its leaves that the ray meets, and the next node.
void trace_visit(inout Traversal t, bool any) {
    uvec2 children;
    vec4 enter[2];
    uint hits = trace_node(t.next, t.slabs, t.ray.t_min, t.hit.t, children, enter);
    t.leaves = children.y;
    t.leaf_slots = hits & t.leaves & 0xffu;
#ifdef TRACE_BOXES
    t.boxes = IMPERFECT != 0u && any && t.inside ? trace_between & t.leaf_slots : 0u;
    t.leaf_slots &= ~t.boxes;
#endif
    uint slots = hits & children.x & 0xffu;
    if (TRACE_ORDERED != 0u && !any) {
        t.next = trace_next_in_order(t.height, children.x, slots, enter, t.hit.t, t.first_step);
    } else {
        // Bit 0 of a permuted byte is the far corner's slot; the nearest hit is looked for from the near corner.
        t.next = trace_next_of_group(t.height, t.next, children.x, slots, enter, any ? t.slabs.octant : t.slabs.octant ^ 7u);
    }
}

// Tests one triangle. Returns its record if its surface may be cut out, or if it is as near as the hit; NONE else.
uint trace_leaf(inout Traversal t, bool any, out vec3 at) {
    uint slot = uint(findLSB(t.leaf_slots));
    uint record = (t.leaves >> 8u) + uint(bitCount(t.leaves & ((1u << slot) - 1u)));
    t.leaf_slots &= t.leaf_slots - 1u;
    vec4 a = TRACE_TRIANGLES(3u * record);
    vec3 b = TRACE_TRIANGLES(3u * record + 1u).xyz, c = TRACE_TRIANGLES(3u * record + 2u).xyz;
    float side = trace_triangle(a.xyz, b, c, t.slabs.origin, t.shear, at);
    uint surface = floatBitsToUint(a.w);
    if (!(at.x >= t.ray.t_min && at.x <= t.hit.t && trace_counts(surface, side, t.mask))) return NONE;
    if ((surface & TRACE_CUTOUT) != 0u || at.x == t.hit.t) return record;
    t.hit.t = at.x;
    t.hit.barycentrics = at.yz;
    t.best = record;
    t.hit.instance = t.first_instance;
    t.done = any;
    return NONE;
}

// Decides about a triangle of trace_leaf().
void trace_candidate(inout Traversal t, bool any, uint candidate, vec3 at) {
    uint instance = t.first_instance + floatBitsToUint(TRACE_TRIANGLES(3u * candidate + 1u).w);
    uint triangle = floatBitsToUint(TRACE_TRIANGLES(3u * candidate + 2u).w);
    uint surface = floatBitsToUint(TRACE_TRIANGLES(3u * candidate).w);
    // Of equals that which the rasteriser draws first, then the first instance's first triangle, whatever the order of the tree.
    bool nearer = at.x < t.hit.t;
    if (!nearer && t.best != NONE) {
        uint other = t.hit.instance + floatBitsToUint(TRACE_TRIANGLES(3u * t.best + 1u).w);
        uint other_triangle = floatBitsToUint(TRACE_TRIANGLES(3u * t.best + 2u).w);
        uint rank = trace_rank(surface), other_rank = trace_rank(floatBitsToUint(TRACE_TRIANGLES(3u * t.best).w));
        nearer = rank < other_rank || (rank == other_rank && (instance < other || (instance == other && triangle < other_triangle)));
    }
    bool there = (surface & TRACE_CUTOUT) == 0u;
    if (nearer && (there || trace_covered(instance, triangle, at.yz, t.mask, t.salt))) {
        t.hit.t = at.x;
        t.hit.barycentrics = at.yz;
        t.hit.instance = t.first_instance;
        t.best = candidate;
        t.done = any;
    }
}

// Looks at one triangle, if there is one.
void trace_one(inout Traversal t, bool any) {
    if (t.leaf_slots == 0u || t.done) return;
    vec3 at;
    uint candidate = trace_leaf(t, any, at);
    if (candidate != NONE) trace_candidate(t, any, candidate, at);
}

// Down into the next instance.
void trace_enter_next(inout Traversal t) {
    uint slot = uint(findLSB(t.leaf_slots));
    uint place = (t.leaves >> 8u) + uint(bitCount(t.leaves & ((1u << slot) - 1u)));
    t.above = t.leaves;
    t.above_slots = t.leaf_slots & (t.leaf_slots - 1u);
    t.leaf_slots = 0u;
    trace_enter(t, place);
}

// Up again.
void trace_leave(inout Traversal t) {
    t.inside = false;
    t.slabs = trace_slabs(t.ray.origin, t.ray.direction, trace_instances[0].reach);
    t.leaves = t.above;
    t.leaf_slots = t.above_slots;
    t.next = trace_pop(t.height);
    t.done = t.leaf_slots == 0u && t.next == NONE;
}

#ifdef TRACE_BOXES
// Boxes that the ray enters and leaves between its ends stand for their triangles, whatever side is seen and whatever is cut out of it.
// Nearly always the first one ends the ray.
void trace_boxed(inout Traversal t) {
    while (t.boxes != 0u) {
        uint slot = uint(findLSB(t.boxes));
        t.boxes &= t.boxes - 1u;
        --t.left;
        uint record = (t.leaves >> 8u) + uint(bitCount(t.leaves & ((1u << slot) - 1u)));
        uint surface = floatBitsToUint(TRACE_TRIANGLES(3u * record).w);
        if (trace_counts(surface & TRACE_UNLIT, 1.0, t.mask)) {
            t.hit.t = t.ray.t_min;
            t.hit.instance = t.first_instance;
            t.boxes = 0u;
            t.done = true;
        }
    }
}
#endif

// One turn of a ray: a node, up to two triangles, and the way into and out of an instance. Invocations that run together may each do something
// else: CPU drivers skip a part that no invocation of a group needs, and run the other parts for all of them.
void trace_step(inout Traversal t, bool any) {
    --t.left;
    if (t.leaf_slots == 0u && t.next != NONE) {
        trace_visit(t, any);
#ifdef TRACE_BOXES
        if (t.boxes != 0u) trace_boxed(t);
#endif
    }
    if (t.inside) {
        trace_one(t, any);
        trace_one(t, any);
        if (t.leaf_slots == 0u && t.next == NONE && !t.done) trace_leave(t);
    } else {
        if (t.leaf_slots != 0u) trace_enter_next(t);
        else if (t.next == NONE) t.done = true;
    }
    t.done = t.done || t.left <= 0;
}

Hit trace_end(Traversal t) {
    trace_turns = TRACE_STEPS - uint(max(t.left, 0));
    Hit hit = t.hit;
    if (t.best != NONE) {
        hit.instance += floatBitsToUint(TRACE_TRIANGLES(3u * t.best + 1u).w);
        hit.triangle = floatBitsToUint(TRACE_TRIANGLES(3u * t.best + 2u).w);
    }
    return hit;
}

Hit trace(Ray ray, uint mask, uint salt, bool any) {
    Traversal t = trace_begin(ray, mask, salt);
    do {
        trace_step(t, any);
    } while (!t.done);
    return trace_end(t);
}

#endif
