// Baked indirect light at the pixels of a picture, and the sum of all light. A pixel fetches the images of its tile; no frame of the day is ever
// rebuilt in memory. With frames, it fetches the frames around the time. In the notation of the paper (Bahnsen et al. 2012, equations 1 to 3), the coefficients are already those between two steps.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/gbuffer.glsl"
#include "lib/scene.glsl"
#include "lib/view.glsl"
#define DAY_BLOCKS
#include "daylight/tiles.glsl"
#include "daylight/cube.glsl"
#include "daylight/reflect.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 1) uniform sampler2D albedo;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3) uniform sampler2D direct;         // with emission
layout(binding = 4) uniform sampler2D specular;       // rgb: F0; a: roughness
layout(binding = 5, rgba16f) uniform writeonly image2D total;
layout(binding = 6, rgba16f) uniform writeonly image2D indirect;
layout(binding = 7, rgba16f) uniform writeonly image2D irradiance;
layout(binding = 8) uniform sampler2D places;         // in the lightmap, texels

layout(binding = 9, scalar) uniform ViewBlock { View view; };
layout(binding = 10) uniform sampler2D normal;
layout(binding = 11, scalar) readonly buffer Around { CubeTexel around[]; };  // row after row, of the faces beside each other

layout(binding = 14, scalar) readonly buffer Frame0 { uint frame_0[]; };  // 16-bit floats, three for each texel on a surface
layout(binding = 15, scalar) readonly buffer Frame1 { uint frame_1[]; };
layout(binding = 16, scalar) readonly buffer Frame2 { uint frame_2[]; };
layout(binding = 17, scalar) readonly buffer Frame3 { uint frame_3[]; };
layout(binding = 18, scalar) buffer Fetches { uint fetches[256]; };      // read from images and frames, in parts

layout(constant_id = 0) const uint TEXELS_OF = DAY_VIEW;
// The light of the sun is in images: 0. It is in frames: one more than the number of frames that are mixed.
layout(constant_id = 1) const uint FRAMES = 0u;
// The light between two times is the line between its logarithms.
layout(constant_id = 2) const uint LOGARITHMS = 0u;
layout(constant_id = 4) const uint REFLECTS = REFLECT_GLOSS;

layout(push_constant, scalar) uniform Push {
    uint side;     // of a tile, texels
    uint columns;  // of tiles
    uvec2 texels;  // of the bake
    uint second;   // first coefficient for the second time, with logarithms
    float alpha;   // share of the second time, with logarithms
    vec3 sun;      // irradiance, W/m²
    vec4 weights;  // of the frames
};

// Added to light for 1 W/m² of the sun before the logarithm.
const float DARKEST = 1e-4;

// The light of a texel.
struct TexelLight {
    vec3 first;   // of the sun at the first time, or of both times, W/m²
    vec3 second;  // of the sun at the second time, with logarithms
    vec3 rest;    // of the sky and of lamps
    float there;  // 1; 0 where no surface is
};

const TexelLight NO_LIGHT = TexelLight(vec3(0.0), vec3(0.0), vec3(0.0), 0.0);

uint fetched = 0u;

// Adds a layer at a texel: its images in words, then those in blocks.
void add_layer(inout DaySums sums, uint tile, uint layer, uint texel, uvec2 inside, uint second) {
    day_layer(sums, tile, layer, texel, second);
    if (BLOCKS == 0u) return;
    uint first = tiles[tile].first[layer] + tiles[tile].wide[layer] + tiles[tile].narrow[layer];
    day_blocks(sums.first, sums.second, tile, layer, first, (side + 3u) / 4u * 4u, inside, second);
    sums.fetches += tiles[tile].hdr[layer] + tiles[tile].pairs[layer];
}

// Three values of a frame from two words.
vec3 frame_value(uint low, uint high, uint texel) {
    vec2 a = unpackHalf2x16(low);
    vec2 b = unpackHalf2x16(high);
    return (texel & 1u) == 0u ? vec3(a, b.x) : vec3(a.y, b);
}

TexelLight texel_light(uvec2 texel) {
    uvec2 tile = texel / side;
    uint number = tile.y * columns + tile.x;
    uvec2 inside = texel - tile * side;
    uint at = day_texel(number, inside);
    if (at == NONE) return NO_LIGHT;
    DaySums of_sun = DaySums(vec3(0.0), vec3(0.0), 0u);
    if (FRAMES == 0u) {
        add_layer(of_sun, number, 0u, at, inside, LOGARITHMS != 0u ? second : 0u);
    } else {
        uint i = tiles[number].first_texel + at;
        uint word = 3u * i / 2u;
        if (FRAMES > 1u) of_sun.first = weights.x * frame_value(frame_0[word], frame_0[word + 1u], i);
        if (FRAMES > 2u) {
            vec3 next = weights.y * frame_value(frame_1[word], frame_1[word + 1u], i);
            if (LOGARITHMS != 0u) of_sun.second = next; else of_sun.first += next;
        }
        if (FRAMES > 3u) of_sun.first += weights.z * frame_value(frame_2[word], frame_2[word + 1u], i);
        if (FRAMES > 4u) of_sun.first += weights.w * frame_value(frame_3[word], frame_3[word + 1u], i);
        of_sun.first *= sun;
        of_sun.second *= sun;
        of_sun.fetches = FRAMES - 1u;
    }
    DaySums of_sky = DaySums(vec3(0.0), vec3(0.0), 0u);
    add_layer(of_sky, number, 1u, at, inside, 0u);
    add_layer(of_sky, number, 2u, at, inside, 0u);
    fetched += of_sun.fetches + of_sky.fetches;
    return TexelLight(of_sun.first, of_sun.second, of_sky.first, 1.0);
}

void add(inout TexelLight sum, TexelLight light, float weight) {
    sum.first += weight * light.first;
    sum.second += weight * light.second;
    sum.rest += weight * light.rest;
    sum.there += weight * light.there;
}

TexelLight mean(TexelLight sum) {
    float scale = sum.there > 0.0 ? 1.0 / sum.there : 0.0;
    return TexelLight(sum.first * scale, sum.second * scale, sum.rest * scale, sum.there);
}

// The light of a texel of the lightmap; none beyond its borders.
TexelLight lightmap_texel(ivec2 texel) {
    bool inside = all(greaterThanEqual(texel, ivec2(0))) && all(lessThan(uvec2(texel), texels));
    return inside ? texel_light(uvec2(texel)) : NO_LIGHT;
}

// The value beyond `near` on the line through `far`, at least half of `near` and at most twice as much.
vec3 beyond(vec3 near, vec3 far) {
    return clamp(2.0 * near - far, min(0.5 * near, 2.0 * near), max(0.5 * near, 2.0 * near));
}

// Adds the light of a corner that is on no surface, beyond the corner `near`. `by`: from it to `near`, texels.
void add_beyond(inout TexelLight sum, TexelLight near, ivec2 texel, ivec2 by, float weight) {
    if (near.there <= 0.0) return;
    TexelLight far = lightmap_texel(texel + 2 * by);
    if (far.there > 0.0) {
        near.first = beyond(near.first, far.first);
        near.second = beyond(near.second, far.second);
        near.rest = beyond(near.rest, far.rest);
    }
    add(sum, near, weight);
}

// Bilinear between texels. Charts end between texels: the light of those beyond continues that of the last two, else a seam would be seen. Texels of
// other charts are farther away than two texels.
TexelLight lightmap_light(vec2 place) {
    vec2 corner = floor(place - 0.5);
    vec2 f = place - 0.5 - corner;
    float weights[4] = { (1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y };
    TexelLight lights[4];
    TexelLight sum = NO_LIGHT;
    float there = 0.0;
    for (uint i = 0u; i < 4u; ++i) {
        lights[i] = lightmap_texel(ivec2(corner) + ivec2(i & 1u, i >> 1u));
        there += lights[i].there;
        add(sum, lights[i], weights[i]);
    }
    if (there > 0.0 && there < 4.0) {
        for (uint i = 0u; i < 4u; ++i) {
            if (lights[i].there > 0.0) continue;
            ivec2 step = ivec2(i & 1u, i >> 1u);
            ivec2 texel = ivec2(corner) + step;
            TexelLight across = lights[i ^ 1u];
            TexelLight down = lights[i ^ 2u];
            float share = weights[i] / max(across.there + down.there, 1.0);
            add_beyond(sum, across, texel, ivec2(1 - 2 * step.x, 0), share);
            add_beyond(sum, down, texel, ivec2(0, 1 - 2 * step.y), share);
        }
    }
    if (there == 0.0) {
        // All four are buried, as in a gap between objects that is narrower than a texel. The texels around them belong to the same chart, for charts
        // are padded by more (atlas::Settings::padding).
        for (int i = 0; i < 16; ++i) {
            ivec2 step = ivec2(i % 4 - 1, i / 4 - 1);
            if (all(equal(step & ~1, ivec2(0)))) continue;
            vec2 off = vec2(step) - f;
            add(sum, lightmap_texel(ivec2(corner) + step), 0.1 / (1.0 + dot(off, off)));
        }
    }
    return mean(sum);
}

// Adds the light of a texel of the faces with its weight: `share` as far as it shows the surface that the pixel sees at `seen` from the camera with normal
// `n`. Texels of other surfaces count only if there are no better ones.
void cube_texel(inout TexelLight sum, uint face, ivec2 at, vec3 seen, vec3 n, float share) {
    uint side_texels = texels.y;
    uvec3 texel;
    if (share <= 0.0 || !day_cube_texel(face, at, side_texels, texel)) return;
    CubeTexel there = around[texel.y * texels.x + texel.z * side_texels + texel.x];
    if (there.depth <= 0.0) return;
    vec2 centre = (vec2(texel.xy) + 0.5) / float(side_texels);
    float texel_size = 2.0 * length(seen) / float(side_texels);
    float off = dot(n, there.depth * day_cube_direction(texel.z, centre) - seen) / texel_size;
    float alike = exp(-2.0 * off * off) * pow(max(dot(n, octahedral_decode(unpackSnorm2x16(there.normal))), 0.0), 4.0);
    add(sum, texel_light(uvec2(texel.z * side_texels + texel.x, texel.y)), share * max(alike, 1e-4));
}

// Bilinear between the texels of the faces in the direction of a pixel that sees a surface with normal `n` at `seen` from the camera.
TexelLight cube_light(vec3 seen, vec3 n) {
    vec2 place;
    uint face = day_cube_face(seen, place);
    vec2 at = place * float(texels.y) - 0.5;
    ivec2 corner = ivec2(floor(at));
    vec2 f = at - floor(at);
    TexelLight sum = NO_LIGHT;
    for (int i = 0; i < 4; ++i) {
        ivec2 step = ivec2(i & 1, i >> 1);
        float share = (step.x == 1 ? f.x : 1.0 - f.x) * (step.y == 1 ? f.y : 1.0 - f.y);
        cube_texel(sum, face, corner + step, seen, n, share);
    }
    if (sum.there < 0.01) {
        // None of them shows the surface, as on things thinner than a texel: farther texels may.
        for (int i = 0; i < 36; ++i) {
            vec2 step = vec2(i % 6 - 2, i / 6 - 2);
            cube_texel(sum, face, corner + ivec2(step), seen, n, 0.1 / (1.0 + dot(step - f, step - f)));
        }
    }
    return mean(sum);
}

// The irradiance of a pixel, W/m².
vec3 irradiance_of(TexelLight light) {
    if (LOGARITHMS == 0u) return max(light.first + light.rest, vec3(0.0));
    vec3 least = max(DARKEST * sun, vec3(1e-30));
    vec3 first = max(light.first, vec3(0.0)) + least;
    vec3 second = max(light.second, vec3(0.0)) + least;
    return max(exp(mix(log(first), log(second), alpha)) - least + light.rest, vec3(0.0));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(total)))) return;
    vec4 shown = texelFetch(direct, pixel, 0);
    if (texelFetch(depth, pixel, 0).r >= 1.0) {
        imageStore(total, pixel, vec4(shown.rgb, 0.0));
        imageStore(indirect, pixel, vec4(0.0));
        imageStore(irradiance, pixel, vec4(0.0));
        return;
    }
    vec3 position = world_from_depth(view, (vec2(pixel) + 0.5) / view.extent, texelFetch(depth, pixel, 0).r);
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    TexelLight light = NO_LIGHT;
    if (TEXELS_OF == DAY_VIEW) {
        light = texel_light(uvec2(pixel));
    } else if (TEXELS_OF == DAY_CUBE) {
        light = cube_light(position - view.position, n);
    } else {
        vec2 place = texelFetch(places, pixel, 0).xy;
        if (place.x >= 0.0) light = lightmap_light(place);
    }
    vec3 e = light.there > 0.0 ? irradiance_of(light) : vec3(0.0);
    if (fetched > 0u) atomicAdd(fetches[(gl_WorkGroupID.x + 7u * gl_WorkGroupID.y) & 255u], fetched);
    float cosine = dot(n, to_camera(view, position));
    DayShares shares = day_shares(texelFetch(albedo, pixel, 0), texelFetch(specular, pixel, 0), cosine, REFLECTS);
    // The directions of this light are not known: probe_light.comp follows where there are probes.
    vec3 bounced = (shares.matt + shares.shine) * e / 3.14159265358979;
    imageStore(total, pixel, vec4(shown.rgb + bounced, 1.0));
    imageStore(indirect, pixel, vec4(bounced, 1.0));
    imageStore(irradiance, pixel, vec4(e, 1.0));
}
