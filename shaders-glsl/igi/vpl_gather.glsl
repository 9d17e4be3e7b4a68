// Irradiance from a range of the virtual lights of a subset. Before including: lib/random.glsl, lib/trace.glsl, lib/vpl.glsl,
// igi/vpl_subset.glsl, and `vpls`.
#ifndef LIB_VPL_GATHER
#define LIB_VPL_GATHER

struct Gathering {
    uint first;     // index of the first light within the subset
    uint count;
    uint total;     // virtual lights
    uint subset;
    uint subsets;
    uint stride;    // step of the irregular pattern (vpl_of_subset); 0: regular pattern
    float least;    // min_d of the bounded geometry term, metres; 0: none
    uint seed;
};

// Adds irradiance to rgb, multiplied by the number of subsets so that it estimates the sum over all virtual lights, and the number of
// shadow rays to a. `origin`: origin of the shadow rays, a step off the surface, metres.
void vpl_gather(inout vec4 sum, vec3 position, vec3 normal, vec3 origin, uvec2 pixel, Gathering how) {
    for (uint i = how.first; i < how.first + how.count; ++i) {
        uint k = vpl_of_subset(i, how.subset, how.subsets, how.stride);
        if (k >= how.total) break;
        Vpl vpl = vpls[k];
        vec3 light = vpl_irradiance(vpl, position, normal, how.least) * float(how.subsets);
        if (light == vec3(0.0)) continue;
        vec3 to = vpl.position + vpl.normal * vpl.gap - origin;
        bool hidden = trace_any(Ray(origin, 0.0, to, 0.99999), TRACE_SHADOW, pcg4d(uvec4(pixel, k, how.seed)).x);
        sum += vec4(hidden ? vec3(0.0) : light, 1.0); // L V G of [IGI 1]
    }
}

#endif
