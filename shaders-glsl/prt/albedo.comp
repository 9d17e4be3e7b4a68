// Albedos of samples by the present materials: of the diffuse base, and with GLOSS all reflected energy.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/material.glsl"
#include "lib/brdf.glsl"
#include "prt/prt.glsl"
#define SURFACE_BINDING 1
// The instances of a frame have no address, so all are read from bound buffers.
#define LIB_SCENE_AT
#define INSTANCE_AT(i) surface_instances[i]
#define INDEX_AT(i) surface_indices[i]
#define POSITION_AT(i) surface_positions[i]
#define NORMAL_AT(i) surface_normals[i]
#define TANGENT_AT(i) surface_tangents[i]
#define UV_AT(i) surface_uvs[i]
#define COLOR_AT(i) surface_colors[i]
#include "lib/hit_surface.glsl"

layout(local_size_x = 64) in;

layout(constant_id = 0) const uint GLOSS = 1u;

layout(binding = 8, scalar) readonly buffer Samples { PrtPoint samples[]; };
layout(binding = 9, scalar) writeonly buffer Albedos { vec3 albedos[]; };

layout(push_constant, scalar) uniform Push { uint count; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    PrtPoint s = samples[i];
    SurfacePoint point = surface_point(s.instance, s.triangle, s.barycentrics);
    uint flags = materials[s.material].flags;
    vec4 base = materials[s.material].base_color * surface_color(s.instance, point);
    float metallic = materials[s.material].metallic;
    float roughness = materials[s.material].roughness;
    if (has_texture(flags, TEXTURE_BASE_COLOR)) {
        TextureUse use = materials[s.material].textures[TEXTURE_BASE_COLOR];
        base *= sample_texture(use, surface_uv(s.instance, point, use.uv_set), 0.0);
    }
    if (has_texture(flags, TEXTURE_METALLIC_ROUGHNESS)) {
        TextureUse use = materials[s.material].textures[TEXTURE_METALLIC_ROUGHNESS];
        vec4 texel = sample_texture(use, surface_uv(s.instance, point, use.uv_set), 0.0);
        metallic *= texel.b;
        roughness *= texel.g;
    }
    metallic = clamp(metallic, 0.0, 1.0);
    vec3 albedo = (1.0 - metallic) * base.rgb;
    if (GLOSS != 0u) {
        float ior = materials[s.material].ior;
        float dielectric = (ior - 1.0) * (ior - 1.0) / ((ior + 1.0) * (ior + 1.0));
        // The mean cosine of diffuse light is 2/3.
        Brdf b = brdf_of(albedo, mix(vec3(dielectric), base.rgb, metallic), clamp(roughness, 0.0, 1.0), 0.6667);
        albedo = min(b.matt + b.shine, vec3(1.0));
    }
    if ((flags & MATERIAL_UNLIT) != 0u) albedo = vec3(0.0);
    albedos[i] = albedo;
}
