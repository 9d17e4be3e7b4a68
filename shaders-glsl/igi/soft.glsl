// Direct light of the sky and of emissive surfaces, and compensated light: kept apart from other light and without the surface's colour, so that a
// filter removes its noise and no detail of textures.
#ifndef LIB_IGI_SOFT
#define LIB_IGI_SOFT

const vec3 SOFT_LUMINANCE = vec3(0.2126, 0.7152, 0.0722);

// About the share of even light that the surface reflects; the light is divided by it, and multiplied again after the filter.
vec3 soft_color(vec3 albedo, vec3 f0) {
    return max(albedo + f0, vec3(0.02));
}

// Weight of sample j of `samples` in the difference between the first and the second half of the samples. Each half of the points is spread as
// evenly as all of them, so the difference shows the noise that such points leave. The spread of single samples would show that of independent
// points, which is far larger in smooth light.
float soft_side(uint j, uint samples) {
    uint half_of = samples / 2u;
    return j < half_of || half_of == 0u ? 1.0 : -float(half_of) / float(samples - half_of);
}

#endif
