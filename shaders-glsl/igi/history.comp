// The irradiance of this frame blended with that of the frames before, where the same surface was seen (reprojection, Nehab et al.
// 2007) and as far as its light has stayed what it was. Virtual lights are the same for all pixels, and so are their errors: a pixel's
// neighbours cannot tell chance from change. Probes can: at them the light of the last frame's paths was gathered twice, then and now,
// and what differs has changed (Schied, Peters and Dachsbacher 2018, for path tracing). Change that goes on, as of a lamp that moves, is
// smoothed over time and the past carried along with it (as in Holt's and the alpha-beta filter).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "lib/igi_history.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1, scalar) readonly buffer Before { HistoryFrame before[]; };
layout(binding = 2) uniform sampler2D normal;
layout(binding = 3) uniform sampler2D depth;
layout(binding = 4) uniform sampler2D motion;     // of igi/motion.frag; w 0: the surface rests
layout(binding = 5) uniform sampler2D irradiance; // of this frame alone
layout(binding = 6) uniform sampler2D old;        // of the frames before; a: how many they count
layout(binding = 7) uniform sampler2D old_guide;  // xyz: unit normal; w: linear depth / far
layout(binding = 8, scalar) readonly buffer Probes { HistoryProbe probes[]; }; // of the last frame
layout(binding = 9, scalar) readonly buffer Lit { vec4 lit[]; };               // by its paths, then
layout(binding = 10, scalar) readonly buffer Relit { vec4 relit[]; };          // by its paths, now
layout(binding = 11, rgba32f) uniform writeonly image2D blended;
layout(binding = 12, rgba32f) uniform writeonly image2D guide;
layout(binding = 13) uniform sampler2D old_trend; // rgb: relative change a frame, smoothed; a: how large it has been
layout(binding = 14, rgba32f) uniform writeonly image2D trend;

layout(push_constant, scalar) uniform Push {
    uint frame;
    uint columns; // of probes
    uint rows;
    uint side;    // pixels from probe to probe
    float most;   // frames that count at most
    float lag;    // relative error that light may have because it changes
    float range;  // distance from a surface relative to its depth within which it is the same
};

// Least cosine between the normals of one surface in two frames.
const float ALIKE = 0.9;
// Probes to each side.
const int REACH = 2;
// Relative change below which light rests: rounding.
const float REST = 1e-4;
// Share of a frame in the smoothed change.
const float TURN = 0.125;
// Change so many times as large as it has been is sudden: no trend explains it.
const float SUDDEN = 3.0;
// Of a trend, that which it does not explain: it is an average, and light does not change evenly.
const float UNEXPLAINED = 0.35;

// Irradiance and count of the frames before at the place that had world position `was`; count 0: it was not seen. `at`: its pixel.
vec4 reproject(vec3 was, vec3 n, out vec2 at, out vec4 going) {
    View then = before[0].view;
    at = vec2(0.0);
    going = vec4(0.0);
    if (before[0].next != frame || then.far <= 0.0) return vec4(0.0);
    vec4 clip = then.clip_from_world * vec4(was, 1.0);
    if (clip.w <= 0.0) return vec4(0.0);
    ivec2 size = textureSize(old, 0);
    at = (vec2(0.5) + vec2(0.5, -0.5) * clip.xy / clip.w) * vec2(size) - 0.5;
    if (any(lessThan(at, vec2(-1.0))) || any(greaterThan(at, vec2(size)))) return vec4(0.0);
    // Where nothing moves, rounding must not blur.
    vec2 whole = floor(at + 0.5);
    if (all(lessThan(abs(at - whole), vec2(2e-3)))) at = whole;
    float near = range * (then.orthographic != 0u ? then.far : depth_of(then, was) * then.far);
    ivec2 corner = ivec2(floor(at));
    vec2 part = at - vec2(corner);
    vec4 sum = vec4(0.0), goings = vec4(0.0);
    float weights = 0.0;
    for (int i = 0; i < 4; ++i) {
        ivec2 next = ivec2(i & 1, i >> 1);
        ivec2 texel = corner + next;
        vec2 share = mix(1.0 - part, part, vec2(next));
        float weight = share.x * share.y;
        if (weight <= 0.0 || any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, size))) continue;
        vec4 there = texelFetch(old_guide, texel, 0);
        vec4 value = texelFetch(old, texel, 0);
        if (there.w >= 1.0 || value.a <= 0.0 || dot(there.xyz, n) < ALIKE) continue;
        if (abs(dot(there.xyz, screen_position(then, texel, 1.0, there.w) - was)) > near) continue;
        sum += weight * value;
        goings += weight * texelFetch(old_trend, texel, 0);
        weights += weight;
    }
    if (weights <= 0.01) return vec4(0.0);
    going = goings / weights;
    return sum / weights;
}

// By how much, relatively, the light around a pixel of the last frame has changed: rgb with its sign, a without.
vec4 change(vec2 at, vec3 n) {
    vec2 place = (at + 0.5) / float(side) - 0.5;
    ivec2 middle = ivec2(floor(place + 0.5));
    vec3 growth = vec3(0.0), light = vec3(0.0);
    float apart = 0.0;
    for (int y = max(middle.y - REACH, 0); y <= min(middle.y + REACH, int(rows) - 1); ++y) {
        for (int x = max(middle.x - REACH, 0); x <= min(middle.x + REACH, int(columns) - 1); ++x) {
            int i = y * int(columns) + x;
            if (probes[i].there == 0u) continue;
            vec2 off = vec2(x, y) - place;
            float weight = exp2(-0.72134752 * dot(off, off)) * (0.1 + 0.9 * max(dot(n, probes[i].normal), 0.0));
            vec3 was = lit[i].rgb, is = relit[i].rgb;
            apart += weight * dot(abs(is - was), vec3(1.0));
            growth += weight * (is - was);
            light += weight * max(is, was);
        }
    }
    return vec4(growth / max(light, vec3(1e-30)), apart / max(dot(light, vec3(1.0)), 1e-30));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(blended)))) return;
    float z = texelFetch(depth, pixel, 0).r;
    if (z >= 1.0) {
        imageStore(blended, pixel, vec4(0.0));
        imageStore(guide, pixel, vec4(0.0, 0.0, 0.0, 1.0));
        imageStore(trend, pixel, vec4(0.0));
        return;
    }
    vec3 n = decode_normal(texelFetch(normal, pixel, 0));
    vec4 moved = texelFetch(motion, pixel, 0);
    vec3 was = moved.w > 0.0 ? moved.xyz : screen_position(view, pixel, 1.0, z);
    vec2 at;
    vec4 going;
    vec4 past = reproject(was, n, at, going);
    vec4 goes = vec4(0.0);
    float share = 1.0 / min(past.a + 1.0, most);
    if (past.a > 0.0) {
        vec4 changed = change(at, n);
        if (changed.a > REST) {
            goes = mix(going, changed, TURN);
            float drift = changed.a;
            if (changed.a <= SUDDEN * going.a) {
                vec3 factor = clamp(goes.rgb, vec3(-0.5), vec3(0.5));
                past.rgb *= mix(1.0 + factor, 1.0 / (1.0 - factor), greaterThan(factor, vec3(0.0)));
                drift = UNEXPLAINED * max(max(abs(factor.r), abs(factor.g)), abs(factor.b));
            }
            // Light that drifts by d a frame and is blended with share s lags by d (1 - s) / s: lag (1 - d) with this share.
            share = max(share, drift / (drift + lag * (1.0 - drift)));
        }
    }
    vec3 fresh = texelFetch(irradiance, pixel, 0).rgb;
    imageStore(blended, pixel, vec4(past.a > 0.0 ? mix(past.rgb, fresh, share) : fresh, min(1.0 / share, most)));
    imageStore(guide, pixel, vec4(n, z));
    imageStore(trend, pixel, goes);
}
