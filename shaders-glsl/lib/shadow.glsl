// Shadow maps of all lights: layers ("slots") of one array image, drawn by passes::shadow.
// Before including: #define SHADOWS_BINDING and SHADOW_MAPS_BINDING, or take the defaults. Includes lib/lights.glsl.
#ifndef LIB_SHADOW
#define LIB_SHADOW
#include "lib/lights.glsl"

#ifndef SHADOWS_BINDING
#define SHADOWS_BINDING 21
#endif
#ifndef SHADOW_MAPS_BINDING
#define SHADOW_MAPS_BINDING 22
#endif

const uint MAX_SHADOW_SLOTS = 64u; // export
const uint SHADOW_OFF = 0u; // export
const uint SHADOW_PLAIN = 1u; // export
const uint SHADOW_PCF = 2u; // export
const uint SHADOW_EXPONENTIAL = 3u; // export
// Lights whose shadows a filter over the picture smooths, at most.
const uint SHADOW_SCREENED = 16u; // export

// One layer: the view of a spot light, of a face of a point light, or of a cascade of a directional light.
// Faces and spot views are a little wider than needed, so that filters find neighbours at the border.
struct ShadowSlot {
    mat4 clip_from_world; // reversed depth
    float near;           // metres from the light (perspective) or along its axis
    float far;
    float texel;          // metres: size of a texel at one metre (perspective) or everywhere
    uint perspective;
    vec2 half_angle;      // tangent of half the field of view, x and y (perspective)
    float exponent;       // c of [ISR 30] for linear depth 0..1
};

struct ShadowLight {
    uint first; // slot
    uint count; // 0: the light casts no shadow
};

struct ShadowSettings {
    uint kind;         // SHADOW_
    float depth_bias;  // texels
    float normal_bias; // texels
    float size;        // texels of a side
    float grazing;     // least share of the exponent that remains where light grazes; 0 as in listing 8
};

layout(binding = SHADOWS_BINDING, scalar) readonly buffer Shadows {
    ShadowSettings shadow_settings;
    ShadowSlot shadow_slots[64];
    ShadowLight shadow_lights[]; // one a light
};
layout(binding = SHADOW_MAPS_BINDING) uniform sampler2DArray shadow_maps;

// Eye distance along the axis of a stored hardware depth.
float shadow_axis_depth(ShadowSlot slot, float depth) {
    return slot.perspective != 0u
        ? slot.near * slot.far / (slot.near + depth * (slot.far - slot.near))
        : slot.far - depth * (slot.far - slot.near);
}

// 0 at the light (or the near end), 1 at the far end: distance from the light for perspective slots, so that the faces of
// a point light fit together, else along the axis. `ndc`: place in the layer, -1..1.
float shadow_linear_depth(ShadowSlot slot, vec2 ndc, float axis) {
    return slot.perspective != 0u
        ? axis * length(vec3(ndc * slot.half_angle, 1.0)) / slot.far
        : (axis - slot.near) / (slot.far - slot.near);
}

float shadow_texel(ivec2 at, uint slot) {
    int last = int(shadow_settings.size) - 1;
    return texelFetch(shadow_maps, ivec3(clamp(at, ivec2(0), ivec2(last)), int(slot)), 0).r;
}

// Faces in the order +x -x +y -y +z -z.
uint cube_face(vec3 d) {
    vec3 a = abs(d);
    if (a.x >= a.y && a.x >= a.z) return d.x >= 0.0 ? 0u : 1u;
    if (a.y >= a.z) return d.y >= 0.0 ? 2u : 3u;
    return d.z >= 0.0 ? 4u : 5u;
}

// The tightest cascade that holds the point with a border for the filter; count if none does.
uint cascade_of(uint first, uint count, vec3 world) {
    float border = 1.0 - 6.0 / shadow_settings.size;
    for (uint i = 0u; i < count; ++i) {
        vec3 clip = (shadow_slots[first + i].clip_from_world * vec4(world, 1.0)).xyz;
        if (all(lessThan(abs(clip.xy), vec2(border))) && clip.z >= 0.0 && clip.z <= 1.0) return i;
    }
    return count;
}

// Exponential test [ISR 30] on linear depths, both 0..1: 1 where the receiver is at or before the occluder.
float exponential_visibility(float receiver, float occluder, float exponent) {
    return exp(-exponent * max(receiver - occluder, 0.0));
}

// Share of a light that reaches a point: 1 lit, 0 in shadow. `normal`: unit surface normal at the point.
float shadow_factor(Light l, vec3 world, vec3 normal) {
    ShadowLight place = shadow_lights[l.index];
    if (place.count == 0u || shadow_settings.kind == SHADOW_OFF) return 1.0;
    vec3 to_light = l.kind == LIGHT_DIRECTIONAL ? -l.direction : normalize(l.position - world);
    uint index = place.first;
    if (l.kind == LIGHT_DIRECTIONAL) {
        uint cascade = cascade_of(place.first, place.count, world);
        if (cascade == place.count) return 1.0;
        index += cascade;
    } else if (place.count == 6u) { // a cube around a point light or a very wide spot light
        index += cube_face(world - l.position);
    }
    ShadowSlot slot = shadow_slots[index];
    bool exponential = shadow_settings.kind == SHADOW_EXPONENTIAL;

    // Off the surface, by the width of a texel where it is seen at an angle.
    float distance = slot.perspective != 0u ? length(l.position - world) : 1.0;
    float facing = clamp(dot(normal, to_light), 0.0, 1.0);
    float lift = shadow_settings.normal_bias * slot.texel * distance * sqrt(1.0 - facing * facing);
    vec4 clip = slot.clip_from_world * vec4(world + normal * lift, 1.0);
    if (clip.w <= 0.0) return 1.0;
    vec3 ndc = clip.xyz / clip.w;
    if (any(greaterThan(abs(ndc.xy), vec2(1.0))) || ndc.z <= 0.0) return 1.0;
    vec2 at = vec2(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * shadow_settings.size;
    float axis = shadow_axis_depth(slot, ndc.z);

    if (exponential) {
        // Listing 8: the test at the four nearest texels, blended; weakened at grazing angles (listing 8: by the cosine).
        float receiver = shadow_linear_depth(slot, ndc.xy, axis);
        vec2 corner = floor(at - 0.5);
        vec2 f = at - 0.5 - corner;
        float s[4];
        for (int i = 0; i < 4; ++i) {
            float occluder = shadow_texel(ivec2(corner) + ivec2(i & 1, i >> 1), index);
            s[i] = exponential_visibility(receiver, occluder, slot.exponent * max(facing, shadow_settings.grazing));
        }
        return mix(mix(s[0], s[1], f.x), mix(s[2], s[3], f.x), f.y);
    }
    float bias = shadow_settings.depth_bias * slot.texel * distance;
    if (shadow_settings.kind == SHADOW_PLAIN) {
        return axis - bias <= shadow_axis_depth(slot, shadow_texel(ivec2(floor(at)), index)) ? 1.0 : 0.0;
    }
    // Percentage closer: a 3x3 box that moves smoothly over 4x4 texels.
    vec2 corner = floor(at - 0.5);
    vec2 f = at - 0.5 - corner;
    float sum = 0.0;
    for (int y = -1; y <= 2; ++y) {
        float wy = y == -1 ? 1.0 - f.y : (y == 2 ? f.y : 1.0);
        for (int x = -1; x <= 2; ++x) {
            float wx = x == -1 ? 1.0 - f.x : (x == 2 ? f.x : 1.0);
            float stored = shadow_axis_depth(slot, shadow_texel(ivec2(corner) + ivec2(x, y), index));
            sum += axis - bias <= stored ? wx * wy : 0.0;
        }
    }
    return min(sum / 9.0, 1.0);
}

#endif
