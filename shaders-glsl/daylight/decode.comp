// Baked indirect light at the pixels of a picture, and the sum of all light. A pixel fetches the images of its tile; no frame of the day is ever
// rebuilt in memory. In the notation of the paper (Bahnsen et al. 2012, equations 1 to 3), the coefficients are already those between two steps.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/gbuffer.glsl"
#include "lib/scene.glsl"
#include "lib/view.glsl"
#include "daylight/tiles.glsl"
#include "daylight/cube.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 1) uniform sampler2D albedo;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3) uniform sampler2D direct;         // with emission
layout(binding = 4) uniform sampler2D specular;       // rgb: F0
layout(binding = 5, rgba16f) uniform writeonly image2D total;
layout(binding = 6, rgba16f) uniform writeonly image2D indirect;
layout(binding = 7, rgba16f) uniform writeonly image2D irradiance;
layout(binding = 8) uniform sampler2D places;         // in the lightmap, texels
layout(binding = 9, scalar) uniform ViewBlock { View view; };
layout(binding = 10) uniform sampler2D normal;
layout(binding = 11, scalar) readonly buffer Around { CubeTexel around[]; };  // row after row, of the faces beside each other

layout(constant_id = 0) const uint TEXELS_OF = DAY_VIEW;

layout(push_constant, scalar) uniform Push {
    uint side;     // of a tile, texels
    uint columns;  // of tiles
    uvec2 texels;  // of the bake
};

// The light of a texel, with 1 in a; 0 where no surface is.
vec4 texel_light(uvec2 texel) {
    uvec2 tile = texel / side;
    uint number = tile.y * columns + tile.x;
    uint at = day_texel(number, texel - tile * side);
    return at == NONE ? vec4(0.0) : vec4(day_irradiance(number, at), 1.0);
}

// Bilinear between the texels that are on a surface. Texels of other charts are farther away than one texel.
vec3 lightmap_light(vec2 place) {
    vec2 corner = floor(place - 0.5);
    vec2 f = place - 0.5 - corner;
    vec4 sum = vec4(0.0);
    for (uint i = 0u; i < 4u; ++i) {
        uvec2 step = uvec2(i & 1u, i >> 1u);
        ivec2 texel = ivec2(corner) + ivec2(step);
        if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(uvec2(texel), texels))) continue;
        float weight = (step.x == 1u ? f.x : 1.0 - f.x) * (step.y == 1u ? f.y : 1.0 - f.y);
        if (weight > 0.0) sum += weight * texel_light(uvec2(texel));
    }
    return sum.a > 0.0 ? sum.rgb / sum.a : vec3(0.0);
}

// The light of a texel of the faces with its weight: `share` as far as it shows the surface that the pixel sees at `seen` from the camera with normal
// `n`. Texels of other surfaces count only if there are no better ones.
vec4 cube_texel(uint face, ivec2 at, vec3 seen, vec3 n, float share) {
    uint side_texels = texels.y;
    uvec3 texel;
    if (share <= 0.0 || !day_cube_texel(face, at, side_texels, texel)) return vec4(0.0);
    CubeTexel there = around[texel.y * texels.x + texel.z * side_texels + texel.x];
    if (there.depth <= 0.0) return vec4(0.0);
    vec2 centre = (vec2(texel.xy) + 0.5) / float(side_texels);
    float texel_size = 2.0 * length(seen) / float(side_texels);
    float off = dot(n, there.depth * day_cube_direction(texel.z, centre) - seen) / texel_size;
    float alike = exp(-2.0 * off * off) * pow(max(dot(n, octahedral_decode(unpackSnorm2x16(there.normal))), 0.0), 4.0);
    return share * max(alike, 1e-4) * texel_light(uvec2(texel.z * side_texels + texel.x, texel.y));
}

// Bilinear between the texels of the faces in the direction of the pixel.
vec3 cube_light(ivec2 pixel) {
    vec2 uv = (vec2(pixel) + 0.5) / view.extent;
    vec3 seen = world_from_depth(view, uv, texelFetch(depth, pixel, 0).r) - view.position;
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    vec2 place;
    uint face = day_cube_face(seen, place);
    vec2 at = place * float(texels.y) - 0.5;
    ivec2 corner = ivec2(floor(at));
    vec2 f = at - floor(at);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; ++i) {
        ivec2 step = ivec2(i & 1, i >> 1);
        float share = (step.x == 1 ? f.x : 1.0 - f.x) * (step.y == 1 ? f.y : 1.0 - f.y);
        sum += cube_texel(face, corner + step, seen, n, share);
    }
    if (sum.a < 0.01) {
        // None of them shows the surface, as on things thinner than a texel: farther texels may.
        for (int i = 0; i < 36; ++i) {
            vec2 step = vec2(i % 6 - 2, i / 6 - 2);
            sum += cube_texel(face, corner + ivec2(step), seen, n, 0.1 / (1.0 + dot(step - f, step - f)));
        }
    }
    return sum.a > 0.0 ? sum.rgb / sum.a : vec3(0.0);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(total)))) return;
    vec4 light = texelFetch(direct, pixel, 0);
    if (texelFetch(depth, pixel, 0).r >= 1.0) {
        imageStore(total, pixel, vec4(light.rgb, 0.0));
        imageStore(indirect, pixel, vec4(0.0));
        imageStore(irradiance, pixel, vec4(0.0));
        return;
    }
    vec3 e = vec3(0.0);
    if (TEXELS_OF == DAY_VIEW) {
        e = texel_light(uvec2(pixel)).rgb;
    } else if (TEXELS_OF == DAY_CUBE) {
        e = cube_light(pixel);
    } else {
        vec2 place = texelFetch(places, pixel, 0).xy;
        if (place.x >= 0.0) e = lightmap_light(place);
    }
    e = max(e, vec3(0.0));
    vec4 color = texelFetch(albedo, pixel, 0);
    // Gloss reflects the indirect light as a diffuse surface of the same reflectance does; a dielectric's 4 % are left out, as in direct light.
    vec3 reflectance = color.rgb + max(texelFetch(specular, pixel, 0).rgb - 0.04, 0.0);
    vec3 bounced = color.a * reflectance * e / 3.14159265358979;
    imageStore(total, pixel, vec4(light.rgb + bounced, 1.0));
    imageStore(indirect, pixel, vec4(bounced, 1.0));
    imageStore(irradiance, pixel, vec4(e, 1.0));
}
