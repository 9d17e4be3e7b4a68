// Blends this frame's irradiance with the average of the frames before, where the same surface was visible (reprojection, Nehab et al.
// 2007). The less its light has changed, the more the average counts.
//
// All pixels share the virtual lights and so have correlated errors: the neighbours of a pixel cannot tell noise from a change of the
// light. Probes can. At the probes the light of the last frame's paths is gathered twice, in the last frame and in this one, with the same
// random numbers; a difference is a change of the light (Schied, Peters and Dachsbacher 2018, for path tracing). Continuous change, for
// example from a moving lamp, is smoothed over time, and the average is extrapolated by it (as in Holt's and the alpha-beta filter).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "lib/reproject.glsl"
#include "igi/history.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1, scalar) readonly buffer Before { HistoryFrame before[]; };
layout(binding = 2) uniform sampler2D normal;
layout(binding = 3) uniform sampler2D depth;
layout(binding = 4) uniform sampler2D motion;     // from passes/motion.frag; w 0: the surface did not move
layout(binding = 5) uniform sampler2D irradiance; // of this frame only
layout(binding = 6) uniform sampler2D old;        // average of the frames before; a: number of frames in it
layout(binding = 7) uniform sampler2D old_guide;  // xyz: unit normal; w: linear depth / far
layout(binding = 8, scalar) readonly buffer Probes { HistoryProbe probes[]; }; // from the last frame
layout(binding = 9, scalar) readonly buffer Lit { vec4 lit[]; };               // light of the last frame's paths in the last frame
layout(binding = 10, scalar) readonly buffer Relit { vec4 relit[]; };          // light of the last frame's paths in this frame
layout(binding = 11, rgba32f) uniform writeonly image2D blended;
layout(binding = 12, rgba32f) uniform writeonly image2D guide;
layout(binding = 13) uniform sampler2D old_trend; // rgb: smoothed relative change per frame; a: its smoothed magnitude
layout(binding = 14, rgba32f) uniform writeonly image2D trend;

layout(push_constant, scalar) uniform Push {
    uint frame;
    uint columns; // of probes
    uint rows;
    uint side;    // pixels from probe to probe
    float most;   // maximum of frames in the average
    float lag;    // relative error that is allowed because the average lags behind
    float range;  // maximum distance from the old surface, relative to its depth
};

// Probes that are read on each side.
const int REACH = 2;
// A smaller relative change is rounding.
const float REST = 1e-4;
// Weight of one frame in the smoothed change.
const float TURN = 0.125;
// A change that is this many times larger than its smoothed magnitude is sudden, and the trend does not predict it.
const float SUDDEN = 3.0;
// Part of the change that the trend does not predict, because the trend is an average and light changes unevenly.
const float UNEXPLAINED = 0.35;

// Average irradiance and frame count at the surface point that had world position `was` in the last frame; count 0: the point was not
// visible. `at`: its pixel in the last frame. `going`: its trend.
vec4 reproject(vec3 was, vec3 n, out vec2 at, out vec4 going) {
    View then = before[0].view;
    at = vec2(0.0);
    going = vec4(0.0);
    if (before[0].next != frame || then.far <= 0.0) return vec4(0.0);
    ivec2 size = textureSize(old, 0);
    if (!last_place(then, vec4(was, 1.0), size, at)) return vec4(0.0);
    at = settled(at);
    float near = plane_range(then, was, range);
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
        if (value.a <= 0.0 || !same_surface(then, texel, there, was, n, near)) continue;
        sum += weight * value;
        goings += weight * texelFetch(old_trend, texel, 0);
        weights += weight;
    }
    if (weights <= 0.01) return vec4(0.0);
    going = goings / weights;
    return sum / weights;
}

// Relative change of the light around a pixel of the last frame: rgb with sign, a its magnitude.
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
            // If the light drifts by d per frame and the frame has the weight s, the average lags by d (1 - s) / s. This weight limits the
            // lag to lag (1 - d).
            share = max(share, drift / (drift + lag * (1.0 - drift)));
        }
    }
    vec3 fresh = texelFetch(irradiance, pixel, 0).rgb;
    imageStore(blended, pixel, vec4(past.a > 0.0 ? mix(past.rgb, fresh, share) : fresh, min(1.0 / share, most)));
    imageStore(guide, pixel, vec4(n, z));
    imageStore(trend, pixel, goes);
}
