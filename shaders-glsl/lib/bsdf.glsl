// Scattering at a surface: the matt base under microfacets of lib/brdf.glsl, mirrors, and smooth glass.
#ifndef LIB_BSDF
#define LIB_BSDF

#include "lib/brdf.glsl"

struct Bsdf {
    vec3 normal;        // shading normal on the side of the viewer
    vec3 geometric;     // of the triangle, on the same side
    Brdf brdf;          // for this viewer
    float glossy_share; // how often visible normals of GGX are sampled instead of the cosine; 0: there are none
    float rough;        // weight of base and microfacets: 0 for mirrors
    float glass;        // weight of the smooth dielectric
    float mirror;       // weight of the mirror
    vec3 tint;          // of what passes the dielectric, and reflectance of the mirror at normal incidence
    float eta;          // refractive index behind the surface over that on the viewer's side
    bool thin;          // a sheet with both interfaces: light goes straight on
};

float brightest(vec3 c) {
    return max(c.r, max(c.g, c.b));
}

// Of mirrors.
vec3 schlick(vec3 f0, float cosine) {
    return brdf_schlick(f0, 1.0, cosine);
}

// How often to sample visible normals. Neither never nor always: light has every direction by either lobe.
float glossy_share(Brdf b) {
    float matt = brightest(b.matt);
    float shine = brightest(b.shine);
    return b.f90 > 0.0 ? clamp(shine / max(matt + shine, 1e-6), 0.1, 0.95) : 0.0;
}

// Cosine of the viewer as brdf_of takes it.
vec3 viewer_in_frame(mat3 frame, vec3 v) {
    vec3 local = v * frame;
    return normalize(vec3(local.xy, max(local.z, 1e-4)));
}

// BRDF times cosine for light from l, and the density per steradian with which bsdf_sample_rough chooses l.
vec3 bsdf_rough(Bsdf b, vec3 v, vec3 l, out float density) {
    density = 0.0;
    float nl = dot(b.normal, l);
    if (nl <= 0.0 || dot(b.geometric, l) <= 0.0) return vec3(0.0);
    density = (1.0 - b.glossy_share) * nl / SAMPLING_PI;
    if (b.glossy_share > 0.0) {
        mat3 frame = frame_around(b.normal);
        vec3 from = viewer_in_frame(frame, v);
        vec3 local = normalize(from + l * frame);
        density += b.glossy_share * ggx_reflected_density(local, from, b.brdf.alpha);
    }
    return brdf_cosine(b.brdf, b.normal, v, l);
}

// A direction for light by the lobes' densities. May point below the surface: bsdf_rough is zero there.
vec3 bsdf_sample_rough(Bsdf b, vec3 v, float choice, vec2 u) {
    mat3 frame = frame_around(b.normal);
    if (choice >= b.glossy_share) return frame * sample_cosine(u);
    vec3 from = viewer_in_frame(frame, v);
    vec3 h = sample_ggx_visible(u, from, b.brdf.alpha);
    return frame * reflect(-from, h);
}

// Reflectance of a smooth interface for unpolarised light; cosine on the viewer's side, eta: index behind over index before.
float fresnel_dielectric(float cosine, float eta) {
    float sine2 = (1.0 - cosine * cosine) / (eta * eta);
    if (sine2 >= 1.0) return 1.0;
    float through = sqrt(1.0 - sine2);
    float s = (cosine - eta * through) / (cosine + eta * through);
    float p = (eta * cosine - through) / (eta * cosine + through);
    return 0.5 * (s * s + p * p);
}

// Of a sheet with two parallel interfaces that absorbs nothing: F + (1-F)² F + (1-F)² F³ + …
float fresnel_sheet(float f) {
    return 2.0 * f / (1.0 + f);
}

#endif
