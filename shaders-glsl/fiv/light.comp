// Irradiance of the visible surfaces: the irradiance of the whole environment minus the irradiance that occluders hide
// ([FIV 12]; Michael 2010, section 3.3.3).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/spread.glsl"
#include "lib/gbuffer.glsl"
#include "fiv/fiv.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint PARTIAL = 1;   // occluders that the receiver's plane cuts: 0 not corrected, 1 by their height, 2 by the light from behind
layout(constant_id = 1) const uint OVERLAP = 1;   // irradiance that several occluders hide is subtracted once
layout(constant_id = 2) const uint OWN = 1;       // shadows of occluders on themselves: 1 from samples on spheres, 2 from samples on their surfaces
layout(constant_id = 3) const uint TRILINEAR = 1; // interpolation between samples
layout(constant_id = 4) const uint SCALED = 1;    // interpolation relative to the solid angle
layout(constant_id = 5) const uint SPOTS = 0;     // light of a bright part is subtracted at most once
layout(constant_id = 6) const uint NEGLIGIBLE = 0; // occluders that can hide only a small share of the light are left out
layout(constant_id = 7) const uint HELD = 1;      // above 1: the most occluders whose direction and size a pixel keeps

struct FivWhole {
    vec3 x; // vectors of the whole environment, W/m²
    vec3 y;
    vec3 z;
    uint occluders;
    uint spots;
    float negligible; // share of the mean irradiance
    vec2 turn;        // cosine and sine of the rotation of the environment since its irradiance map, about +y
    float factor;     // on its radiance since then
};

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3) uniform sampler2D identity;
layout(binding = 4) uniform samplerCube difmap;
layout(binding = 5, scalar) readonly buffer Occluders { FivOccluder occluders[]; };
layout(binding = 6, scalar) readonly buffer Fivs { float fivs[]; };
layout(binding = 7, rgba32f) uniform image2D irradiance; // W/m²; negative where occluders hide more light than there was
layout(binding = 8, scalar) uniform WholeBlock { FivWhole whole; };
layout(binding = 9) uniform sampler2D own; // irradiance past the pixel's own occluder, W/m²; a: 1 where the irradiance is known
layout(binding = 10, scalar) readonly buffer Reaches { float reaches[]; };

layout(binding = 11, scalar) readonly buffer Near { uint near[]; }; // occluders that may affect a tile of pixels, a bit each

layout(binding = 12, scalar) readonly buffer Pairs { uint pairs[]; }; // occluders that may overlap one of this call, a bit each
layout(binding = 13, scalar) readonly buffer Spots { FivSpot spots[]; };
layout(binding = 14, scalar) buffer Taken { float taken[]; }; // light that earlier calls subtracted from the bright parts
layout(binding = 15, scalar) readonly buffer Matter { float matter[]; };

layout(push_constant, scalar) uniform Push {
    uint first; // first occluder
    uint count;
    uint words; // words of a tile
};

#include "fiv/lookup.glsl"
#include "fiv/reach.glsl"
#include "fiv/spots.glsl"
#include "fiv/matter.glsl"

// Advances to the next word with an occluder, up to the word `last`. `tile`: first word of the tile.
bool fiv_next(inout uint w, inout uint bits, uint tile, uint last) {
    while (bits == 0u && ++w < last) bits = near[tile + w];
    return bits != 0u;
}

// Weight of an occluder: 0 if it can hide no more than the negligible share, with a continuous transition.
float fiv_counts(vec3 to, float far, float radius) {
    if (NEGLIGIBLE == 0u || far <= radius) return 1.0;
    return clamp(fiv_matter(to / far, radius / far) / whole.negligible - 1.0, 0.0, 1.0);
}

// Direction of the occluder's centre, and sine of the half angle of its bounding sphere.
vec4 look_place(uint i, vec3 p) {
    vec3 offset = occluders[i].centre - p;
    float far = max(length(offset), 1e-20);
    return vec4(offset / far, min(occluders[i].radius / far, 1.0));
}

// Share of the occluder in front of the receiver's plane, its weight, and the share of its disc that it fills.
vec3 look_amount(uint i, vec3 p, vec3 n, FivAlong along) {
    vec3 offset = occluders[i].centre - p;
    float d = dot(offset, n);
    // Without the correction for partial occluders, an occluder counts if its centre lies in front.
    float front = PARTIAL != 0u ? fiv_front_share(occluders[i], d, n, along) : float(d > 0.0);
    return vec3(front, fiv_counts(offset, length(offset), occluders[i].radius), occluders[i].fill);
}

// Directions, sizes and shares of the occluders that may affect the pixel. They are kept so that pairs cost little.
vec4 held_places[HELD];
vec3 held_amounts[HELD];

vec4 place_of(uint i, vec3 p) {
    if (HELD <= 1u) return look_place(i, p);
    return held_places[i];
}

vec3 amount_of(uint i, vec3 p, vec3 n, FivAlong along) {
    if (HELD <= 1u) return look_amount(i, p, n, along);
    return held_amounts[i];
}

// Irradiance of the whole environment, W/m².
vec3 open_irradiance(vec3 n) {
    vec3 then = vec3(whole.turn.x * n.x - whole.turn.y * n.z, n.y, whole.turn.y * n.x + whole.turn.x * n.z);
    return whole.factor * textureLod(difmap, cube_lookup(then), 0.0).rgb;
}

// Nodes of the mean over the unit interval: Gauss-Legendre, exact for seven overlapping occluders.
const vec4 NODES = vec4(0.0694318442, 0.3300094782, 0.6699905218, 0.9305681558);
const vec4 WEIGHTS = vec4(0.1739274226, 0.3260725774, 0.3260725774, 0.1739274226);

// Share of the irradiance hidden by occluder `i` that is subtracted, so that irradiance hidden by several occluders is
// subtracted once. For two occluders the share is 1 − Overlapped% of [FIV 15]. For more occluders the share is the mean
// of 1 / (1 + number of other occluders at a point), with independent occluders, which is the integral of the product
// of 1 - g (1 - t) over t in 0..1. `row`: first word of the occluders that may overlap it.
float own_share(uint i, uint self, vec3 p, vec3 n, FivAlong along, uint row) {
    vec4 place = place_of(i, p);
    float fill = occluders[i].fill;
    vec4 product = vec4(1.0);
    for (uint w = 0u, bits = pairs[row];;) {
        while (bits == 0u && ++w < words) bits = pairs[row + w];
        if (bits == 0u) break;
        uint j = 32u * w + uint(findLSB(bits));
        bits &= bits - 1u;
        if (j == self) continue;
        vec4 other = place_of(j, p);
        float apart = length(other.xyz - place.xyz);
        if (apart >= place.w + other.w) continue;
        // Share in front, weight, filled share.
        vec3 amount = amount_of(j, p, n, along);
        if (amount.x <= 0.0) continue;
        // Each occluder fills the same share of the lens as of its whole disc. With filled discs g / 2 is Overlapped%
        // of [FIV 15].
        float discs = FIV_PI * (place.w * place.w * fill + other.w * other.w * amount.z);
        float g = 2.0 * lens_area(place.w, other.w, apart) * fill * amount.z / discs; // [FIV 15]
        product *= 1.0 - g * amount.x * amount.y * (1.0 - NODES);
    }
    return dot(product, WEIGHTS);
}

void main() {
    ivec2 pixel = spread_texel();
    if (any(greaterThanEqual(pixel, imageSize(irradiance)))) return;
    float z = texelFetch(depth, pixel, 0).r;
    if (z >= 1.0) {
        imageStore(irradiance, pixel, vec4(0.0));
        return;
    }
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    vec3 p = screen_position(view, pixel, 1.0, z);
    vec2 shown = texelFetch(identity, pixel, 0).rg;
    uint self = FIV_NONE;
    if (shown.x > 0.5 && abs(shown.y - z) <= 1e-4 * z) self = uint(shown.x + 0.5) - 1u;
    vec3 open = open_irradiance(n);
    vec3 behind = PARTIAL == 2u ? open_irradiance(-n) : vec3(0.0);
    vec3 lit = open;
    // Light that other occluders hide may already be hidden by the own occluder. The two are taken as independent.
    vec3 seen = vec3(1.0);
    if (OWN == 2u && self != FIV_NONE) {
        vec4 left = texelFetch(own, pixel, 0);
        if (left.a > 0.5) {
            lit = min(left.rgb, open);
            if (OVERLAP != 0u) seen = lit / max(open, vec3(1e-30));
        }
    } else if (OWN == 1u && self != FIV_NONE && occluders[self].self_shadows != 0u) {
        // All visible light lies in front of the surface, as [FIV 13] requires. If all samples lie inside the occluder,
        // the pixel is unshadowed.
        vec4 hidden = fiv_dot(occluders[self], occluders[self].centre - p, n, TRILINEAR != 0u, SCALED != 0u);
        vec3 left = n.x * whole.x + n.y * whole.y + n.z * whole.z - hidden.rgb; // [FIV 13]
        if (hidden.w > 0.0) lit = clamp(left, vec3(0.0), open);
    }
    vec3 sum = first == 0u ? lit : imageLoad(irradiance, pixel).rgb;
    // Light of the bright parts, light that is subtracted from each part, and all other light.
    vec3 bright[FIV_SPOTS], gone[FIV_SPOTS], even = open;
    uint kept = 3u * FIV_SPOTS * uint(pixel.y * imageSize(irradiance).x + pixel.x);
    for (uint m = 0u; m < FIV_SPOTS; ++m) {
        bright[m] = vec3(0.0);
        gone[m] = vec3(0.0);
        if (SPOTS == 0u || m >= whole.spots) continue;
        bright[m] = fiv_spot_light(m, n);
        even = max(even - bright[m], vec3(0.0));
        if (first > 0u) for (uint c = 0u; c < 3u; ++c) gone[m][c] = taken[kept + 3u * m + c];
    }
    FivAlong along = fiv_along(n);
    uint tile_number = fiv_tile(pixel, imageSize(irradiance).x), tile = tile_number * words;
    if (HELD > 1u) {
        for (uint w = 0u, bits = near[tile]; fiv_next(w, bits, tile, words);) {
            uint i = 32u * w + uint(findLSB(bits));
            bits &= bits - 1u;
            held_places[i] = look_place(i, p);
            held_amounts[i] = look_amount(i, p, n, along);
        }
    }
    uint last = min((first + count + 31u) / 32u, words);
    uint w = first / 32u, bits = count > 0u ? near[tile + w] : 0u;
    while (fiv_next(w, bits, tile, last)) {
        uint i = 32u * w + uint(findLSB(bits));
        bits &= bits - 1u;
        if (i == self || i < first || i >= first + count) continue;
        vec3 offset = occluders[i].centre - p;
        vec3 amount = amount_of(i, p, n, along);
        float front = amount.x, fade = amount.y;
        if (front * fade <= 0.0) continue;
        vec4 looked = fiv_dot(occluders[i], offset, n, TRILINEAR != 0u, SCALED != 0u);
        vec3 hidden = looked.rgb;
        if (PARTIAL == 2u && front < 1.0) hidden = fiv_cut(occluders[i], offset, n, along, hidden, open, behind);
        hidden = max(hidden, vec3(0.0)) * (PARTIAL == 1u ? front : 1.0);
        // If most of the nearest samples lie inside the occluder, the receiver does too, and all light is hidden.
        hidden = mix(hidden, open, clamp(1.0 - 2.0 * looked.w, 0.0, 1.0)) * (fade * seen);
        if (hidden == vec3(0.0)) continue;
        if (OVERLAP != 0u && whole.occluders > 1u) {
            uint row = (tile_number * count + i - first) * words;
            float share = own_share(i, self, p, n, along, row);
            if (SPOTS != 0u) {
                // Hidden irradiance beyond the occluder's share of constant radiance comes from the bright parts that
                // its disc can cover.
                vec4 place = place_of(i, p);
                float flat_part = amount.z * front * fade * place.w * place.w * max(dot(place.xyz, n), 0.4 * place.w);
                float soft = FIV_PI / float(occluders[i].azimuths);
                vec3 could[FIV_SPOTS], all_could = vec3(0.0);
                for (uint m = 0u; m < FIV_SPOTS; ++m) {
                    could[m] = m < whole.spots ? bright[m] * fiv_spot_share(m, place.xyz, place.w, soft) : vec3(0.0);
                    all_could += could[m];
                }
                vec3 most = min(max(hidden - flat_part * even * seen, vec3(0.0)), all_could * seen);
                vec3 part = share * most / max(all_could, vec3(1e-30));
                for (uint m = 0u; m < FIV_SPOTS; ++m) gone[m] += part * could[m];
                hidden -= most;
            }
            hidden *= share;
        }
        // [FIV 14]: the shares of all occluders, subtracted from the total as in [FIV 12].
        sum -= hidden;
    }
    bool last_call = first + count >= whole.occluders;
    for (uint m = 0u; m < FIV_SPOTS; ++m) {
        if (SPOTS == 0u || m >= whole.spots) continue;
        if (last_call) sum -= min(gone[m], bright[m] * seen);
        else for (uint c = 0u; c < 3u; ++c) taken[kept + 3u * m + c] = gone[m][c];
    }
    imageStore(irradiance, pixel, vec4(sum, 1.0));
}
