// Albedo of a surface for light from everywhere, by the present materials. Before including: lib/hit_surface.glsl, lib/material.glsl, lib/brdf.glsl.

// `gloss`: all reflected energy, else that of the diffuse base.
vec3 surface_reflectance(uint instance, SurfacePoint point, uint material, bool gloss) {
    uint flags = materials[material].flags;
    vec4 base = materials[material].base_color * surface_color(instance, point);
    float metallic = materials[material].metallic;
    float roughness = materials[material].roughness;
    if (has_texture(flags, TEXTURE_BASE_COLOR)) {
        TextureUse use = materials[material].textures[TEXTURE_BASE_COLOR];
        base *= sample_texture(use, surface_uv(instance, point, use.uv_set), 0.0);
    }
    if (has_texture(flags, TEXTURE_METALLIC_ROUGHNESS)) {
        TextureUse use = materials[material].textures[TEXTURE_METALLIC_ROUGHNESS];
        vec4 texel = sample_texture(use, surface_uv(instance, point, use.uv_set), 0.0);
        metallic *= texel.b;
        roughness *= texel.g;
    }
    metallic = clamp(metallic, 0.0, 1.0);
    vec3 albedo = (1.0 - metallic) * base.rgb;
    if (gloss) {
        float ior = materials[material].ior;
        float dielectric = (ior - 1.0) * (ior - 1.0) / ((ior + 1.0) * (ior + 1.0));
        // The mean cosine of diffuse light is 2/3.
        Brdf b = brdf_of(albedo, mix(vec3(dielectric), base.rgb, metallic), clamp(roughness, 0.0, 1.0), 0.6667);
        albedo = min(b.matt + b.shine, vec3(1.0));
    }
    if ((flags & MATERIAL_UNLIT) != 0u) albedo = vec3(0.0);
    return albedo;
}
