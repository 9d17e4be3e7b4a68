// Light of the probes around each pixel's point: all indirect light of the objects that were added at run time, and the directions of the light that gloss
// reflects on all surfaces. Weights of the probes follow
// Majercik, Guertin, Nowrouzezahrai and McGuire, Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields (2019), section 3.3.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/gbuffer.glsl"
#include "lib/view.glsl"
#include "lib/scene.glsl"
#include "daylight/probe.glsl"
#include "daylight/reflect.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D albedo;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3) uniform sampler2D direct;         // with emission
layout(binding = 4) uniform sampler2D specular;       // rgb: F0; a: roughness
layout(binding = 5) uniform sampler2D normals;
layout(binding = 6) uniform sampler2D mask;            // above 0.5 at added objects
// Pixels without a change keep what they have.
layout(binding = 7, rgba16f) uniform image2D total;
layout(binding = 8, rgba16f) uniform image2D indirect;
layout(binding = 9, rgba16f) uniform image2D irradiance;
layout(binding = 10, scalar) uniform GridBlock { DayGrid grid; };
layout(binding = 11, scalar) readonly buffer Probes { DayProbe probes[]; };
layout(binding = 12, scalar) readonly buffer Distances { uint distances[]; };  // mean and mean square, halves; texel after texel of each probe
layout(binding = 13, scalar) readonly buffer Light { vec3 light[]; };          // PROBE_TERMS for each probe

layout(constant_id = 0) const uint REFLECTS = REFLECT_GLOSS;
// There are added objects, and they have the light of probes.
layout(constant_id = 1) const uint ADDED = 1u;
// Gloss reflects the light of the probes in its direction.
layout(constant_id = 2) const uint DIRECTED = 1u;

// Light around a point.
struct ProbeLight {
    vec3 irradiance;  // of the normal, W/m²
    vec3 even;        // π times the mean radiance of all directions
    vec3 lobe;        // π times what the mean radiance in the lobe that gloss reflects has beyond it
    float there;      // 1; 0: no probe has light
};

// Of one probe. `along`: harmonics of the axis of the lobe, by its zonal harmonics and by the radiance for 1 W/m² of irradiance.
ProbeLight probe_light(uint probe, float harmonics[PROBE_TERMS], float along[PROBE_TERMS]) {
    ProbeLight result = ProbeLight(vec3(0.0), vec3(0.0), vec3(0.0), 1.0);
    for (uint k = 0u; k < PROBE_TERMS; ++k) {
        vec3 term = light[probe * PROBE_TERMS + k];
        result.irradiance += harmonics[k] * term;
        if (k == 0u) result.even = along[k] * term; else result.lobe += along[k] * term;
    }
    result.irradiance = max(result.irradiance, vec3(0.0));
    return result;
}

void add(inout ProbeLight sum, ProbeLight of, float weight) {
    sum.irradiance += weight * of.irradiance;
    sum.even += weight * of.even;
    sum.lobe += weight * of.lobe;
    sum.there += weight;
}

ProbeLight mean(ProbeLight sum) {
    return ProbeLight(sum.irradiance / sum.there, sum.even / sum.there, sum.lobe / sum.there, 1.0);
}

// The harmonics that sum up to the mean of a lobe around an axis. Irradiance is radiance by the zonal harmonics of the cosine, relative to π: 1, 2/3, 1/4.
float[PROBE_TERMS] lobe_harmonics(vec3 axis, float alpha) {
    float result[PROBE_TERMS] = probe_harmonics(axis);
    vec2 sharper = day_lobe(alpha) * vec2(1.5, 4.0);
    for (uint k = 1u; k < PROBE_TERMS; ++k) result[k] *= k < 4u ? sharper.x : sharper.y;
    return result;
}

// Mean and mean square of the distance to the surfaces around a probe, bilinear between texels. Neighbours over a border of the octahedral map
// are mirrored at the middle of that border.
vec2 probe_distance(uint probe, vec3 direction) {
    float side = float(PROBE_SIDE);
    vec2 place = (octahedral_encode(direction) * 0.5 + 0.5) * side - 0.5;
    vec2 corner = floor(place);
    vec2 f = place - corner;
    vec2 sum = vec2(0.0);
    for (uint i = 0u; i < 4u; ++i) {
        uvec2 step = uvec2(i & 1u, i >> 1u);
        ivec2 texel = ivec2(corner) + ivec2(step);
        int last = int(PROBE_SIDE) - 1;
        if (texel.x < 0 || texel.x > last) texel = ivec2(clamp(texel.x, 0, last), last - texel.y);
        if (texel.y < 0 || texel.y > last) texel = ivec2(last - texel.x, clamp(texel.y, 0, last));
        float weight = (step.x == 1u ? f.x : 1.0 - f.x) * (step.y == 1u ? f.y : 1.0 - f.y);
        sum += weight * unpackHalf2x16(distances[(probe * PROBE_SIDE + uint(texel.y)) * PROBE_SIDE + uint(texel.x)]);
    }
    return sum;
}

// `axis`, `alpha`: of the gloss.
ProbeLight probes_at(vec3 position, vec3 normal, vec3 axis, float alpha) {
    float harmonics[PROBE_TERMS] = probe_harmonics(normal);
    float along[PROBE_TERMS] = lobe_harmonics(axis, alpha);
    // Off the surface, so that surfaces beside it do not hide the probes.
    float closest = min(grid.spacing.x, min(grid.spacing.y, grid.spacing.z));
    vec3 point = position + 0.1 * closest * normal;
    vec3 last = vec3(grid.counts - 1u);
    vec3 place = clamp((point - grid.origin) / grid.spacing, vec3(0.0), last);
    vec3 corner = min(floor(place), max(last - 1.0, vec3(0.0)));
    vec3 f = place - corner;
    ProbeLight sum = ProbeLight(vec3(0.0), vec3(0.0), vec3(0.0), 0.0);
    ProbeLight plain = sum;
    for (uint i = 0u; i < 8u; ++i) {
        vec3 step = vec3(uvec3(i, i >> 1u, i >> 2u) & 1u);
        vec3 share = mix(1.0 - f, f, step);
        float weight = share.x * share.y * share.z;
        if (weight <= 0.0) continue;
        uint number = probe_number(grid, uvec3(min(corner + step, last)));
        uint near = probes[number].near;
        if (near == NONE) continue;
        ProbeLight of = probe_light(near, harmonics, along);
        add(plain, of, weight);
        if (near != number) continue;
        vec3 away = point - probes[number].position;
        float far = length(away);
        vec3 direction = far > 0.0 ? away / far : normal;
        // Probes behind the surface count little.
        float facing = 0.5 - 0.5 * dot(direction, normal);
        weight *= facing * facing + 0.2;
        // Chebyshev's bound of the share of surfaces that are farther away than the point.
        vec2 around = probe_distance(number, direction);
        if (far > around.x) {
            float spread = abs(around.y - around.x * around.x);
            float beyond = far - around.x;
            float seen = spread / (spread + beyond * beyond);
            weight *= max(seen * seen * seen, 0.001);
        }
        add(sum, of, weight);
    }
    if (sum.there > 1e-4) return mean(sum);
    // No probe sees the point.
    return plain.there > 0.0 ? mean(plain) : plain;
}

// The light of the lobe, as the irradiance of light from everywhere alike. Few harmonics swing below zero beside bright light: they are then weaker in all
// channels, so that colours stay.
vec3 lobe_light(ProbeLight here) {
    float window = 1.0;
    for (uint c = 0u; c < 3u; ++c) {
        if (here.even[c] + window * here.lobe[c] < 0.0) window = here.even[c] / -here.lobe[c];
    }
    return max(here.even + window * here.lobe, vec3(0.0));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(total);
    if (any(greaterThanEqual(pixel, size))) return;
    float far = texelFetch(depth, pixel, 0).r;
    if (far >= 1.0) return;
    bool added = ADDED != 0u && texelFetch(mask, pixel, 0).r >= 0.5;
    if (!added && DIRECTED == 0u) return;
    vec3 position = world_from_depth(view, (vec2(pixel) + 0.5) / vec2(size), far);
    vec3 n = decode_normal(texelFetch(normals, pixel, 0));
    vec3 v = to_camera(view, position);
    vec4 gloss = texelFetch(specular, pixel, 0);
    DayShares shares = day_shares(texelFetch(albedo, pixel, 0), gloss, dot(n, v), REFLECTS);
    if (!added && shares.shine == vec3(0.0)) return;
    float alpha = brdf_alpha(gloss.a);
    ProbeLight here = probes_at(position, n, day_lobe_axis(n, v, alpha), alpha);
    vec3 e = added ? here.irradiance : imageLoad(irradiance, pixel).rgb;
    vec3 reflected = e;
    if (DIRECTED != 0u && here.there > 0.0) {
        // Where the surface has less light than the probes, as in a corner, it reflects less of their light. What it has beyond the light of the probes, as that of
        // a lamp close by, has no direction.
        vec3 shared_part = min(e, here.irradiance);
        reflected = lobe_light(here) * shared_part / max(here.irradiance, vec3(1e-30)) + e - shared_part;
    }
    vec3 bounced = (shares.matt * e + shares.shine * reflected) / 3.14159265358979;
    imageStore(total, pixel, vec4(texelFetch(direct, pixel, 0).rgb + bounced, 1.0));
    imageStore(indirect, pixel, vec4(bounced, 1.0));
    imageStore(irradiance, pixel, vec4(e, 1.0));
}
