// The arithmetic of temporal anti-aliasing.
#ifndef PASSES_TEMPORAL
#define PASSES_TEMPORAL

// Half width of the range of colours, in standard deviations of the pixels around (Salvi 2016).
const float AROUND = 0.75;
// The same, in swings from frame to frame.
const float OVER_TIME = 4.0;

// Luma and two differences of colours, an orthogonal basis in which ranges of colours are narrow (Malvar and Sullivan 2003).
vec3 ycocg_of(vec3 rgb) {
    return vec3(dot(rgb, vec3(0.25, 0.5, 0.25)), dot(rgb, vec3(0.5, 0.0, -0.5)), dot(rgb, vec3(-0.25, 0.5, -0.25)));
}

vec3 rgb_of(vec3 c) {
    float t = c.x - c.z;
    return vec3(t + c.y, c.x + c.z, t - c.y);
}

// How many times farther than the border of the range a colour lies from its middle; up to 1: inside.
float beyond(vec3 color, vec3 middle, vec3 half_width) {
    vec3 off = abs(color - middle) / half_width;
    return max(max(off.x, off.y), off.z);
}

// Weights of the four texels around a place between the two in the middle, `t` from the second one on (Catmull and Rom 1974).
vec4 catmull_rom(float t) {
    float t2 = t * t, t3 = t2 * t;
    return vec4(-0.5 * t3 + t2 - 0.5 * t, 1.5 * t3 - 2.5 * t2 + 1.0, -1.5 * t3 + 2.0 * t2 + 0.5 * t, 0.5 * t3 - 0.5 * t2);
}

#endif
