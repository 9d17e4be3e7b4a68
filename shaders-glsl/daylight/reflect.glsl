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

// `reflects`: REFLECT_. The directions of the baked light are not known, so gloss reflects the share that it reflects of light from everywhere alike, as along the paths of the
// bake (daylight/surface.glsl). `albedo` and `specular`: of the G-buffer; `cosine`: of the viewer.
vec3 day_reflectance(vec4 albedo, vec4 specular, float cosine, uint reflects) {
    if (reflects == REFLECT_DIFFUSE) return albedo.a * albedo.rgb;
    if (reflects == REFLECT_COLOR) return albedo.a * (albedo.rgb + max(specular.rgb - 0.04, 0.0));
    Brdf b = brdf_of(albedo.rgb, specular.rgb, specular.a, clamp(cosine, 0.0, 1.0));
    return albedo.a * min(b.matt + b.shine, vec3(1.0));
}

#endif
