// Irradiance of a separated texel, shadowed by the shadow maps of the occluders.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "fiv/fiv.glsl"
#define FIV_NO_VECTORS
#include "fiv/lookup.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3) uniform sampler2D identity;
layout(binding = 4, scalar) readonly buffer Occluders { FivOccluder occluders[]; };
layout(binding = 5, scalar) readonly buffer Shades { FivShade shades[]; }; // one for each occluder
layout(binding = 6, scalar) readonly buffer Depths { float depths[]; };
layout(binding = 7, scalar) readonly buffer Suns { FivSun suns[]; };
layout(binding = 8, scalar) readonly buffer Near { uint near[]; }; // occluders that may affect a tile of pixels, a bit each
layout(binding = 9, rgba32f) uniform image2D irradiance;           // W/m²

layout(push_constant, scalar) uniform Push {
    uint sun;
    uint words; // words of a tile
};

// Share of the light that occluder `i` hides from `p`, from the four nearest texels of its map. `bias`: metres.
float hides(uint i, vec3 p, float bias) {
    vec3 q = p - occluders[i].centre;
    float radius = occluders[i].radius;
    float along = dot(q, suns[sun].direction) + bias;
    vec2 at = vec2(dot(q, suns[sun].right), dot(q, suns[sun].up));
    if (along >= radius || any(greaterThan(abs(at), vec2(1.01 * radius)))) return 0.0;
    vec2 texel = (0.5 * at / radius + 0.5) * float(FIV_SUN_SIDE) - 0.5;
    ivec2 low = ivec2(floor(texel));
    vec2 part = texel - vec2(low);
    uint map = shades[i].map + sun * FIV_SUN_SIDE * FIV_SUN_SIDE;
    float sum = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 step = ivec2(k & 1, k >> 1);
        ivec2 place = low + step;
        if (any(lessThan(place, ivec2(0))) || any(greaterThanEqual(place, ivec2(FIV_SUN_SIDE)))) continue;
        vec2 weights = mix(1.0 - part, part, vec2(step));
        if (depths[map + uint(place.y) * FIV_SUN_SIDE + uint(place.x)] > along) sum += weights.x * weights.y;
    }
    return sum;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(irradiance)))) return;
    float z = texelFetch(depth, pixel, 0).r;
    if (z >= 1.0) return;
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    // Occluders may have subtracted more light than there was.
    vec3 sum = max(imageLoad(irradiance, pixel).rgb, vec3(0.0));
    float cosine = dot(n, suns[sun].area);
    if (cosine > 0.0) {
        vec3 p = screen_position(view, pixel, 1.0, z);
        vec2 shown = texelFetch(identity, pixel, 0).rg;
        uint self = FIV_NONE;
        if (shown.x > 0.5 && abs(shown.y - z) <= 1e-4 * z) self = uint(shown.x + 0.5) - 1u;
        float left = 1.0;
        if (self != FIV_NONE && shades[self].own != 0u) {
            // The bias keeps a surface out of its own shadow. The bias is as large as the depth range of a texel on the
            // steep surface.
            float c = clamp(dot(n, suns[sun].direction), 0.05, 1.0);
            float texel = 2.0 * occluders[self].radius / float(FIV_SUN_SIDE);
            left = 1.0 - hides(self, p, texel * (0.3 + 1.5 * sqrt(1.0 - c * c) / c));
        }
        uint tile = fiv_tile(pixel, imageSize(irradiance).x) * words;
        for (uint w = 0u; w < words && left > 0.0; ++w) {
            for (uint bits = near[tile + w]; bits != 0u && left > 0.0; bits &= bits - 1u) {
                uint i = 32u * w + uint(findLSB(bits));
                if (i != self) left *= 1.0 - hides(i, p, 0.0);
            }
        }
        sum += suns[sun].radiance * (cosine * max(left, 0.0));
    }
    imageStore(irradiance, pixel, vec4(sum, 1.0));
}
