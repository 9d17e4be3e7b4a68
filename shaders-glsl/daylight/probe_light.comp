// Indirect light of the objects that were added at run time: that of the probes around each pixel's point. Weights of the probes follow
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
layout(binding = 6) uniform sampler2D mask;
// Other pixels keep what they have.
layout(binding = 7, rgba16f) uniform image2D total;
layout(binding = 8, rgba16f) uniform image2D indirect;
layout(binding = 9, rgba16f) uniform image2D irradiance;
layout(binding = 10, scalar) uniform GridBlock { DayGrid grid; };
layout(binding = 11, scalar) readonly buffer Probes { DayProbe probes[]; };
layout(binding = 12, scalar) readonly buffer Distances { uint distances[]; };  // mean and mean square, halves; texel after texel of each probe
layout(binding = 13, scalar) readonly buffer Light { vec3 light[]; };          // PROBE_TERMS for each probe

layout(constant_id = 0) const uint REFLECTS = REFLECT_GLOSS;

vec3 probe_irradiance(uint probe, float harmonics[PROBE_TERMS]) {
    vec3 e = vec3(0.0);
    for (uint k = 0u; k < PROBE_TERMS; ++k) e += harmonics[k] * light[probe * PROBE_TERMS + k];
    return max(e, vec3(0.0));
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

vec3 probes_at(vec3 position, vec3 normal) {
    float harmonics[PROBE_TERMS] = probe_harmonics(normal);
    // Off the surface, so that surfaces beside it do not hide the probes.
    float closest = min(grid.spacing.x, min(grid.spacing.y, grid.spacing.z));
    vec3 point = position + 0.1 * closest * normal;
    vec3 last = vec3(grid.counts - 1u);
    vec3 place = clamp((point - grid.origin) / grid.spacing, vec3(0.0), last);
    vec3 corner = min(floor(place), max(last - 1.0, vec3(0.0)));
    vec3 f = place - corner;
    vec4 sum = vec4(0.0);
    vec4 plain = vec4(0.0);
    for (uint i = 0u; i < 8u; ++i) {
        vec3 step = vec3(uvec3(i, i >> 1u, i >> 2u) & 1u);
        vec3 share = mix(1.0 - f, f, step);
        float weight = share.x * share.y * share.z;
        if (weight <= 0.0) continue;
        uint number = probe_number(grid, uvec3(min(corner + step, last)));
        uint near = probes[number].near;
        if (near == NONE) continue;
        vec3 e = probe_irradiance(near, harmonics);
        plain += weight * vec4(e, 1.0);
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
        sum += weight * vec4(e, 1.0);
    }
    if (sum.a > 1e-4) return sum.rgb / sum.a;
    // No probe sees the point.
    return plain.a > 0.0 ? plain.rgb / plain.a : vec3(0.0);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(total);
    if (any(greaterThanEqual(pixel, size)) || texelFetch(mask, pixel, 0).r < 0.5) return;
    vec2 uv = (vec2(pixel) + 0.5) / vec2(size);
    vec3 position = world_from_depth(view, uv, texelFetch(depth, pixel, 0).r);
    vec3 n = decode_normal(texelFetch(normals, pixel, 0));
    vec3 e = probes_at(position, n);
    float cosine = dot(n, to_camera(view, position));
    vec3 reflectance = day_reflectance(texelFetch(albedo, pixel, 0), texelFetch(specular, pixel, 0), cosine, REFLECTS);
    vec3 bounced = reflectance * e / 3.14159265358979;
    imageStore(total, pixel, vec4(texelFetch(direct, pixel, 0).rgb + bounced, 1.0));
    imageStore(indirect, pixel, vec4(bounced, 1.0));
    imageStore(irradiance, pixel, vec4(e, 1.0));
}
