// A tree over the virtual lights of a frame, and picks from it in proportion to what they may send to a point: stochastic lightcuts
// (Yuksel, Stochastic Lightcuts, 2019) with a perfectly balanced tree over sorted lights (Lin and Yuksel, Real-Time Stochastic
// Lightcuts, 2020) and the bounds of Conty Estevez and Kulla (Importance Sampling of Many Lights with Adaptive Tree Splitting, 2018).
// Before including: lib/vpl.glsl; define VPL_NODES_BINDING for vpl_pick.
#ifndef LIB_VPL_TREE
#define LIB_VPL_TREE

// Virtual lights that a tree has room for.
const uint VPL_TREE_MOST = 16384u; // export
// A half that may send anything is taken at least so often: what the estimate takes for weak may be all that is not in shadow.
const float VPL_LEAST_SHARE = 0.01;

// Cosine below which light along a surface does not count.
const float VPL_FLAT = 1e-4;

// Bounds of some virtual lights. Node 1 is the root, below node i are 2 i and 2 i + 1; with 2^n leaves these are 2^n and on.
struct VplNode {
    vec3 low;         // box around them, metres
    float flux;       // of all channels, summed, W; 0: nothing shines here
    vec3 high;
    float cos_spread; // their normals lie within this angle of `axis`
    vec3 axis;        // unit
    uint lights;      // how many
};

// (sine, cosine) of an angle up to 180 degrees.
vec2 vpl_angle(float cosine) {
    return vec2(sqrt(max(1.0 - cosine * cosine, 0.0)), cosine);
}

// a − b, 0 if a is the smaller.
vec2 vpl_angle_less(vec2 a, vec2 b) {
    if (a.y >= b.y) return vec2(0.0, 1.0);
    return vec2(a.x * b.y - a.y * b.x, a.y * b.y + a.x * b.x);
}

// Estimate of what a node's lights send to a surface at `point` with unit normal `normal`, shadows aside, but for a factor. 0 only
// where they send nothing, or so flat along the surface that it does not count. Of a single light it is exact.
float vpl_estimate(VplNode node, vec3 point, vec3 normal, float least) {
    vec3 way = 0.5 * (node.low + node.high) - point;
    vec3 extent = 0.5 * (node.high - node.low);
    float height = dot(normal, way) + dot(abs(normal), extent);
    vec3 corner = abs(way) + extent;
    float farthest2 = dot(corner, corner);
    // All behind the surface (its normal is rounded: its own plane must count as such), or so near that the bound takes it.
    if (node.flux <= 0.0 || height <= VPL_FLAT * sqrt(farthest2) || farthest2 <= 0.64 * least * least) return 0.0;
    float distance2 = dot(way, way);
    float radius2 = dot(extent, extent);
    float cosines = min(height * inversesqrt(radius2), 1.0);
    if (distance2 > radius2) {
        // Half the angle under which the box is seen, at most.
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

// How often to go to the first of two halves; below 0: neither sends anything.
float vpl_first_share(float first, float second) {
    float sum = first + second;
    if (!(sum > 0.0)) return -1.0;
    if (first == 0.0 || second == 0.0) return first == 0.0 ? 0.0 : 1.0;
    return clamp(first / sum, VPL_LEAST_SHARE, 1.0 - VPL_LEAST_SHARE);
}

#ifdef VPL_NODES_BINDING
// Three vectors a node: CPU drivers load a vector as fast as a number.
layout(binding = VPL_NODES_BINDING, scalar) readonly buffer VplNodes { vec4 vpl_nodes[]; };

const uint VPL_NO_PICK = 0xffffffffu;

// Number of a virtual light for a surface by a number u in [0, 1), and how probable it was. VPL_NO_PICK: none of those on the way
// sends anything.
uint vpl_pick(float u, vec3 point, vec3 normal, float least, uint leaves, out float probability) {
    uint node = 1u;
    probability = 1.0;
    while (node < leaves) {
        // In a loop so that compilers keep one copy of the code.
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
        // What is left of the number is as even as it was.
        u = first ? u / share : (u - share) / (1.0 - share);
        u = clamp(u, 0.0, 0.99999994);
        probability *= first ? share : 1.0 - share;
        node = 2u * node + (first ? 0u : 1u);
    }
    return node - leaves;
}

// Where the numbers of a pixel's picks start: those of a tile of pixels lie evenly between each other, and each pixel's own are
// anywhere in [0, 1) over the seeds. Neighbouring tiles keep apart (Roberts' R2).
float vpl_offset(uvec2 tile, uint subset, uint subsets, uint seed) {
    float turn = float(pcg4d(uvec4(seed, 0x9e3u, 0x51u, 0x7c1u)).x >> 8u) * (1.0 / 16777216.0);
    // In whole numbers of 2^-32: far pixels keep their precision.
    uint place = tile.x * 3242174889u + tile.y * 2447445414u;
    float even = float(place >> 8u) * (1.0 / 16777216.0);
    return fract(even + turn + float(subset) / float(subsets));
}
#endif

#endif
