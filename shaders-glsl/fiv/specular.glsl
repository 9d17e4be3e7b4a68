// Glossy reflection of an environment whose parts are lobes of light (techniques::fiv::specular). Twin:
// reference::fiv_specular.
#ifndef LIB_FIV_SPECULAR
#define LIB_FIV_SPECULAR

#include "lib/brdf.glsl"

// Edge of a cell of the environment, texels. Each sample stores for each cell the share of its light that an occluder
// hides.
const uint FIV_CELL = 4u; // export

// A part of the environment.
struct FivLobe {
    vec3 power;     // radiance × solid angle, W/m²
    float spread;   // widening by the size of the part: added to the square of the GGX width
    vec3 direction; // unit vector to its middle
    float least;    // least square of the width, so that equal neighbouring parts are reflected evenly
};

// Square of the GGX width alpha. The floor is that of lib/brdf.glsl.
float fiv_width2(float roughness) {
    float r = max(roughness, 0.045);
    return r * r * r * r;
}

// BRDF of the microfacets (lib/brdf.glsl) times the cosine, for a lobe of light around l. The distribution of normals
// is widened by the angle between the half vectors of this light, which is its spread. The widening grows with the
// angle between light and eye.
vec3 fiv_specular(vec3 n, vec3 v, vec3 l, vec3 f0, float a2, float spread, float least) {
    float nl = dot(n, l);
    if (nl <= 0.0) return vec3(0.0);
    float nv = max(dot(n, v), 1e-4);
    vec3 h = normalize(v + l);
    float nh = clamp(dot(n, h), 0.0, 1.0);
    float vh = clamp(dot(v, h), 0.0, 1.0);
    float across = max(vh, 0.1);
    float w2 = clamp(max(a2 + spread / (across * across), least / (across * across)), 0.0, 1.0);
    float d = nh * nh * (w2 - 1.0) + 1.0;
    float ggx = w2 / (3.14159265358979 * d * d);
    float smith = 0.5 / (nl * sqrt(nv * nv * (1.0 - a2) + a2) + nv * sqrt(nl * nl * (1.0 - a2) + a2));
    return ggx * smith * nl * brdf_schlick(f0, brdf_f90(f0), vh);
}

// The same for a texel of solid angle `angle`. The variance of a square is a twelfth of the square of its side, half
// vectors have a quarter of it, and the square of the width is twice the variance. The least width keeps constant
// radiance constant to 3 %: the sum of 1 / (θ² + w²)² over a grid of texels has ripples of x K₁(x), with x = 4π w for a
// side of one.
vec3 fiv_specular_texel(vec3 n, vec3 v, vec3 l, vec3 f0, float a2, float angle) {
    return fiv_specular(n, v, l, f0, a2, angle / 24.0, 0.25 * angle);
}

#endif
