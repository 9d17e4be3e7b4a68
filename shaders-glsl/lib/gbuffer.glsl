// Encodings of the G-buffer (passes::gbuffer). Attachments:
//   albedo   sRGB8 + A8   rgb: (1 - metallic) base colour, sampled linear; a: radiation mask (1 ordinary, 0 unlit,
//                       or the share that `isr.mask` gives to a material)
//   normal   RGBA8 world normal c * 2 - 1 (a = 0), or RG16 octahedral (a reads as 1)
//   depth    R32F eye distance / far; background exactly 1
//   specular RGBA8 rgb: reflectance at normal incidence F0; a: roughness
//   emission RGBA16F rgb: emitted radiance; a: accessibility from the occlusion texture
#ifndef LIB_GBUFFER
#define LIB_GBUFFER

const float BACKGROUND_DEPTH = 1.0; // export

// Whether a surface is unlit: it has neither colour nor reflectance. A radiation mask of 0 alone does not say so.
bool gbuffer_unlit(vec4 albedo, vec4 specular) {
    return albedo == vec4(0.0) && specular.rgb == vec3(0.0);
}

vec2 octahedral_encode(vec3 n) {
    vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    vec2 fold = (1.0 - abs(p.yx)) * vec2(p.x >= 0.0 ? 1.0 : -1.0, p.y >= 0.0 ? 1.0 : -1.0);
    return n.z >= 0.0 ? p : fold;
}

vec3 octahedral_decode(vec2 p) {
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    float t = max(-n.z, 0.0);
    n.xy += vec2(n.x >= 0.0 ? -t : t, n.y >= 0.0 ? -t : t);
    return normalize(n);
}

// What the G-buffer pass writes: octahedral for an RG16 target, else the dissertation's 8 bits a component.
vec4 encode_normal(vec3 n, bool octahedral) {
    return octahedral ? vec4(octahedral_encode(n) * 0.5 + 0.5, 0.0, 1.0) : vec4(n * 0.5 + 0.5, 0.0);
}

// Unit world normal of a texel of the normal image, in either encoding (told apart by alpha). Decode before averaging.
vec3 decode_normal(vec4 texel) {
    if (texel.a > 0.5) return octahedral_decode(texel.xy * 2.0 - 1.0);
    vec3 n = texel.xyz * 2.0 - 1.0;
    float len = length(n);
    return len > 1e-4 ? n / len : vec3(0.0, 0.0, 1.0);
}

#endif
