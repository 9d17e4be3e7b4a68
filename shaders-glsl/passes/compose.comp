// Bilateral upsampling of the coarse result [ISR 27], [ISR 28] and the sum of all light [ISR 29].
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "passes/bilateral.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint FACTOR = 2;
// 0: |z_p - z_i| of linear z / far (dissertation). 1: distance from the pixel's plane relative to its depth, and likeness of
// the normals.
layout(constant_id = 1) const uint PLANE = 1;
// 0: the gathered radiance is added as it is (dissertation). 1: times the albedo of the pixel.
layout(constant_id = 2) const uint TINT = 1;
// 0: occlusion darkens direct light [ISR 29]. 1: it darkens ambient light only.
layout(constant_id = 3) const uint OCCLUDE_AMBIENT = 1;
// 0: the environment lights every surface, times accessibility. 1: its unshadowed share is in `sky`, and light of emissive triangles in `lamps`.
layout(constant_id = 4) const uint AREA = 0;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1, scalar) readonly buffer Ambient { vec3 ambient[]; };
layout(binding = 2) uniform sampler2D albedo;
layout(binding = 3) uniform sampler2D normal;
layout(binding = 4) uniform sampler2D depth;
layout(binding = 5) uniform sampler2D emission;      // a: accessibility by the material
layout(binding = 6) uniform sampler2D direct;        // with emission
layout(binding = 7) uniform sampler2D gathered;      // coarse: rgb radiance, a occlusion
layout(binding = 8) uniform sampler2D coarse_depth;
layout(binding = 9) uniform sampler2D coarse_normal;
layout(binding = 10) uniform sampler2D specular;  // rgb F0, a roughness
layout(binding = 11, rgba16f) uniform writeonly image2D total;
layout(binding = 12, rgba16f) uniform writeonly image2D indirect;
layout(binding = 13, r32f) uniform writeonly image2D accessibility;
layout(binding = 14) uniform sampler2D sky;      // coarse: rgb share times a
layout(binding = 15) uniform sampler2D lamps;    // coarse: radiance of a white receiver

layout(push_constant, scalar) uniform Push {
    float k_ssao;
    float k_isr;
    float epsilon;  // of the depth weight; same unit as the depth difference
};

#include "lib/ambient.glsl"

// Below this share of the largest possible weight no coarse texel matches, and the nearest in depth is taken.
const float NO_MATCH = 0.01;

struct Coarse {
    vec4 gathered;
    vec4 sky;
    vec3 lamps;
};

Coarse coarse_at(ivec2 texel) {
    Coarse light = Coarse(texelFetch(gathered, texel, 0), vec4(0.0), vec3(0.0));
    if (AREA != 0) {
        light.sky = texelFetch(sky, texel, 0);
        light.lamps = texelFetch(lamps, texel, 0).rgb;
    }
    return light;
}

Coarse upsample(ivec2 pixel, float z, vec3 n, vec3 p) {
    ivec2 last = textureSize(coarse_depth, 0) - 1;
    vec2 at = (vec2(pixel) + 0.5) / float(FACTOR) - 0.5;
    ivec2 base = ivec2(floor(at));
    vec2 f = at - vec2(base);
    Coarse sum = Coarse(vec4(0.0), vec4(0.0), vec3(0.0));
    float weights = 0.0;
    Coarse nearest = sum;
    float nearest_off = 1e30;
    for (int i = 0; i < 4; ++i) {
        ivec2 corner = ivec2(i & 1, i >> 1);
        ivec2 coarse = clamp(base + corner, ivec2(0), last);
        float bilinear = (corner.x == 1 ? f.x : 1.0 - f.x) * (corner.y == 1 ? f.y : 1.0 - f.y);
        float coarse_z = texelFetch(coarse_depth, coarse, 0).r;
        if (coarse_z >= 1.0) {
            continue;
        }
        Coarse value = coarse_at(coarse);
        float off = abs(z - coarse_z);
        if (PLANE != 0) {
            vec3 x = screen_position(view, coarse, float(FACTOR), coarse_z);
            off = bilateral_plane_distance(p, n, x, z * view.far);
        }
        float w = bilinear / (epsilon + off); // [ISR 27]
        if (PLANE != 0) {
            vec3 m = texelFetch(coarse_normal, coarse, 0).xyz;
            float like = max(dot(n, m) * inversesqrt(max(dot(m, m), 1e-12)), 0.0);
            w *= like * like * like * like;
        }
        sum.gathered += w * value.gathered;
        sum.sky += w * value.sky;
        sum.lamps += w * value.lamps;
        weights += w;
        if (off < nearest_off) {
            nearest_off = off;
            nearest = value;
        }
    }
    if (weights * epsilon < NO_MATCH) return nearest;
    return Coarse(sum.gathered / weights, sum.sky / weights, sum.lamps / weights); // [ISR 28]
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(total)))) {
        return;
    }
    float z = texelFetch(depth, pixel, 0).r;
    vec4 light = texelFetch(direct, pixel, 0);
    if (z >= 1.0) {
        imageStore(total, pixel, vec4(light.rgb, 0.0));
        imageStore(indirect, pixel, vec4(0.0));
        imageStore(accessibility, pixel, vec4(1.0));
        return;
    }
    vec4 color = texelFetch(albedo, pixel, 0);
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    vec3 p = screen_position(view, pixel, 1.0, z);
    Coarse light_around = upsample(pixel, z, n, p);
    vec4 coarse = light_around.gathered;
    float open = 1.0 - clamp(coarse.a, 0.0, 1.0);
    float lit = clamp(open + 1.0 - k_ssao, 0.0, 1.0);
    vec4 gloss = texelFetch(specular, pixel, 0);
    // Metals have no diffuse part and would be black. What they reflect beyond a dielectric's 4 % takes light of surfaces and lamps as if it came
    // evenly from all sides of the surface.
    vec3 mirror = max(gloss.rgb - 0.04, 0.0);
    vec3 reflected = color.rgb + mirror;
    vec3 bounced = k_isr * coarse.rgb * (TINT != 0 ? reflected : vec3(1.0));
    vec4 own = texelFetch(emission, pixel, 0);
    vec3 glow = own.rgb;
    // The occlusion texture of the material darkens light from all around and nothing else.
    vec3 around = color.rgb * ambient_irradiance(n);
    // The environment is as blurred as its irradiance for them, from the mirrored direction.
    vec3 mirrored = normalize(mix(reflect(-to_camera(view, p), n), n, gloss.a * gloss.a));
    around += mirror * ambient_irradiance(mirrored);
    around *= own.a / 3.14159265358979;
    vec3 direct_part = OCCLUDE_AMBIENT != 0 ? light.rgb : (light.rgb - glow) * lit + glow;
    vec4 share = light_around.sky;
    around *= AREA != 0 ? share.rgb / max(share.a, 1e-6) : vec3(lit);
    bounced += AREA != 0 ? reflected * light_around.lamps : vec3(0.0);
    vec3 sum = direct_part + around + bounced; // [ISR 29]
    imageStore(total, pixel, vec4(sum, 1.0));
    imageStore(indirect, pixel, vec4(around + bounced, 1.0));
    imageStore(accessibility, pixel, vec4(open));
}
