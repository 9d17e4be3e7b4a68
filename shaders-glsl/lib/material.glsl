// Materials and their textures. Textures live in array images, one for each size and encoding, so that every stage may
// pick any texture by number (no bindless, no dynamically indexed samplers needed).
// Before including: #define TEXTURES_BINDING and #define MATERIALS_BINDING, or take the defaults.
#ifndef LIB_MATERIAL
#define LIB_MATERIAL

#ifndef MATERIALS_BINDING
#define MATERIALS_BINDING 30
#endif
#ifndef TEXTURES_BINDING
#define TEXTURES_BINDING 31
#endif

const uint MAX_TEXTURE_ARRAYS = 8u; // export
const uint NO_TEXTURE = 0xffu; // export

const uint MATERIAL_UNLIT = 1u; // export
const uint MATERIAL_DOUBLE_SIDED = 2u; // export
const uint MATERIAL_MASK = 4u; // export
const uint MATERIAL_BLEND = 8u; // export
const uint MATERIAL_FIRST_TEXTURE = 8u; // export
const uint MATERIAL_RADIATION_SHIFT = 24u; // export
// Bits from the first texture on: which slots of Material.textures are used. Bits from the shift of radiation on: 255 minus the radiation mask
// in 255ths, so 0 is the ordinary mask of 1.

// Bits of TextureUse.mode.
const uint SAMPLER_CLAMP_U = 1u; // export
const uint SAMPLER_MIRROR_U = 2u; // export
const uint SAMPLER_CLAMP_V = 4u; // export
const uint SAMPLER_MIRROR_V = 8u; // export
const uint SAMPLER_MAG_NEAREST = 16u; // export
const uint SAMPLER_MIN_NEAREST = 32u; // export
const uint SAMPLER_MIP_NONE = 64u; // export
const uint SAMPLER_MIP_NEAREST = 128u; // export

// Slots of Material.textures.
const uint TEXTURE_BASE_COLOR = 0u; // export
const uint TEXTURE_METALLIC_ROUGHNESS = 1u; // export
const uint TEXTURE_NORMAL = 2u; // export
const uint TEXTURE_OCCLUSION = 3u; // export
const uint TEXTURE_EMISSIVE = 4u; // export
const uint TEXTURE_TRANSMISSION = 5u; // export
const uint TEXTURE_SLOTS = 6u; // export

struct TextureUse {
    uint array;      // which of scene_textures; NO_TEXTURE: none
    uint layer;
    uint uv_set;
    uint mode;       // SAMPLER_ bits
    vec2 size;       // texels of mip 0
    vec4 linear;     // u' = x u + y v + offset.x, v' = z u + w v + offset.y
    vec2 offset;
};

struct Material {
    vec4 base_color;  // linear
    vec3 emissive;    // W/(sr m2)
    float metallic;
    float roughness;
    float normal_scale;
    float occlusion_strength;
    float alpha_cutoff;
    float ior;
    float transmission;
    uint flags;       // MATERIAL_ bits
    TextureUse textures[6];
};

layout(binding = MATERIALS_BINDING, scalar) readonly buffer Materials { Material materials[]; };
layout(binding = TEXTURES_BINDING) uniform sampler2DArray scene_textures[8];

// Does material m have a texture in this slot?
bool has_texture(uint flags, uint slot) {
    return (flags >> (MATERIAL_FIRST_TEXTURE + slot) & 1u) != 0u;
}

// Sampled with a repeating trilinear sampler; lod explicit, so that it may stand in any control flow and stage.
vec4 sample_array(uint array, vec3 at, float lod) {
    switch (array) {
        case 0u: return textureLod(scene_textures[0], at, lod);
        case 1u: return textureLod(scene_textures[1], at, lod);
        case 2u: return textureLod(scene_textures[2], at, lod);
        case 3u: return textureLod(scene_textures[3], at, lod);
        case 4u: return textureLod(scene_textures[4], at, lod);
        case 5u: return textureLod(scene_textures[5], at, lod);
        case 6u: return textureLod(scene_textures[6], at, lod);
        default: return textureLod(scene_textures[7], at, lod);
    }
}

// One coordinate under clamp or mirror; the hardware sampler repeats. `texel` is the size of a texel at the mip that is
// read: staying half of one inside keeps the linear filter from reaching over to the other side.
float wrapped(float x, float texel, bool clamped, bool mirrored) {
    if (mirrored) {
        x = abs(x - 2.0 * round(0.5 * x));
    }
    return clamped || mirrored ? clamp(x, 0.5 * texel, 1.0 - 0.5 * texel) : x;
}

vec2 transformed(TextureUse use, vec2 uv) {
    return vec2(dot(use.linear.xy, uv), dot(use.linear.zw, uv)) + use.offset;
}

// Mip level for the change of uv (as in the mesh) from a pixel to the next.
float texture_lod(TextureUse use, vec2 dx, vec2 dy) {
    vec2 du = vec2(dot(use.linear.xy, dx), dot(use.linear.zw, dx)) * use.size;
    vec2 dv = vec2(dot(use.linear.xy, dy), dot(use.linear.zw, dy)) * use.size;
    return 0.5 * log2(max(max(dot(du, du), dot(dv, dv)), 1e-20));
}

// Texture at uv (as in the mesh) and mip level, under the glTF sampler of this use.
vec4 sample_texture(TextureUse use, vec2 mesh_uv, float lod) {
    vec2 uv = transformed(use, mesh_uv);
    bool magnified = lod <= 0.0;
    if ((use.mode & SAMPLER_MIP_NONE) != 0u) lod = 0.0;
    if ((use.mode & SAMPLER_MIP_NEAREST) != 0u) lod = floor(lod + 0.5);
    lod = max(lod, 0.0);
    vec2 size = max(floor(use.size * exp2(-ceil(lod))), 1.0);
    if ((use.mode & (magnified ? SAMPLER_MAG_NEAREST : SAMPLER_MIN_NEAREST)) != 0u) {
        // The centre of a texel is where the linear filter returns that texel alone.
        uv = (floor(uv * size) + 0.5) / size;
    }
    uv.x = wrapped(uv.x, 1.0 / size.x, (use.mode & SAMPLER_CLAMP_U) != 0u, (use.mode & SAMPLER_MIRROR_U) != 0u);
    uv.y = wrapped(uv.y, 1.0 / size.y, (use.mode & SAMPLER_CLAMP_V) != 0u, (use.mode & SAMPLER_MIRROR_V) != 0u);
    return sample_array(use.array, vec3(uv, float(use.layer)), lod);
}

#endif
