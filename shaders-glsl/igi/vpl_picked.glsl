// Irradiance from virtual lights that are picked from the light tree, with shadow rays. Before including: lib/random.glsl, lib/trace.glsl,
// lib/vpl.glsl, igi/vpl_tree.glsl with VPL_NODES_BINDING; and `vpls`, sorted like the leaves.
#ifndef LIB_VPL_PICKED
#define LIB_VPL_PICKED

// A surface that gathers.
struct Receiver {
    vec3 position; // metres
    vec3 normal;   // unit
    vec3 origin;   // of its shadow rays, metres
    float offset;  // of its stratified numbers, in [0, 1)
    uvec2 salt;    // seed of its random numbers
};

struct Picking {
    uint picks;     // maximum of shadow rays per receiver
    uint proposals; // virtual lights proposed for each pick
    uint leaves;    // of the light tree
    float least;    // min_d of the bounded geometry term, metres; 0: none
    uint seed;
};

// rgb: the part of the irradiance that the picks `first` to `first` + `count` - 1 contribute; a: number of shadow rays. For each pick one of
// the proposals is drawn in proportion to its unoccluded light, and represents all of them (Talbot, Cline and Egbert, Importance Resampling
// for Global Illumination, 2005).
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
            // The remainder of the number is uniformly distributed again.
            u = clamp(takes ? u / share : (u - share) / (1.0 - share), 0.0, 0.99999994);
            if (takes) {
                taken = k;
                light = sent;
                strength = weight;
            }
        }
        if (taken == VPL_NO_PICK) continue;
        // The stratified numbers grow from pick to pick, so equal picks follow each other and share a shadow ray.
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
