// Glossy reflection of an environment whose parts are lobes of light (techniques::fiv::specular). Twin: reference::fiv_specular.
#ifndef LIB_FIV_SPECULAR
#define LIB_FIV_SPECULAR

#include "lib/brdf.glsl"

// Edge of a cell of the environment, texels. A sample says of each cell how much of its light an occluder hides.
const uint FIV_CELL = 4u; // export

// A part of the environment.
struct FivLobe {
    vec3 power;     // radiance × solid angle, W/m²
    float spread;   // how much wider its width makes what reflects it: added to the square of the GGX width
    vec3 direction; // unit vector to its middle
    float least;    // what that square is at least, so that even light of its neighbours is reflected evenly
};

// Square of the GGX width alpha. The floor is that of lib/brdf.glsl.
float fiv_width2(float roughness) {
    float r = max(roughness, 0.045);
    return r * r * r * r;
}

// What microfacets send on at once (lib/brdf.glsl), times the cosine of the light, for light from around l: the distribution of normals is as much
// wider as the half vectors of that light are apart, which is its spread, and more where they see each other at an angle.
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

// As well for a texel of solid angle `angle`: a square has a twelfth of its side's square as variance, half vectors a quarter of that,
// and the square of the width is twice the variance. The least keeps even light even to 3 %: the sum over a grid of texels of
// 1 / (θ² + w²)² has ripples of x K₁(x), with x = 4π w for a side of one.
vec3 fiv_specular_texel(vec3 n, vec3 v, vec3 l, vec3 f0, float a2, float angle) {
    return fiv_specular(n, v, l, f0, a2, angle / 24.0, 0.25 * angle);
}

#endif
