// Shadow rays to the sun of baked daylight.
// Before including: lib/sampling.glsl, lib/random.glsl.

struct DaySunRay {
    vec3 direction;  // unit
    float far;       // distance to the sun, metres
    float strength;  // irradiance at normal incidence, W/m²
};

// A place on the disc of the sun in the units of its direction, the same at all times. `radius`: tangent of its angular radius.
vec2 day_sun_disc(uvec2 words, float radius) {
    return radius * sample_disc(unit_floats(words));
}

// The axes around the direction of a sun.
mat3 sun_frame(vec4 sun) {
    return frame_around(sun.w > 0.0 ? vec3(0.0, 1.0, 0.0) : sun.xyz);
}

// `sun`: direction and 0, or place of a sun that is a point and the square of the distance at which it has 1 W/m². `around`: sun_frame(sun).
DaySunRay day_sun_ray(vec3 from, vec4 sun, mat3 around, vec2 disc) {
    if (sun.w > 0.0) {
        vec3 way = sun.xyz - from;
        float far = length(way);
        return DaySunRay(way / far, far, sun.w / (far * far));
    }
    return DaySunRay(normalize(sun.xyz + around[0] * disc.x + around[1] * disc.y), 1e30, 1.0);
}
