// Reflection of direct light: Lambert and GGX (glTF metallic-roughness).

const float BRDF_PI = 3.14159265358979;

// Specular BRDF times cos θ_l: GGX distribution, height-correlated Smith visibility, Schlick's Fresnel. `roughness` is
// perceptual; below 0.045 the highlight of a point light would fall between pixels.
vec3 brdf_specular_cosine(vec3 n, vec3 v, vec3 l, vec3 f0, float roughness) {
    float nl = dot(n, l);
    float nv = max(dot(n, v), 1e-4);
    if (nl <= 0.0) {
        return vec3(0.0);
    }
    vec3 h = normalize(v + l);
    float nh = clamp(dot(n, h), 0.0, 1.0);
    float vh = clamp(dot(v, h), 0.0, 1.0);
    float alpha = max(roughness, 0.045);
    alpha *= alpha;
    float a2 = alpha * alpha;
    float d = nh * nh * (a2 - 1.0) + 1.0;
    float ggx = a2 / (BRDF_PI * d * d);
    float smith = 0.5 / (nl * sqrt(nv * nv * (1.0 - a2) + a2) + nv * sqrt(nl * nl * (1.0 - a2) + a2));
    vec3 fresnel = f0 + (1.0 - f0) * pow(1.0 - vh, 5.0);
    return ggx * smith * nl * fresnel;
}
