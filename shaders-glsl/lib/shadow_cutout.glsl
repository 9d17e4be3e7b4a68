// The fragment of casters whose alpha cuts holes. Before including: a buffer `instances`, and push constants with a `seed`.
#ifndef LIB_SHADOW_CUTOUT
#define LIB_SHADOW_CUTOUT
#include "lib/material.glsl"
#include "lib/random.glsl"

layout(location = 0) in vec2 uv;
layout(location = 1) in float alpha_in;
layout(location = 2) flat in uint instance_in;

void main() {
    vec2 dx = dFdx(uv), dy = dFdy(uv);
    uint m = instances[instance_in].material;
    float alpha = alpha_in * materials[m].base_color.a;
    if (has_texture(materials[m].flags, TEXTURE_BASE_COLOR)) {
        TextureUse use = materials[m].textures[TEXTURE_BASE_COLOR];
        alpha *= sample_texture(use, uv, texture_lod(use, dx, dy)).a;
    }
    // Blended surfaces stop a share of the light: the same dither as in the G-buffer, fixed to the texels of the map.
    bool blended = (materials[m].flags & MATERIAL_BLEND) != 0u;
    float cutoff = blended ? random_float(uvec4(uvec2(gl_FragCoord.xy), instance_in, seed)) : materials[m].alpha_cutoff;
    if (alpha < cutoff) discard;
}

#endif
