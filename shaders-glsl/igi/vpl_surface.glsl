// The textured surface at a ray's hit. Before including: lib/hit_surface.glsl, lib/trace.glsl, lib/sampling.glsl.
#ifndef LIB_VPL_SURFACE
#define LIB_VPL_SURFACE
#include "lib/emission.glsl"

struct HitSurface {
    vec3 position;
    float gap;       // step off the surface, larger than its rounding error, metres
    vec3 side;       // geometric normal, unit, towards the ray's origin
    vec3 normal;     // shading normal on the same side
    vec3 albedo;
    vec3 f0;
    float roughness;
    vec3 emission;   // radiance towards the ray's origin, W/(sr·m²); the colour of an unlit surface
    bool unlit;
    float rough;     // probabilities that sum to 1: Lambert and GGX, smooth dielectric, mirror
    float glass;
    float mirror;
    vec3 tint;       // transmittance of the dielectric, or reflectance of the mirror at normal incidence
    float eta;       // ratio of the refractive indices behind and in front of the surface
    bool thin;       // a thin sheet, with both interfaces at the hit
};

HitSurface hit_surface(Hit hit, vec3 toward, uint slots, bool diffuse_only) {
    HitSurface s;
    SurfacePoint point = surface_point(hit.instance, hit.triangle, hit.barycentrics);
    vec4 color = surface_color(hit.instance, point);
    uint m = surface_instances[hit.instance].material;
    uint flags = materials[m].flags;
    vec4 texels[TEXTURE_SLOTS];
    for (uint i = 0u; i < slots; ++i) {
        texels[i] = vec4(1.0);
        if (!has_texture(flags, i)) continue;
        TextureUse use = materials[m].textures[i];
        texels[i] = sample_texture(use, surface_uv(hit.instance, point, use.uv_set), 0.0);
    }
    vec3 geometric = normalize(point.area);
    bool front = dot(geometric, toward) < 0.0;
    s.position = point.position;
    s.gap = surface_gap(point);
    s.side = front ? geometric : -geometric;
    vec4 base = materials[m].base_color * texels[TEXTURE_BASE_COLOR] * color;
    vec3 normal = normalize(surface_normal(hit.instance, point));
    if (has_texture(flags, TEXTURE_NORMAL)) {
        vec4 tangent = surface_tangent(hit.instance, point);
        if (dot(tangent.xyz, tangent.xyz) > 0.0) {
            vec3 t = normalize(tangent.xyz);
            vec3 b = cross(normal, t) * tangent.w;
            vec3 mapped = (texels[TEXTURE_NORMAL].xyz * 2.0 - 1.0) * vec3(vec2(materials[m].normal_scale), 1.0);
            normal = normalize(mat3(t, b, normal) * mapped);
        }
    }
    if (!front) normal = -normal;
    s.unlit = (flags & MATERIAL_UNLIT) != 0u;
    float metallic = clamp(materials[m].metallic * texels[TEXTURE_METALLIC_ROUGHNESS].b, 0.0, 1.0);
    s.roughness = clamp(materials[m].roughness * texels[TEXTURE_METALLIC_ROUGHNESS].g, 0.0, 1.0);
    s.normal = any(isnan(normal)) ? s.side : normal;
    if (!diffuse_only && metallic > 0.5) s.normal = mirroring_normal(s.normal, s.side, -toward);
    float ior = materials[m].ior;
    float dielectric = (ior - 1.0) * (ior - 1.0) / ((ior + 1.0) * (ior + 1.0));
    s.albedo = s.unlit ? vec3(0.0) : (1.0 - metallic) * base.rgb;
    s.f0 = mix(vec3(dielectric), base.rgb, metallic);
    bool shines = front || (flags & MATERIAL_DOUBLE_SIDED) != 0u;
    s.emission = s.unlit ? base.rgb : shines ? materials[m].emissive * texels[TEXTURE_EMISSIVE].rgb : vec3(0.0);
    bool sharp = !diffuse_only && !s.unlit;
    float transmission = sharp ? clamp(materials[m].transmission * texels[TEXTURE_TRANSMISSION].r, 0.0, 1.0) : 0.0;
    bool mirror = sharp && s.roughness < 0.05 && metallic > 0.5;
    s.glass = transmission;
    s.mirror = mirror ? 1.0 - transmission : 0.0;
    s.rough = mirror ? 0.0 : 1.0 - transmission;
    s.tint = base.rgb;
    s.thin = (flags & MATERIAL_DOUBLE_SIDED) != 0u;
    s.eta = front || s.thin ? ior : 1.0 / ior;
    return s;
}

#endif
