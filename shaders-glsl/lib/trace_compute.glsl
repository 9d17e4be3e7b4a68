// Tracing by a compute traversal of two levels: a top tree over instances, below each a bottom tree over triangles that
// instances of the same shape share (built by lucerna::rays).
#ifndef LIB_TRACE_COMPUTE
#define LIB_TRACE_COMPUTE

// A bottom tree where it stands.
struct TraceInstance {
    vec4 object_from_world[3]; // rows
    uint first_instance;       // added to the instances of the records
    uint root;                 // reference
    float reach;               // no coordinate in the tree is larger
};

// References to children: with TRACE_LEAF, a leaf: in the top tree the number of an instance, in a bottom tree count - 1 in
// bits 28 to 30 and the first record. Without: the number of a node.
const uint TRACE_LEAF = 0x80000000u; // export
const uint TRACE_COUNT_SHIFT = 28u; // export
const uint TRACE_FIRST_MASK = 0x0fffffffu; // export
// On the stack: back to the top tree. No reference has this value.
const uint TRACE_UP = 0x7fffffffu;

// Nodes a ray passes from the root to a leaf, both trees together, are at most this; lucerna::rays keeps to it.
const uint TRACE_DEPTH = 64u; // export
// Steps of one ray, including triangles; a ray that needs more ends with what it has. CPU drivers stop loops at 65,535.
const uint TRACE_STEPS = 30000u; // export

// A node is four vectors: lower corner and reference of its first child, upper corner, then the second child's.
layout(binding = 40, scalar) readonly buffer TraceNodes { vec4 trace_nodes[]; };
// A record is three vectors: corners in xyz; in w the bits of instance, triangle, surface (TRACE_SINGLE_SIDED …).
layout(binding = 41, scalar) readonly buffer TraceTriangles { vec4 trace_triangles[]; };
// The first is the top tree itself, in world space.
layout(binding = 42, scalar) readonly buffer TraceInstances { TraceInstance trace_instances[]; };

// A ray as the boxes of one tree see it.
struct TraceSlabs {
    vec3 inverse;
    vec3 near; // t = corner * inverse - near, less than exact
    vec3 far;  // t = corner * inverse - far, more than exact
};

TraceSlabs trace_slabs(vec3 origin, vec3 direction, float reach) {
    // No component is zero then, and no product below infinite.
    float tiny = 1e-20 * max(abs(direction.x), max(abs(direction.y), abs(direction.z)));
    vec3 d = mix(max(direction, vec3(tiny)), min(direction, vec3(-tiny)), lessThan(direction, vec3(0.0)));
    TraceSlabs slabs;
    slabs.inverse = 1.0 / d;
    // Boxes are grown by more than what the triangle test rounds, so that no box hides what that test hits.
    float size = max(reach, max(abs(origin.x), max(abs(origin.y), abs(origin.z))));
    vec3 pad = abs(slabs.inverse) * (size * 1e-6);
    slabs.near = origin * slabs.inverse + pad;
    slabs.far = origin * slabs.inverse - pad;
    return slabs;
}

// Where the ray enters a box; TRACE_MISS if it does not between t_min and t_max.
const float TRACE_MISS = 3.4e38;

float trace_box(vec3 low, vec3 high, TraceSlabs slabs, float t_min, float t_max) {
    bvec3 backward = lessThan(slabs.inverse, vec3(0.0));
    vec3 enter = mix(low, high, backward) * slabs.inverse - slabs.near;
    vec3 leave = mix(high, low, backward) * slabs.inverse - slabs.far;
    float near = max(max(enter.x, enter.y), max(enter.z, t_min));
    float far = min(min(leave.x, leave.y), min(leave.z, t_max));
    return near <= far ? near : TRACE_MISS;
}

Hit trace(Ray ray, uint mask, uint salt, bool any) {
    Hit hit = Hit(ray.t_max, vec2(0.0), NONE, NONE);
    uint stack[TRACE_DEPTH];
    uint height = 0u;
    vec3 origin = ray.origin;
    TraceSlabs world = trace_slabs(origin, ray.direction, trace_instances[0].reach);
    TraceSlabs slabs = world;
    TraceShear shear;
    uint first_instance = 0u;
    bool inside = false;
    uint item = trace_instances[0].root;
    for (uint left = TRACE_STEPS; left > 0u; --left) {
        bool pop = true;
        if (item == TRACE_UP) {
            inside = false;
            slabs = world;
        } else if ((item & TRACE_LEAF) == 0u) {
            vec4 a = trace_nodes[4u * item], b = trace_nodes[4u * item + 1u];
            vec4 c = trace_nodes[4u * item + 2u], d = trace_nodes[4u * item + 3u];
            float first = trace_box(a.xyz, b.xyz, slabs, ray.t_min, hit.t);
            float second = trace_box(c.xyz, d.xyz, slabs, ray.t_min, hit.t);
            uint near = floatBitsToUint(a.w), far = floatBitsToUint(c.w);
            if (second < first) {
                uint swapped = near;
                near = far;
                far = swapped;
            }
            if (max(first, second) < TRACE_MISS) {
                stack[height++] = far;
            }
            if (min(first, second) < TRACE_MISS) {
                item = near;
                pop = false;
            }
        } else if (!inside) {
            TraceInstance instance = trace_instances[item & TRACE_FIRST_MASK];
            vec4 x = instance.object_from_world[0], y = instance.object_from_world[1], z = instance.object_from_world[2];
            origin = vec3(dot(x.xyz, ray.origin) + x.w, dot(y.xyz, ray.origin) + y.w, dot(z.xyz, ray.origin) + z.w);
            vec3 direction = vec3(dot(x.xyz, ray.direction), dot(y.xyz, ray.direction), dot(z.xyz, ray.direction));
            slabs = trace_slabs(origin, direction, instance.reach);
            shear = trace_shear(direction);
            first_instance = instance.first_instance;
            inside = true;
            stack[height++] = TRACE_UP;
            item = instance.root;
            pop = false;
        } else {
            uint count = (item >> TRACE_COUNT_SHIFT & 7u) + 1u;
            uint record = item & TRACE_FIRST_MASK;
            for (uint i = 0u; i < count; ++i) {
                left -= uint(left > 1u);
                uint r = 3u * (record + i);
                vec4 a = trace_triangles[r], b = trace_triangles[r + 1u], c = trace_triangles[r + 2u];
                vec3 at;
                float side = trace_triangle(a.xyz, b.xyz, c.xyz, origin, shear, at);
                uint instance = first_instance + floatBitsToUint(a.w);
                uint triangle = floatBitsToUint(b.w), surface = floatBitsToUint(c.w);
                // Of equals the first instance's first triangle, whatever the order of the tree.
                bool earlier = instance < hit.instance || (instance == hit.instance && triangle < hit.triangle);
                bool nearer = at.x < hit.t || (at.x == hit.t && hit.instance != NONE && earlier);
                if (at.x >= ray.t_min && nearer && trace_counts(surface, side, mask)
                    && ((surface & TRACE_CUTOUT) == 0u || trace_covered(instance, triangle, at.yz, salt))) {
                    hit = Hit(at.x, at.yz, instance, triangle);
                }
            }
            if (any && hit.instance != NONE) break;
        }
        if (pop) {
            if (height == 0u) break;
            item = stack[--height];
        }
    }
    return hit;
}

// The nearest hit. `salt` decides where blended surfaces are there.
Hit trace_closest(Ray ray, uint mask, uint salt) {
    return trace(ray, mask, salt, false);
}

// Whether anything lies in the ray's segment.
bool trace_any(Ray ray, uint mask, uint salt) {
    return trace(ray, mask, salt, true).instance != NONE;
}

#endif
