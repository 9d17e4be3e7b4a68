// Radiance of the samples by direction, for glossy surfaces.
//
// The directions of a hemisphere, weighted by the cosine, are the points (x, y) of a unit disc, all with the same weight. So Zernike's polynomials are
// orthonormal functions of them (Koenderink, van Doorn and Stavridi, Bidirectional Reflection Distribution Function Expressed in Terms of Surface Scattering
// Modes, 1996). The first one is 1, and its coefficient is the irradiance over π. The five of first and second degree tell where the light comes from.
// Before including: lib/sampling.glsl, prt/prt.glsl.
#ifndef PRT_LOBE
#define PRT_LOBE

// The polynomials of first and second degree at a point of the disc.
float[PRT_LOBES] prt_zernike(vec2 at) {
    return float[PRT_LOBES](2.0 * at.x, 2.0 * at.y, 1.7320508 * (2.0 * dot(at, at) - 1.0), 4.8989795 * at.x * at.y,
                            2.4494897 * (at.x * at.x - at.y * at.y));
}

// Directions from which a glossy surface sends light to a viewer, taken as a lobe around a dominant direction.
struct PrtLobe {
    vec3 dominant;      // unit
    float cosine;       // mean cosine of the angle to `dominant`
    float square;       // mean of the square of this cosine
};

// The lobe of GGX microfacets whose normals have the density D cos θ: light turns by twice the angle of the facet.
// `n`: shading normal; `v`: to the viewer; `alpha`: width of GGX.
PrtLobe prt_lobe(vec3 n, vec3 v, float alpha) {
    PrtLobe lobe;
    // A rough surface reflects more from above than a mirror (Lagarde and de Rousiers, Moving Frostbite to Physically Based Rendering, 2014).
    vec3 way = mix(n, reflect(-v, n), (1.0 - alpha) * (sqrt(1.0 - alpha) + alpha));
    lobe.dominant = dot(way, way) > 1e-8 ? normalize(way) : n;
    // Means of c = cos²θ and of its square for the facets, in closed form, and where the forms lose their digits, by their series.
    float a2 = alpha * alpha, k = 1.0 - a2, log_a2 = log(a2);
    float c = 0.5 + k * (1.0 / 6.0 + k * (1.0 / 12.0 + k * (0.05 + k / 30.0)));
    float c2 = 1.0 / 3.0 + k * (1.0 / 6.0 + k * (0.1 + k * (1.0 / 15.0 + k / 21.0)));
    if (k > 0.2) {
        c = (1.0 - a2 + a2 * log_a2) / (k * k);
        c2 = (1.0 - a2 * a2 + 2.0 * a2 * log_a2) / (k * k * k);
    }
    lobe.cosine = 2.0 * c - 1.0;
    lobe.square = 4.0 * c2 - 4.0 * c + 1.0;
    return lobe;
}

// Mean of the radiance over a lobe. `mean`: irradiance over π; `normal`: of the sample; `terms`: its coefficients.
vec3 prt_radiance(PrtLobe lobe, vec3 normal, vec3 mean, vec3[PRT_LOBES] terms) {
    mat3 frame = frame_around(normal);
    vec2 at = vec2(dot(frame[0], lobe.dominant), dot(frame[1], lobe.dominant));
    // The mean of ω ωᵀ over a lobe is along · d dᵀ + even · 1.
    float along = 1.5 * lobe.square - 0.5, even = 0.5 - 0.5 * lobe.square;
    vec3 sum = mean + 2.0 * lobe.cosine * (at.x * terms[0] + at.y * terms[1]);
    sum += 1.7320508 * (2.0 * (along * dot(at, at) + 2.0 * even) - 1.0) * terms[2];
    sum += along * (4.8989795 * at.x * at.y * terms[3] + 2.4494897 * (at.x * at.x - at.y * at.y) * terms[4]);
    return max(sum, vec3(0.0));
}

#endif
