// Fragment stage of passes/gbuffer, with BEHIND of passes/gbuffer_behind, and with EYES of passes/gbuffer_eyes.
#include "lib/view.glsl"
#include "lib/pixel_depth.glsl"
#include "lib/scene.glsl"
#include "lib/material.glsl"
#include "lib/gbuffer.glsl"
#include "lib/random.glsl"

layout(constant_id = 0) const uint CUTOUT = 0; // 0: all opaque; 1: alpha below the cutoff is cut out; 2: dithered; 3: cut at 0.5
layout(constant_id = 1) const uint OCTAHEDRAL = 0; // 1: the normal attachment is RG16
layout(constant_id = 2) const uint SHARP = 0; // 1: textures at their finest level

#include "passes/gbuffer_view.glsl"
layout(binding = 1, scalar) readonly buffer Instances { Instance instances[]; };

layout(push_constant, scalar) uniform Push { uint seed; };

layout(location = 0) in vec3 normal_in;
layout(location = 1) in vec4 tangent_in;
layout(location = 2) in vec4 uv01;
layout(location = 3) in vec4 uv23;
layout(location = 4) in vec4 color_in;
layout(location = 5) in vec3 seen; // position in view space, metres
layout(location = 6) flat in uint instance_in;

layout(location = 0) out vec4 albedo_out;
layout(location = 1) out vec4 normal_out;
layout(location = 2) out float depth_out;
layout(location = 3) out vec4 specular_out;
layout(location = 4) out vec4 emission_out;

vec2 of_set(vec4 set01, vec4 set23, uint set) {
    vec4 pair = set < 2u ? set01 : set23;
    return (set & 1u) == 0u ? pair.xy : pair.zw;
}

#ifdef BEHIND
// Linear depth of the layer before, at the same extent. Fragments on it and before it are peeled off.
layout(binding = 8) uniform sampler2D nearer;
// Relative difference of depth that separates layers.
const float APART = 1e-4;
#endif

void main() {
    // Before any branch: derivatives need whole quads.
    vec4 dx01 = dFdx(uv01), dy01 = dFdy(uv01), dx23 = dFdx(uv23), dy23 = dFdy(uv23);
    float linear = pixel_depth(view, seen);

#ifdef BEHIND
    float before = texelFetch(nearer, ivec2(gl_FragCoord.xy), 0).r;
    if (before >= 1.0 || linear <= before * (1.0 + APART)) discard;
#endif
    uint m = instances[instance_in].material;
    uint flags = materials[m].flags;
    vec4 texels[5];
    for (uint slot = 0u; slot < 5u; ++slot) {
        texels[slot] = vec4(1.0);
        if (has_texture(flags, slot)) {
            TextureUse use = materials[m].textures[slot];
            float lod = SHARP != 0u ? 0.0 : texture_lod(use, of_set(dx01, dx23, use.uv_set), of_set(dy01, dy23, use.uv_set));
            texels[slot] = sample_texture(use, of_set(uv01, uv23, use.uv_set), lod);
        }
    }

    vec4 base = materials[m].base_color * texels[TEXTURE_BASE_COLOR] * color_in;
    if (CUTOUT == 1u && base.a < materials[m].alpha_cutoff) discard;
    if (CUTOUT == 2u) {
        uvec2 pixel = uvec2(gl_FragCoord.xy);
        // The instance in the seed: two panes behind each other hide independent shares.
        if (base.a < random_float(uvec4(pixel, instance_in, seed))) discard;
    }
    if (CUTOUT == 3u && base.a < 0.5) discard;

    // The pipeline's front face is that of unmirrored meshes.
    bool flipped = (instances[instance_in].flags & INSTANCE_FLIPPED) != 0u;
    bool front = gl_FrontFacing != flipped;
    vec3 n = normalize(normal_in);
    if (has_texture(flags, TEXTURE_NORMAL) && dot(tangent_in.xyz, tangent_in.xyz) > 0.0) {
        vec3 t = normalize(tangent_in.xyz);
        vec3 b = cross(n, t) * tangent_in.w;
        vec3 mapped = (texels[TEXTURE_NORMAL].xyz * 2.0 - 1.0) * vec3(vec2(materials[m].normal_scale), 1.0);
        n = normalize(mat3(t, b, n) * mapped);
    }
#ifdef BEHIND
    // Backs of solid bodies are there, and face away from the camera.
    if (!front && (flags & MATERIAL_DOUBLE_SIDED) != 0u) n = -n;
#else
    if (!front) n = -n;
#endif

    float metallic = clamp(materials[m].metallic * texels[TEXTURE_METALLIC_ROUGHNESS].b, 0.0, 1.0);
    float roughness = clamp(materials[m].roughness * texels[TEXTURE_METALLIC_ROUGHNESS].g, 0.0, 1.0);
    float ior = materials[m].ior;
    float dielectric = (ior - 1.0) * (ior - 1.0) / ((ior + 1.0) * (ior + 1.0));
    float access = 1.0 + materials[m].occlusion_strength * (texels[TEXTURE_OCCLUSION].r - 1.0);
    vec3 emissive = materials[m].emissive * texels[TEXTURE_EMISSIVE].rgb;

    float radiation = float(255u - (flags >> MATERIAL_RADIATION_SHIFT)) / 255.0;
    albedo_out = vec4((1.0 - metallic) * base.rgb, radiation);
    specular_out = vec4(mix(vec3(dielectric), base.rgb, metallic), roughness);
    if ((flags & MATERIAL_UNLIT) != 0u) {
        // Shown as it is: neither receives nor reflects.
        emissive = base.rgb;
        albedo_out = vec4(0.0);
        specular_out = vec4(0.0, 0.0, 0.0, 1.0);
        access = 1.0;
    }
    normal_out = encode_normal(n, OCTAHEDRAL != 0u);
    // Never the background's value.
    depth_out = min(linear, 0.99999994);
    emission_out = vec4(min(emissive, vec3(65504.0)), access);
}
