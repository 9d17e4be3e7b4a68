// The share of the baked light that a pixel reflects to its viewer.
#ifndef DAYLIGHT_REFLECT
#define DAYLIGHT_REFLECT

#include "lib/brdf.glsl"

// The directions of the baked light are not known, so gloss reflects the share that it reflects of light from everywhere alike, as along the paths of the
// bake (daylight/surface.glsl). Without gloss metals are diffuse surfaces of their colour. `albedo` and `specular`: of the G-buffer; `cosine`: of the
// viewer.
vec3 day_reflectance(vec4 albedo, vec4 specular, float cosine, bool gloss) {
    if (!gloss) return albedo.a * (albedo.rgb + max(specular.rgb - 0.04, 0.0));
    Brdf b = brdf_of(albedo.rgb, specular.rgb, specular.a, clamp(cosine, 0.0, 1.0));
    return albedo.a * min(b.matt + b.shine, vec3(1.0));
}

#endif
