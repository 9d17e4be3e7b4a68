// The random choices of the shadow rays from a vertex, which are the same for all times.
// Before including: lib/random.glsl, daylight/daylight.glsl, daylight/sun_ray.glsl, and the block `settings`.

// Russian roulette of shadow rays. A vertex costs a ray for each time of the day. Where a vertex's share times its cosine at the
// sun is below this value, a ray is sent with a probability: late vertices carry little light, and so do surfaces that the sun grazes.
const float SHADOW_ROULETTE = 0.3;

struct DaySunChoice {
    vec2 disc;      // place on the disc of the sun
    float number;   // of the roulette
    uint salt;      // of the rays
};

// `of_bake`: number of the receiver in the whole bake; `number`: of its path; `k`: of the vertex.
DaySunChoice sun_choice(uint of_bake, uint number, uint k) {
    uvec4 hash = pcg4d(uvec4(of_bake, number, k, settings.seed ^ 0x5bd1e995u));
    return DaySunChoice(day_sun_disc(hash.xy, settings.sun_radius), unit_float(hash.w), hash.z);
}

// The probability with which a vertex sends a ray. It follows the centre of the sun, and it is above 0 for each place of the disc that is before the
// surface.
float sun_stay(DayVertex vertex, DaySun sun) {
    vec3 toward = day_sun_ray(vertex.position, sun, vec2(0.0)).direction;
    float cosine = dot(vertex.normal, toward) + settings.sun_radius;
    if (dot(vertex.geometric, toward) + settings.sun_radius <= 0.0) return 0.0;
    return min(vertex.share * cosine / SHADOW_ROULETTE, 1.0);
}
