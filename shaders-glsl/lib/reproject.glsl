// Where surfaces were in the last frame (reprojection, Nehab et al. 2007). Before including: lib/view.glsl, lib/screen.glsl.
#ifndef LIB_REPROJECT
#define LIB_REPROJECT

// The frame that wrote a history.
struct HistoryFrame {
    View view;
    uint next;  // number of the next frame
    vec2 shift; // where its pixels looked, from their middles to the right and down, pixels
};

// Minimum cosine between the normals of the same surface in two frames.
const float ALIKE = 0.9;

// Place in the image of the last frame, in texels (0: the middle of the first one), of a point with w 1 or of a direction with w 0. False if
// it lies behind the camera or more than a texel outside.
bool last_place(View then, vec4 was, ivec2 size, out vec2 at) {
    at = vec2(0.0);
    vec4 clip = then.clip_from_world * was;
    if (clip.w <= 0.0) return false;
    at = (vec2(0.5) + vec2(0.5, -0.5) * clip.xy / clip.w) * vec2(size) - 0.5;
    return all(greaterThanEqual(at, vec2(-1.0))) && all(lessThanEqual(at, vec2(size)));
}

// A place next to the middle of a texel becomes the middle: without motion, rounding would interpolate between texels and blur the average.
vec2 settled(vec2 at) {
    vec2 whole = floor(at + 0.5);
    return all(lessThan(abs(at - whole), vec2(2e-3))) ? whole : at;
}

// Maximum distance of a point from a surface that counts as its own, metres. `range`: relative to its depth.
float plane_range(View then, vec3 was, float range) {
    return range * (then.orthographic != 0u ? then.far : depth_of(then, was) * then.far);
}

// Whether a texel of the last frame shows the surface of normal n on which the point lay. `there`: its normal; w: its linear depth / far.
bool same_surface(View then, ivec2 texel, vec4 there, vec3 was, vec3 n, float near) {
    if (there.w >= 1.0 || dot(there.xyz, n) < ALIKE) return false;
    return abs(dot(there.xyz, screen_position(then, texel, 1.0, there.w) - was)) <= near;
}

#endif
