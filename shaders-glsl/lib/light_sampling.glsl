// Choice of lights for a place: suns by their power, and of everything that shines from somewhere in the scene (point and spot
// lights, emissive triangles) one by a tree of bounds that estimates what each half can send here, shadows aside (Conty
// Estevez and Kulla, Importance Sampling of Many Lights with Adaptive Tree Splitting, 2018).
// Before including: lib/random.glsl, lib/sampling.glsl, lib/scene.glsl, and define LIGHT_COLUMNS_BINDING, LIGHT_TARGETS_BINDING,
// INSTANCE_LIGHTS_BINDING and LIGHT_NODES_BINDING.
#ifndef LIB_LIGHT_SAMPLING
#define LIB_LIGHT_SAMPLING

// LightTarget.instance of what is no triangle.
const uint TARGET_PUNCTUAL = 0xfffffffeu; // export
// Levels of the tree at most: turns to the second half are bits of a number.
const uint LIGHT_LEVELS = 31u; // export
// LightTarget.trail of lights that are not in the tree.
const uint TRAIL_NONE = 0xffffffffu; // export
// A half that can send anything is taken at least so often: what the estimate takes for weak may be all that is not in shadow.
const float LIGHT_LEAST_SHARE = 1e-3;
// Least cosines in the estimate, so that rounding makes nothing impossible that shines.
const float LIGHT_LEAST_COSINE = 1e-3;

struct LightTarget {
    uint instance; // of the emissive triangle, or TARGET_PUNCTUAL
    uint index;    // triangle within the instance, or number of the punctual light
    uint trail;    // way to it through the tree: bit k is set where it goes to the second half at level k
};

// Bounds of some lights. A node that is no leaf has its first half right behind it.
struct LightNode {
    vec3 low;          // box around them, metres
    float power;       // what they send along their axis, summed: W/sr
    vec3 high;
    float reach;       // nothing arrives beyond this distance from the box, metres
    vec3 axis;         // unit
    float cos_spread;  // their own axes lie within this angle of `axis`
    float cos_edge;    // how far from its own axis a light shines
    uint two_sided;    // 1: also the other way
    uint second;       // number of the second half; NONE: a leaf
    uint light;        // of a leaf: number in light_targets
};

layout(binding = LIGHT_COLUMNS_BINDING, scalar) readonly buffer LightColumns { AliasEntry light_columns[]; };
layout(binding = LIGHT_TARGETS_BINDING, scalar) readonly buffer LightTargets { LightTarget light_targets[]; };
// Number of the light that is the first triangle of each instance; NONE where nothing emits.
layout(binding = INSTANCE_LIGHTS_BINDING, scalar) readonly buffer InstanceLights { uint instance_lights[]; };
layout(binding = LIGHT_NODES_BINDING, scalar) readonly buffer LightNodes { LightNode light_nodes[]; };
// By address (lib/scene_at.glsl) where LIGHT_NODES_AT and LIGHT_TARGETS_AT have it.
#ifdef LIGHT_NODES_AT
#include "lib/scene_at.glsl"
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LightNodesAt { LightNode of[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LightTargetsAt { LightTarget of[]; };
#define LIGHT_NODE(i) LightNodesAt(LIGHT_NODES_AT).of[i]
#define LIGHT_TARGET(i) LightTargetsAt(LIGHT_TARGETS_AT).of[i]
#else
#define LIGHT_NODE(i) light_nodes[i]
#define LIGHT_TARGET(i) light_targets[i]
#endif

// Number of a sun, and how probable it was.
uint pick_sun(uint count, uint bits, float keep, out float probability) {
    uint index = pick_below(bits, count);
    AliasEntry column = light_columns[index];
    if (keep >= column.keep) index = column.other;
    probability = light_columns[index].probability;
    return index;
}

// Cosine of the angle a − b, 1 if a is the smaller; of (sine, cosine) pairs of angles up to 180 degrees.
vec2 angle_less(vec2 a, vec2 b) {
    if (a.y >= b.y) return vec2(0.0, 1.0);
    return vec2(a.x * b.y - a.y * b.x, a.y * b.y + a.x * b.x);
}

vec2 with_sine(float cosine) {
    return vec2(sqrt(max(1.0 - cosine * cosine, 0.0)), cosine);
}

// Upper estimate of what a node's lights send to a surface at `point` whose front looks along the unit vector `normal`.
float light_estimate(LightNode node, vec3 point, vec3 normal) {
    vec3 way = 0.5 * (node.low + node.high) - point;
    vec3 extent = 0.5 * (node.high - node.low);
    vec3 outside = max(abs(way) - extent, vec3(0.0));
    if (dot(outside, outside) > node.reach * node.reach) return 0.0;
    float distance2 = dot(way, way);
    float radius2 = dot(extent, extent);
    float near2 = max(max(distance2, radius2), 1e-8);
    if (distance2 <= radius2 || distance2 == 0.0) return node.power / near2;
    // Half the angle under which the box is seen, at most.
    vec2 width = with_sine(sqrt(1.0 - radius2 / distance2));
    vec3 to = way * inversesqrt(distance2);
    float along = -dot(node.axis, to);
    if (node.two_sided != 0u) along = abs(along);
    vec2 off_axis = angle_less(angle_less(with_sine(clamp(along, -1.0, 1.0)), with_sine(node.cos_spread)), width);
    float sends = off_axis.y > node.cos_edge ? off_axis.y : 0.0;
    float takes = angle_less(with_sine(clamp(dot(normal, to), -1.0, 1.0)), width).y;
    return node.power * max(sends, LIGHT_LEAST_COSINE) * max(takes, LIGHT_LEAST_COSINE) / near2;
}

// How often to go to the first half of a node.
float light_first_share(uint first, uint second, vec3 point, vec3 normal) {
    // In a loop so that compilers keep one copy of the code.
    float estimates[2] = float[2](0.0, 0.0);
    uint halves[2] = uint[2](first, second);
    for (uint i = 0u; i < 2u; ++i) estimates[i] = light_estimate(LIGHT_NODE(halves[i]), point, normal);
    float sum = estimates[0] + estimates[1];
    if (!(sum > 0.0)) return 0.5;
    if (estimates[0] == 0.0 || estimates[1] == 0.0) return estimates[0] == 0.0 ? 0.0 : 1.0;
    return clamp(estimates[0] / sum, LIGHT_LEAST_SHARE, 1.0 - LIGHT_LEAST_SHARE);
}

// A choice takes its share out of a number in [0, 1), so long as the number has enough bits for it. This many choices of one half are left in it.
const float LIGHT_SPENT = 1.0 / 256.0;

// Number of a light of the tree for a surface, and how probable it was. `u`: a number in [0, 1) that chooses; a number in [0, 1) that is
// independent of the choice comes back. `seed`: two words that are not used otherwise.
uint pick_light(vec3 point, vec3 normal, inout float u, uvec2 seed, out float probability) {
    uint node = 0u;
    probability = 1.0;
    float left = 1.0;
    for (uint level = 0u; level < LIGHT_LEVELS; ++level) {
        uint second = LIGHT_NODE(node).second;
        if (second == NONE) break;
        float share = light_first_share(node + 1u, second, point, normal);
        bool first = u < share;
        float taken = first ? share : 1.0 - share;
        probability *= taken;
        left *= taken;
        u = min((first ? u : u - share) / taken, 0.99999994);
        // A well-distributed number chooses a well-distributed number of times. Its last bits would not.
        if (left < LIGHT_SPENT) {
            u = unit_float(pcg4d(uvec4(seed, level, 0x51ab17u)).x);
            left = 1.0;
        }
        node = first ? node + 1u : second;
    }
    return LIGHT_NODE(node).light;
}

// How probable pick_light is to give a light for a surface.
float light_choice(uint number, vec3 point, vec3 normal) {
    uint trail = LIGHT_TARGET(number).trail;
    if (trail == TRAIL_NONE) return 0.0;
    float probability = 1.0;
    uint node = 0u;
    for (uint level = 0u; level < LIGHT_LEVELS; ++level) {
        uint second = LIGHT_NODE(node).second;
        if (second == NONE) break;
        float share = light_first_share(node + 1u, second, point, normal);
        bool first = (trail >> level & 1u) == 0u;
        probability *= first ? share : 1.0 - share;
        node = first ? node + 1u : second;
    }
    return probability;
}

// The same for a triangle; 0 if it is no light.
float triangle_choice(uint instance, uint triangle, vec3 point, vec3 normal) {
    uint first = instance_lights[instance];
    return first == NONE ? 0.0 : light_choice(first + triangle, point, normal);
}

#endif
