// The share of the baked light that a pixel reflects to its viewer.
#ifndef DAYLIGHT_REFLECT
#define DAYLIGHT_REFLECT

#include "lib/brdf.glsl"

// Surfaces without gloss; metals are diffuse surfaces of their colour.
const uint REFLECT_COLOR = 0u; // export
// Surfaces with their gloss.
const uint REFLECT_GLOSS = 1u; // export
// The diffuse parts of surfaces, as along the paths of a bake with `diffuse_only`: metals are black.
const uint REFLECT_DIFFUSE = 2u; // export

// Shares of light from everywhere alike that a pixel reflects to its viewer.
struct DayShares {
    vec3 matt;   // without a direction: Lambert's law, and light between microfacets
    vec3 shine;  // by microfacets at once
};

// `reflects`: REFLECT_; `albedo` and `specular`: of the G-buffer; `cosine`: of the viewer. As along the paths of the bake (daylight/surface.glsl).
DayShares day_shares(vec4 albedo, vec4 specular, float cosine, uint reflects) {
    if (reflects == REFLECT_DIFFUSE) return DayShares(albedo.a * albedo.rgb, vec3(0.0));
    if (reflects == REFLECT_COLOR) return DayShares(albedo.a * (albedo.rgb + max(specular.rgb - 0.04, 0.0)), vec3(0.0));
    Brdf b = brdf_of(albedo.rgb, specular.rgb, specular.a, clamp(cosine, 0.0, 1.0));
    return DayShares(albedo.a * b.matt, albedo.a * min(b.shine * brdf_below(b, cosine), max(1.0 - b.matt, vec3(0.0))));
}

// The lobe of light that GGX microfacets of this width (alpha) reflect to a viewer at the normal, relative to its mean: bands 1 and 2 of its zonal harmonics. They are
// those of the cosine for alpha 1, and those of a mirror for 0. Within 0.014 and 0.026 of the integrals (techniques::daylight::probes::harmonics).
vec2 day_lobe(float alpha) {
    return 1.0 - alpha * (vec2(0.602, 1.512) - alpha * (vec2(0.602, 1.512) - vec2(1.0 / 3.0, 0.75)));
}

// The middle of the light that gloss reflects: between the mirrored direction of the viewer and the normal (Lagarde and de Rousiers, Moving Frostbite to
// Physically Based Rendering, 2014, section 4.9.3). `n`, `v`: normal and direction to the viewer, unit.
vec3 day_lobe_axis(vec3 n, vec3 v, float alpha) {
    vec3 mirrored = reflect(-v, n);
    float smooth_share = (1.0 - alpha) * (sqrt(1.0 - alpha) + alpha);
    return normalize(mix(n, mirrored, smooth_share));
}

#endif
