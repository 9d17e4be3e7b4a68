// The light tree: a binary tree over the virtual lights of a frame, from which a receiver picks lights in proportion to an estimate of the
// light that they send to it. The method is stochastic lightcuts (Yuksel, Stochastic Lightcuts, 2019) with a perfectly balanced tree over
// sorted lights (Lin and Yuksel, Real-Time Stochastic Lightcuts, 2020) and the bounds of Conty Estevez and Kulla (Importance Sampling of
// Many Lights with Adaptive Tree Splitting, 2018).
// Before including: lib/vpl.glsl; define VPL_NODES_BINDING for vpl_pick.
#ifndef LIB_VPL_TREE
#define LIB_VPL_TREE

// Maximum of virtual lights in a tree.
const uint VPL_TREE_MOST = 16384u; // export
// Minimum probability of a child that may send light. The estimate ignores shadows: the child that looks weak may be the only one that is
// not occluded.
const float VPL_LEAST_SHARE = 0.01;

// Light that arrives at a smaller cosine is neglected.
const float VPL_FLAT = 1e-4;

// Bounds of the virtual lights below a node. Node 1 is the root; the children of node i are nodes 2 i and 2 i + 1. With 2^n leaves, leaf k
// is node 2^n + k.
struct VplNode {
    vec3 low;         // corner of the lights' bounding box, metres
    float flux;       // sum over lights and colour channels, W; 0: the node sends no light
    vec3 high;        // opposite corner, metres
    float cos_spread; // cosine of the cone around `axis` that contains all normals
    vec3 axis;        // unit
    uint lights;      // number of lights
};

// (sine, cosine) of an angle between 0 and 180 degrees.
vec2 vpl_angle(float cosine) {
    return vec2(sqrt(max(1.0 - cosine * cosine, 0.0)), cosine);
}

// a − b, 0 if a is the smaller.
vec2 vpl_angle_less(vec2 a, vec2 b) {
    if (a.y >= b.y) return vec2(0.0, 1.0);
    return vec2(a.x * b.y - a.y * b.x, a.y * b.y + a.x * b.x);
}

// Estimate, up to a constant factor, of the unoccluded light that a node's lights send to a surface at `point` with unit normal `normal`.
// It is 0 only if the lights send no light, or only at grazing angles below VPL_FLAT. For a single light it is exact.
float vpl_estimate(VplNode node, vec3 point, vec3 normal, float least) {
    vec3 way = 0.5 * (node.low + node.high) - point;
    vec3 extent = 0.5 * (node.high - node.low);
    float height = dot(normal, way) + dot(abs(normal), extent);
    vec3 corner = abs(way) + extent;
    float farthest2 = dot(corner, corner);
    // All lights are behind the surface, or so near that the bound removes their light. The tolerance lets a rounded normal count lights in
    // the surface's own plane as behind.
    if (node.flux <= 0.0 || height <= VPL_FLAT * sqrt(farthest2) || farthest2 <= 0.64 * least * least) return 0.0;
    float distance2 = dot(way, way);
    float radius2 = dot(extent, extent);
    float cosines = min(height * inversesqrt(radius2), 1.0);
    if (distance2 > radius2) {
        // Upper bound of half the angle that the box subtends.
        vec2 width = vpl_angle(sqrt(1.0 - radius2 / distance2));
        vec3 to = way * inversesqrt(distance2);
        vec2 off_axis = vpl_angle(clamp(-dot(node.axis, to), -1.0, 1.0));
        float sends = vpl_angle_less(vpl_angle_less(off_axis, vpl_angle(node.cos_spread)), width).y;
        float takes = vpl_angle_less(vpl_angle(clamp(dot(normal, to), -1.0, 1.0)), width).y;
        cosines = max(sends, 0.0) * max(takes, 0.0);
    }
    float bounded = radius2 > 0.0 ? 1.0 : vpl_bound(least, sqrt(distance2));
    return node.flux * cosines * bounded / max(max(distance2, 0.25 * radius2), 0.64 * least * least);
}

// Probability of the first of two children; negative: neither sends light.
float vpl_first_share(float first, float second) {
    float sum = first + second;
    if (!(sum > 0.0)) return -1.0;
    if (first == 0.0 || second == 0.0) return first == 0.0 ? 0.0 : 1.0;
    return clamp(first / sum, VPL_LEAST_SHARE, 1.0 - VPL_LEAST_SHARE);
}

#ifdef VPL_NODES_BINDING
// Each node is three vectors, because CPU drivers load a vector as fast as a scalar.
layout(binding = VPL_NODES_BINDING, scalar) readonly buffer VplNodes { vec4 vpl_nodes[]; };

const uint VPL_NO_PICK = 0xffffffffu;

// Picks a virtual light for a surface with a random number u in [0, 1). Returns its index and `probability`. VPL_NO_PICK: the descent
// reached a node whose children send no light.
uint vpl_pick(float u, vec3 point, vec3 normal, float least, uint leaves, out float probability) {
    uint node = 1u;
    probability = 1.0;
    while (node < leaves) {
        // A loop, so that the compiler keeps one copy of the inlined code.
        float estimates[2] = float[2](0.0, 0.0);
        for (uint i = 0u; i < 2u; ++i) {
            uint at = 3u * (2u * node + i);
            vec4 a = vpl_nodes[at], b = vpl_nodes[at + 1u], c = vpl_nodes[at + 2u];
            estimates[i] = vpl_estimate(VplNode(a.xyz, a.w, b.xyz, b.w, c.xyz, 0u), point, normal, least);
        }
        float share = vpl_first_share(estimates[0], estimates[1]);
        if (share < 0.0) {
            probability = 0.0;
            return VPL_NO_PICK;
        }
        bool first = u < share;
        // The remainder of the number is uniformly distributed again.
        u = first ? u / share : (u - share) / (1.0 - share);
        u = clamp(u, 0.0, 0.99999994);
        probability *= first ? share : 1.0 - share;
        node = 2u * node + (first ? 0u : 1u);
    }
    return node - leaves;
}

// Offset of the stratified numbers of a pixel's picks, in [0, 1). The numbers of a tile's pixels interleave evenly, and over the seeds each
// pixel's offset is uniform. The R2 sequence (Roberts) spreads the offsets of neighbouring tiles.
float vpl_offset(uvec2 tile, uint subset, uint subsets, uint seed) {
    float turn = float(pcg4d(uvec4(seed, 0x9e3u, 0x51u, 0x7c1u)).x >> 8u) * (1.0 / 16777216.0);
    // Fixed-point arithmetic in units of 2^-32 keeps the precision for large tile coordinates.
    uint place = tile.x * 3242174889u + tile.y * 2447445414u;
    float even = float(place >> 8u) * (1.0 / 16777216.0);
    return fract(even + turn + float(subset) / float(subsets));
}
#endif

#endif
