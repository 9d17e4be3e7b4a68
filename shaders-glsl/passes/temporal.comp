// Temporal anti-aliasing: each frame looks at another place of each pixel, and the picture is the average over time (Yang, Liu and Salvi 2020,
// a survey). Each pixel finds its surface in the last frame. It takes over the average from there unless another surface hid it, and limits
// it to the range of colours that this frame shows around the pixel (Karis 2014; variance clipping, Salvi 2016).
//
// A wire that is thinner than a pixel is missing in most frames, and so is its colour in the range. The range is therefore also as wide as
// the pixel swings from frame to frame: a step that takes back the step before it is a swing. Objects and shadows that pass swing a
// little with their edges, and must not widen the range: near what moves swings do not count, and on one surface they count little.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "lib/reproject.glsl"
#include "passes/temporal.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1, scalar) readonly buffer Before { HistoryFrame before[]; };
layout(binding = 2) uniform sampler2D normal;
layout(binding = 3) uniform sampler2D depth;
layout(binding = 4) uniform sampler2D motion;     // from passes/motion.frag; w 0: the surface did not move
layout(binding = 5) uniform sampler2D fresh;      // radiance of this frame
layout(binding = 6) uniform sampler2D old;        // average of the frames before; a: number of frames in it
layout(binding = 7) uniform sampler2D old_guide;  // xyz: unit normal; w: linear depth / far
layout(binding = 8) uniform sampler2D old_fresh;  // radiance of the last frame, YCoCg; a: its luma less that of the frame before
layout(binding = 9) uniform sampler2D old_swing;  // how far the radiance swings from frame to frame, YCoCg
layout(binding = 10, rgba32f) uniform writeonly image2D blended;
layout(binding = 11, rgba32f) uniform writeonly image2D guide;
layout(binding = 12, rgba16f) uniform writeonly image2D kept;
layout(binding = 13, rgba16f) uniform writeonly image2D swings;

layout(push_constant, scalar) uniform Push {
    uint frame;
    float most; // maximum of frames in the average
    vec2 shift; // where the pixels look, from their middles to the right and down, pixels
};

// Maximum distance from the old surface, relative to its depth.
const float RANGE = 0.02;
// Weight of a swing of the same surface.
const float SHADED = 0.0625;
// Maximum distance from the old surface of what a pixel shows, relative to its depth.
const float CLOSE = 0.001;
// A smaller difference, relative to the light, is no change.
const float REST = 0.02;
// Largest value of a 16-bit float.
const float LARGEST = 65504.0;

// Whether the last frame showed the surface of normal n at `was` near texel `at` of its image, or something behind it.
bool was_visible(View then, ivec2 at, ivec2 size, bool sky, vec3 was, vec3 n) {
    float near = plane_range(then, was, RANGE);
    float behind = depth_of(then, was) * (1.0 + RANGE);
    for (int i = 0; i < 9; ++i) {
        ivec2 texel = at + ivec2(i % 3, i / 3) - 1;
        if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, size))) continue;
        vec4 there = texelFetch(old_guide, texel, 0);
        if (there.w >= 1.0) return true;
        if (sky) continue;
        // A surface thinner than a pixel appears in front of what the last frame showed.
        if (there.w > behind || same_surface(then, texel, there, was, n, near)) return true;
    }
    return false;
}

// The average at a place of the last frame, with its number of frames.
vec4 recalled(vec2 at, ivec2 size) {
    ivec2 corner = ivec2(floor(at));
    vec2 part = at - vec2(corner);
    ivec2 last = size - 1;
    if (part == vec2(0.0)) return texelFetch(old, clamp(corner, ivec2(0), last), 0);
    vec4 across = catmull_rom(part.x), down = catmull_rom(part.y);
    vec3 sum = vec3(0.0), low = vec3(1e30), high = vec3(0.0);
    float count = 1e30;
    for (int y = 0; y < 4; ++y) {
        for (int x = 0; x < 4; ++x) {
            vec4 value = texelFetch(old, clamp(corner + ivec2(x, y) - 1, ivec2(0), last), 0);
            sum += across[x] * down[y] * value.rgb;
            if (x == 0 || x == 3 || y == 0 || y == 3) continue;
            low = min(low, value.rgb);
            high = max(high, value.rgb);
            count = min(count, value.a);
        }
    }
    // Negative weights must not add light or dark beside edges.
    return vec4(clamp(sum, low, high), count);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(blended);
    if (any(greaterThanEqual(pixel, size))) return;

    vec3 own = texelFetch(fresh, pixel, 0).rgb;
    vec3 mean = vec3(0.0), square = vec3(0.0);
    float brightest = 0.0; // luma of the pixels around
    // The nearest surface in a square of pixels moves the pixel: edges of what moves keep their average (Karis 2014).
    ivec2 front = pixel;
    float z = texelFetch(depth, pixel, 0).r;
    float own_z = z;
    for (int i = 0; i < 9; ++i) {
        ivec2 texel = clamp(pixel + ivec2(i % 3, i / 3) - 1, ivec2(0), size - 1);
        vec3 color = ycocg_of(texelFetch(fresh, texel, 0).rgb);
        mean += color / 9.0;
        square += color * color / 9.0;
        if (texel != pixel) brightest = max(brightest, color.x);
        float there = texelFetch(depth, texel, 0).r;
        if (there < z) {
            z = there;
            front = texel;
        }
    }
    vec3 deviation = sqrt(max(square - mean * mean, vec3(0.0)));

    bool sky = z >= 1.0;
    vec3 n = decode_normal(texelFetch(normal, front, 0));
    vec3 own_n = decode_normal(texelFetch(normal, pixel, 0));
    vec4 moved = texelFetch(motion, front, 0);
    vec4 was = sky ? vec4(normalize(view_ray(view, screen_uv(view, front, 1.0))), 0.0)
        : vec4(moved.w > 0.0 ? moved.xyz : screen_position(view, front, 1.0, z), 1.0);
    HistoryFrame last = before[0];
    bool past = last.next == frame && last.view.far > 0.0;
    vec2 seen = vec2(front), at = vec2(pixel);
    if (past && !(sky && last.view.orthographic != 0u)) {
        past = last_place(last.view, was, size, seen);
        // The average stands at the middles of pixels, what a frame shows beside them.
        at = settled(vec2(pixel - front) + seen + last.shift - shift);
        past = past && all(greaterThan(at, vec2(-0.5))) && all(lessThan(at, vec2(size) - 0.5));
    }
    past = past && was_visible(last.view, ivec2(floor(seen + 0.5)), size, sky, was.xyz, n);

    vec3 result = own, swing = vec3(0.0), step = vec3(0.0);
    float count = 1.0;
    if (past) {
        vec4 average = recalled(at, size);
        vec3 color = ycocg_of(average.rgb);
        ivec2 nearest = clamp(ivec2(floor(at + 0.5)), ivec2(0), size - 1);
        // Edges of what moves do not swing.
        bool moves = !sky && moved.w > 0.0;
        if (!moves) swing = texelFetch(old_swing, nearest, 0).xyz;
        vec3 half_width = max(AROUND * deviation, OVER_TIME * swing) + REST * mean.x + 1e-30;
        float off = beyond(color, mean, half_width);
        count = min(average.a + 1.0, most);
        // A sample of great brightness that is alone in place and time at most doubles the light.
        float limit = most * max(brightest, color.x);
        float luma = ycocg_of(own).x;
        if (luma > limit) own *= limit / luma;
        if (off > 1.0) {
            color = mean + (color - mean) / off;
            count = max(count / off, 1.0);
            swing /= off;
        }
        vec4 last_fresh = texelFetch(old_fresh, nearest, 0);
        step = ycocg_of(own) - last_fresh.xyz;
        // The part of the step that takes back the one before. A swing without another surface may be a shadow that passes.
        vec4 there = texelFetch(old_guide, nearest, 0);
        vec3 place = screen_position(view, pixel, 1.0, own_z);
        bool same = own_z >= 1.0 ? there.w >= 1.0
            : same_surface(last.view, nearest, there, place, own_n, plane_range(last.view, place, CLOSE));
        float back = step.x * last_fresh.w < 0.0 ? min(abs(last_fresh.w / step.x), 1.0) : 0.0;
        if (same) back *= SHADED;
        swing = moves ? vec3(0.0) : sqrt(mix(swing * swing, back * step * step, 1.0 / count));
        result = max(mix(rgb_of(color), own, 1.0 / count), vec3(0.0));
    }
    imageStore(blended, pixel, vec4(result, count));
    imageStore(guide, pixel, vec4(own_z >= 1.0 ? vec3(0.0) : own_n, own_z));
    imageStore(kept, pixel, clamp(vec4(ycocg_of(own), step.x), vec4(-LARGEST), vec4(LARGEST)));
    imageStore(swings, pixel, vec4(min(swing, vec3(LARGEST)), 0.0));
}
