// A texture slot of material 0 at given places.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/material.glsl"
layout(local_size_x = 64) in;
struct TextureProbe { vec2 uv; uint slot; float lod; vec4 texel; };
layout(binding = 0, scalar) buffer Probes { TextureProbe probes[]; };
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= probes.length()) return;
    probes[i].texel = sample_texture(materials[0].textures[probes[i].slot], probes[i].uv, probes[i].lod);
}
