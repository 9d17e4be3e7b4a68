// Surfaces as baked daylight sees them: a diffuse base with all reflected energy, mirrors and glass.
// Before including: lib/hit_surface.glsl, lib/material.glsl, lib/brdf.glsl, lib/bsdf.glsl.

struct DaySurface {
    vec3 position;
    vec3 side;       // geometric normal, unit, on the side of the ray
    vec3 normal;     // shading normal, unit, on the same side
    vec3 albedo;     // of the diffuse part
    vec3 tint;       // of mirrors and glass
    float mirror;    // shares of the light
    float glass;
    float eta;
    float gap;
    bool thin;
    bool unlit;
    bool front;      // of the triangle
    bool inside;     // the ray hits the back of a surface that has only one side
};

// The surface at a hit, seen along `toward` (unit). `smooth_only`: without the normal map.
DaySurface day_surface(uint instance, uint triangle, vec2 barycentrics, vec3 toward, bool diffuse_only, bool smooth_only) {
    DaySurface s;
    SurfacePoint point = surface_point(instance, triangle, barycentrics);
    uint material = INSTANCE_AT(instance).material;
    uint flags = MATERIAL_AT(material).flags;
    vec3 geometric = normalize(point.area);
    bool front = dot(geometric, toward) < 0.0;
    s.position = point.position;
    s.front = front;
    s.side = front ? geometric : -geometric;
    s.gap = surface_gap(point);
    s.thin = (flags & MATERIAL_DOUBLE_SIDED) != 0u;
    s.inside = !front && !s.thin;
    s.unlit = (flags & MATERIAL_UNLIT) != 0u;
    vec4 base = MATERIAL_AT(material).base_color * surface_color(instance, point);
    float metallic = MATERIAL_AT(material).metallic;
    float roughness = MATERIAL_AT(material).roughness;
    float transmission = MATERIAL_AT(material).transmission;
    vec3 normal = normalize(surface_normal(instance, point));
    for (uint slot = 0u; slot < TEXTURE_SLOTS; ++slot) {
        bool wanted = slot == TEXTURE_BASE_COLOR || slot == TEXTURE_METALLIC_ROUGHNESS || slot == TEXTURE_TRANSMISSION
            || (slot == TEXTURE_NORMAL && !smooth_only);
        if (!wanted || !has_texture(flags, slot)) continue;
        TextureUse use = MATERIAL_AT(material).textures[slot];
        vec4 texel = sample_texture(use, surface_uv(instance, point, use.uv_set), 0.0);
        if (slot == TEXTURE_BASE_COLOR) {
            base *= texel;
        } else if (slot == TEXTURE_METALLIC_ROUGHNESS) {
            metallic *= texel.b;
            roughness *= texel.g;
        } else if (slot == TEXTURE_TRANSMISSION) {
            transmission *= texel.r;
        } else {
            vec4 tangent = surface_tangent(instance, point);
            if (dot(tangent.xyz, tangent.xyz) > 0.0) {
                vec3 t = normalize(tangent.xyz);
                vec3 b = cross(normal, t) * tangent.w;
                vec3 mapped = (texel.xyz * 2.0 - 1.0) * vec3(vec2(MATERIAL_AT(material).normal_scale), 1.0);
                normal = normalize(mat3(t, b, normal) * mapped);
            }
        }
    }
    if (!front) normal = -normal;
    if (any(isnan(normal))) normal = s.side;
    s.normal = normal;
    metallic = clamp(metallic, 0.0, 1.0);
    roughness = clamp(roughness, 0.0, 1.0);
    s.tint = base.rgb;
    s.albedo = (1.0 - metallic) * base.rgb;
    float ior = MATERIAL_AT(material).ior;
    s.eta = front || s.thin ? ior : 1.0 / ior;
    s.glass = diffuse_only ? 0.0 : clamp(transmission, 0.0, 1.0);
    bool mirror = !diffuse_only && roughness < 0.05 && metallic > 0.5;
    s.mirror = mirror ? 1.0 - s.glass : 0.0;
    if (!diffuse_only && !mirror) {
        // Gloss is taken as diffuse: its energy stays, its direction is lost.
        float dielectric = (ior - 1.0) * (ior - 1.0) / ((ior + 1.0) * (ior + 1.0));
        vec3 f0 = mix(vec3(dielectric), base.rgb, metallic);
        float cosine = dot(normal, -toward);
        Brdf b = brdf_of(s.albedo, f0, roughness, clamp(cosine, 0.0, 1.0));
        s.albedo = min(b.matt + b.shine * brdf_below(b, cosine), vec3(1.0));
    }
    return s;
}
