// Rays to the sun of baked daylight.
// Before including: lib/sampling.glsl, lib/random.glsl, daylight/daylight.glsl.

struct DaySunRay {
    vec3 direction;  // unit
    float far;       // distance to the sun, metres
    float strength;  // irradiance at normal incidence, W/m²
};

// A place on the disc of the sun in the units of its direction, the same at all times. `radius`: tangent of its angular radius.
vec2 day_sun_disc(uvec2 words, float radius) {
    return radius * sample_disc(unit_floats(words));
}

// The ray from a point to a place on the disc of the sun. `disc`: in tangents of the angle from the centre of the sun; a sun that is a point has no disc.
DaySunRay day_sun_ray(vec3 from, DaySun sun, vec2 disc) {
    if (sun.intensity > 0.0) {
        vec3 way = sun.toward - from;
        float far = length(way);
        return DaySunRay(way / far, far, sun.intensity / (far * far));
    }
    return DaySunRay(normalize(sun.toward + sun.right * disc.x + sun.up * disc.y), 1e30, 1.0);
}
