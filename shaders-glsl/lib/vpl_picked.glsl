// Irradiance from virtual lights picked from their tree, with shadow rays. Before including: lib/random.glsl, lib/trace.glsl, lib/vpl.glsl,
// lib/vpl_tree.glsl with VPL_NODES_BINDING; and `vpls`, in the order of the leaves.
#ifndef LIB_VPL_PICKED
#define LIB_VPL_PICKED

// A surface that gathers.
struct Receiver {
    vec3 position; // metres
    vec3 normal;   // unit
    vec3 origin;   // of its shadow rays, metres
    float offset;  // of the numbers of its picks, in [0, 1)
    uvec2 salt;    // of its random numbers
};

struct Picking {
    uint picks;     // shadow rays of a receiver at most
    uint proposals; // virtual lights from which each is taken, by what they send if nothing is in the way
    uint leaves;    // of the tree
    float least;    // min_d of the bounded geometry term, metres; 0: none
    uint seed;
};

// rgb: share of `count` of the picks from `first` on in the irradiance; a: rays traced. Of each pick's proposals one is taken in
// proportion to what it sends, and stands for all of them (Talbot, Cline and Egbert, Importance Resampling for Global Illumination, 2005).
vec4 vpl_picked(Receiver at, Picking how, uint first, uint count) {
    vec4 sum = vec4(0.0);
    uint last = VPL_NO_PICK;
    bool hidden = false;
    float all = float(how.picks * how.proposals);
    for (uint i = first; i < first + count; ++i) {
        uint taken = VPL_NO_PICK;
        vec3 light = vec3(0.0);
        float strength = 0.0, strengths = 0.0;
        float u = float(pcg4d(uvec4(at.salt, i, how.seed ^ 0x91c5u)).x >> 8u) * (1.0 / 16777216.0);
        for (uint j = 0u; j < how.proposals; ++j) {
            float probability;
            float number = min((float(i * how.proposals + j) + at.offset) / all, 0.99999994);
            uint k = vpl_pick(number, at.position, at.normal, how.least, how.leaves, probability);
            if (k == VPL_NO_PICK) continue;
            vec3 sent = vpl_irradiance(vpls[k], at.position, at.normal, how.least) / (probability * all);
            float weight = dot(sent, vec3(1.0));
            if (weight <= 0.0) continue;
            strengths += weight;
            float share = weight / strengths;
            bool takes = u < share;
            // What is left of the number is as even as it was.
            u = clamp(takes ? u / share : (u - share) / (1.0 - share), 0.0, 0.99999994);
            if (takes) {
                taken = k;
                light = sent;
                strength = weight;
            }
        }
        if (taken == VPL_NO_PICK) continue;
        // Picks run through the tree from left to right: equal ones follow each other.
        if (taken != last) {
            last = taken;
            vec3 to = vpls[taken].position + vpls[taken].normal * vpls[taken].gap - at.origin;
            hidden = trace_any(Ray(at.origin, 0.0, to, 0.99999), TRACE_SHADOW, pcg4d(uvec4(at.salt, taken, how.seed)).x);
            sum.a += 1.0;
        }
        if (!hidden) sum.rgb += light * (strengths / strength);
    }
    return sum;
}

#endif
