// Emission of triangles. Before including: lib/hit_surface.glsl, lib/material.glsl.
#ifndef LIB_EMISSION
#define LIB_EMISSION

// Radiance, W/(sr·m²), that an emissive triangle emits at a point, from its front side or, if double-sided, from both sides. Multiplied by
// the coverage that alpha gives.
vec3 triangle_radiance(uint instance, SurfacePoint point, uint two) {
    uint m = surface_instances[instance].material;
    uint flags = materials[m].flags;
    vec4 texels[2];
    for (uint i = 0u; i < two; ++i) {
        uint slot = i == 0u ? TEXTURE_BASE_COLOR : TEXTURE_EMISSIVE;
        texels[i] = vec4(1.0);
        if (!has_texture(flags, slot)) continue;
        TextureUse use = materials[m].textures[slot];
        texels[i] = sample_texture(use, surface_uv(instance, point, use.uv_set), 0.0);
    }
    float alpha = materials[m].base_color.a * texels[0].a * surface_color(instance, point).a;
    float covers = (flags & MATERIAL_MASK) != 0u ? float(alpha >= materials[m].alpha_cutoff)
        : (flags & MATERIAL_BLEND) != 0u ? clamp(alpha, 0.0, 1.0) : 1.0;
    return materials[m].emissive * texels[1].rgb * covers;
}

#endif
