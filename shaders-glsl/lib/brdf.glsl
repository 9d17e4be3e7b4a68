// Reflection of surfaces (glTF metallic-roughness): a matt base under a layer of GGX microfacets. Twin: reference::brdf.
//
// The layer reflects the share E(μ) of light at cosine μ: what its microfacets send on at once (Fresnel f0 to f90, by Schlick), and what
// they send to each other first (Kulla and Conty, Revisiting Physically Based Shading at Imageworks, 2017). The base has the rest:
// ρ/π (1 - E(μ_o)) (1 - E(μ_i)) / (1 - E_avg) (Kelemen and Szirmay-Kalos 2001). So white stays white, and light and viewer may change
// places. Light that was gathered from all around without its directions sees Lambert's law with the albedo ρ instead.
#ifndef LIB_BRDF
#define LIB_BRDF

#include "lib/sampling.glsl"

const float BRDF_PI = 3.14159265358979;

// A surface for one viewer: what does not depend on the light.
struct Brdf {
    vec3 f0;          // reflectance at normal incidence
    float f90;        // at grazing; 0: there is no layer, all is Lambert's law
    float alpha;      // GGX width: roughness²
    float nv;         // cosine of the viewer
    vec3 base;        // ρ (1 - E(nv)) / (1 - E_avg)
    vec3 multiple;    // of light between microfacets: F (1 - E₁(nv)) / (1 - E₁_avg)
    vec3 open_lost;   // 1 - E = 1 - f0 + open_lost (1 - E₁) + open_graze B
    vec3 open_graze;
    float bend;
    float lost[7];    // polynomials for this roughness: of (1 - E₁) / (x (1 - x)) in x,
    float graze[8];   // and of 1 - (B / E₁)^(1/5) in √(μ² + bend²)
    vec3 shine;       // share of light from everywhere alike that microfacets send to the viewer at once
    vec3 matt;        // and the share by the other ways
};

// Below 0.045 the highlight of a point light would fall between pixels.
float brdf_alpha(float roughness) {
    float r = max(roughness, 0.045);
    return r * r;
}

// Nothing that reflects less than 2 % at normal incidence exists but for indices near 1, where grazing reflection goes as well
// (Lagarde and de Rousiers, Moving Frostbite to Physically Based Rendering, 2014).
float brdf_f90(vec3 f0) {
    return clamp(50.0 * max(f0.r, max(f0.g, f0.b)), 0.0, 1.0);
}

vec3 brdf_schlick(vec3 f0, float f90, float cosine) {
    float m = clamp(1.0 - cosine, 0.0, 1.0);
    float m2 = m * m;
    return f0 + (f90 - f0) * (m2 * m2 * m);
}

// 1 - E₁: the share of light at cosine c that leaves no facet of reflectance 1 upwards at once. Fitted to 0.2 % from 0.06 on, as is
// brdf_graze to 0.3 %; reference::brdf has the integrals.
float brdf_lost(Brdf b, float c) {
    float w = 0.7 * b.alpha;
    c = max(c, 0.01);
    float y = 1.0 / (c + w);
    float x = c * y;
    float p = b.lost[6];
    p = p * x + b.lost[5];
    p = p * x + b.lost[4];
    p = p * x + b.lost[3];
    p = p * x + b.lost[2];
    p = p * x + b.lost[1];
    p = p * x + b.lost[0];
    return clamp(x * (w * y) * p, 0.0, 1.0);
}

// B: the part of E₁ that Schlick's fifth power leaves, for light at cosine c with brdf_lost(c).
float brdf_graze(Brdf b, float c, float lost) {
    c = max(c, 0.01);
    float q = sqrt(c * c + b.bend * b.bend);
    float p = b.graze[7];
    p = p * q + b.graze[6];
    p = p * q + b.graze[5];
    p = p * q + b.graze[4];
    p = p * q + b.graze[3];
    p = p * q + b.graze[2];
    p = p * q + b.graze[1];
    p = p * q + b.graze[0];
    float m = clamp(1.0 - p, 0.0, 1.0);
    float m2 = m * m;
    return (1.0 - lost) * (m2 * m2 * m);
}

// 1 - E: what the layer leaves to the base.
vec3 brdf_open(Brdf b, float lost, float graze) {
    return max(1.0 - b.f0 + b.open_lost * lost + b.open_graze * graze, vec3(0.0));
}

// nv: cosine between shading normal and viewer; taken as 1e-4 at least.
Brdf brdf_of(vec3 albedo, vec3 f0, float roughness, float nv) {
    Brdf b;
    b.f0 = f0;
    b.f90 = brdf_f90(f0);
    b.alpha = brdf_alpha(roughness);
    b.nv = max(nv, 1e-4);
    b.base = albedo;
    b.multiple = vec3(0.0);
    b.open_lost = vec3(0.0);
    b.open_graze = vec3(0.0);
    b.bend = 0.0;
    b.lost = float[7](0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    b.graze = float[8](0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    b.shine = vec3(0.0);
    b.matt = albedo;
    if (b.f90 <= 0.0) return b;
    float a = b.alpha;
    float r = max(roughness, 0.045);
    b.bend = 2.0 * a / (1.0 + 3.5 * a);
    b.lost[0] = 0.409827 + a * (-0.142153 + a * (6.945744 + a * (-12.9091 + a * (17.379619 + a * (-11.229288 + a * 2.709242)))));
    b.lost[1] = -5.593009 + a * (-4.519838 + a * (0.559714 + a * (0.908676 + a * (-12.954087 + a * 6.843697))));
    b.lost[2] = 47.439318 + a * (10.93719 + a * (-7.497 + a * (39.004864 + a * (-12.041552))));
    b.lost[3] = -170.936419 + a * (4.800189 + a * (-29.862884 + a * (-16.598324)));
    b.lost[4] = 310.215818 + a * (-21.111957 + a * 40.771942);
    b.lost[5] = -273.438613 + a * 9.47037;
    b.lost[6] = 92.032195;
    b.graze[0] = -0.003461 + r * (0.114778 + r * (-0.625336 + r * (13.980493 + r * (13.428452 + r * (-92.839605 + r * (102.766635 + r * (-29.80176)))))));
    b.graze[1] = 0.988659 + r * (-1.560179 + r * (-25.647618 + r * (-166.842302 + r * (299.701318 + r * (-230.100769 + r * 19.001909)))));
    b.graze[2] = 0.978732 + r * (34.274535 + r * (304.821822 + r * (110.147453 + r * (-53.386304 + r * 156.867769))));
    b.graze[3] = -13.623753 + r * (-264.067197 + r * (-781.30978 + r * (-170.199178 + r * (-185.509776))));
    b.graze[4] = 75.621232 + r * (720.167618 + r * (922.139412 + r * 232.727714));
    b.graze[5] = -182.69096 + r * (-835.347741 + r * (-445.215403));
    b.graze[6] = 196.318908 + r * 352.47638;
    b.graze[7] = -76.959364;
    float lost_mean = a * (0.233537 + r * (-1.555373 + r * (6.749253 + r * (-1.199048 + r * (-16.765131 + r * (20.564504 + r * (-7.43971)))))));
    float graze_mean = 0.046601 + r * (0.048822 + r * (-0.443438 + r * (0.587848 + r * (-0.236867))));
    // Between facets light meets the mean of the Fresnel term, again and again.
    vec3 mean = f0 + (b.f90 - f0) / 21.0;
    vec3 again = mean * mean * (1.0 - lost_mean) / (1.0 - mean * lost_mean);
    b.open_lost = f0 - again;
    b.open_graze = f0 - b.f90;
    float lost = brdf_lost(b, b.nv);
    float graze = brdf_graze(b, b.nv, lost);
    vec3 open = brdf_open(b, lost, graze);
    b.base = albedo * open / max(brdf_open(b, lost_mean, graze_mean), vec3(1e-4));
    b.multiple = again * (lost / max(lost_mean, 1e-4));
    b.shine = f0 * (1.0 - lost - graze) + b.f90 * graze;
    b.matt = albedo * open + again * lost;
    return b;
}

// What microfacets send on at once, times cos θ_l: GGX distribution, height-correlated Smith visibility, Schlick's Fresnel term.
vec3 brdf_specular_cosine(Brdf b, vec3 n, vec3 v, vec3 l) {
    float nl = dot(n, l);
    if (nl <= 0.0 || b.f90 <= 0.0) return vec3(0.0);
    vec3 h = normalize(v + l);
    // No facet faces downwards. The viewer is below the horizon of a shading normal that leans away from it.
    float nh = dot(n, h);
    if (nh <= 0.0) return vec3(0.0);
    float ggx = ggx_distribution(min(nh, 1.0), length(cross(n, h)), b.alpha);
    float a2 = b.alpha * b.alpha;
    float smith = 0.5 / (nl * sqrt(b.nv * b.nv * (1.0 - a2) + a2) + b.nv * sqrt(nl * nl * (1.0 - a2) + a2));
    return ggx * smith * nl * brdf_schlick(b.f0, b.f90, clamp(dot(v, h), 0.0, 1.0));
}

// All of it, times cos θ_l.
vec3 brdf_cosine(Brdf b, vec3 n, vec3 v, vec3 l) {
    float nl = dot(n, l);
    if (nl <= 0.0) return vec3(0.0);
    if (b.f90 <= 0.0) return b.base * (nl / BRDF_PI);
    float lost = brdf_lost(b, nl);
    float graze = brdf_graze(b, nl, lost);
    vec3 matt = b.base * brdf_open(b, lost, graze) + b.multiple * lost;
    return matt * (nl / BRDF_PI) + brdf_specular_cosine(b, n, v, l);
}

// The part of `shine` that is left for a viewer below the horizon of the shading normal (`cosine` < 0), from where few facets are seen. Within 0.08 of the integrals
// of brdf_specular_cosine for dielectrics.
float brdf_below(Brdf b, float cosine) {
    float t = max(-cosine, 0.0) * min(1.1 / b.alpha - 0.5, 1.0 / b.alpha);
    return 1.0 / (1.0 + t * (1.0 + 1.1 * t));
}

#endif
