// The rays that gather light at the samples. Before including: lib/random.glsl, lib/sampling.glsl, lib/points.glsl.
#ifndef PRT_RAY
#define PRT_RAY

// The direction of a ray of a sample in the frame around its normal, with the density of the cosine. Any power of two of a sample's first rays is well
// distributed.
vec3 prt_ray(uint sample_number, uint ray, uint seed) {
    PointPlace place = point_place(uvec2(sample_number & 0xffffu, sample_number >> 16u), ray, POINTS_APART, seed);
    return sample_cosine(unit_floats(point_words(place, 0u, seed)));
}

#endif
