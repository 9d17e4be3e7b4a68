// Scattering at a surface: Lambert and GGX as lib/brdf.glsl has them for direct light, mirrors, and smooth glass.
// Before including: lib/sampling.glsl.
#ifndef LIB_BSDF
#define LIB_BSDF

struct Bsdf {
    vec3 normal;        // shading normal on the side of the viewer
    vec3 geometric;     // of the triangle, on the same side
    vec3 albedo;        // of the Lambert lobe
    vec3 f0;            // of the GGX lobe
    float alpha;        // of the GGX lobe: roughness²
    float glossy_share; // how often the GGX lobe is sampled; 0: there is none
    float rough;        // weight of Lambert + GGX: 0 for mirrors
    float glass;        // weight of the smooth dielectric
    float mirror;       // weight of the mirror
    vec3 tint;          // of what passes the dielectric, and reflectance of the mirror at normal incidence
    float eta;          // refractive index behind the surface over that on the viewer's side
    bool thin;          // a sheet with both interfaces: light goes straight on
};

float brightest(vec3 c) {
    return max(c.r, max(c.g, c.b));
}

vec3 schlick(vec3 f0, float cosine) {
    float m = clamp(1.0 - cosine, 0.0, 1.0);
    float m2 = m * m;
    return f0 + (1.0 - f0) * (m2 * m2 * m);
}

// The lobe of lib/brdf.glsl; its roughness has the same floor.
float ggx_alpha(float roughness) {
    float r = max(roughness, 0.045);
    return r * r;
}

// How often to sample the GGX lobe for a viewer at cosine nv. Never 0: at grazing angles everything shines.
float glossy_share(vec3 albedo, vec3 f0, float nv) {
    float matt = brightest(albedo);
    float shine = brightest(schlick(f0, nv));
    return matt > 0.0 ? clamp(shine / (matt + shine), 0.1, 0.9) : 1.0;
}

// Cosine of the viewer as brdf_specular_cosine takes it.
vec3 viewer_in_frame(mat3 frame, vec3 v) {
    vec3 local = v * frame;
    return normalize(vec3(local.xy, max(local.z, 1e-4)));
}

// Lambert + GGX times cosine for light from l, and the density per steradian with which bsdf_sample_rough chooses l.
vec3 bsdf_rough(Bsdf b, vec3 v, vec3 l, out float density) {
    density = 0.0;
    float nl = dot(b.normal, l);
    if (nl <= 0.0 || dot(b.geometric, l) <= 0.0) return vec3(0.0);
    vec3 value = b.albedo * (nl / SAMPLING_PI);
    density = (1.0 - b.glossy_share) * nl / SAMPLING_PI;
    if (b.glossy_share > 0.0) {
        float nv = max(dot(b.normal, v), 1e-4);
        vec3 h = normalize(v + l);
        float d = ggx_distribution(clamp(dot(b.normal, h), 0.0, 1.0), length(cross(b.normal, h)), b.alpha);
        float a2 = b.alpha * b.alpha;
        float smith = 0.5 / (nl * sqrt(nv * nv * (1.0 - a2) + a2) + nv * sqrt(nl * nl * (1.0 - a2) + a2));
        value += d * smith * nl * schlick(b.f0, clamp(dot(v, h), 0.0, 1.0));
        mat3 frame = frame_around(b.normal);
        vec3 from = viewer_in_frame(frame, v);
        vec3 local = normalize(from + l * frame);
        density += b.glossy_share * ggx_reflected_density(local, from, b.alpha);
    }
    return value;
}

// A direction for light by the lobes' densities. May point below the surface: bsdf_rough is zero there.
vec3 bsdf_sample_rough(Bsdf b, vec3 v, float choice, vec2 u) {
    mat3 frame = frame_around(b.normal);
    if (choice >= b.glossy_share) return frame * sample_cosine(u);
    vec3 from = viewer_in_frame(frame, v);
    vec3 h = sample_ggx_visible(u, from, b.alpha);
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
