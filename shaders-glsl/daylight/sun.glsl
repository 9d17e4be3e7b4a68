// Light of the sun along one path.
// Before including: lib/sampling.glsl, daylight/daylight.glsl, daylight/sun_ray.glsl, daylight/sun_roulette.glsl, and the blocks `settings`,
// `vertices`, `counts` and `bits`. A group of invocations has DAY_TIMES times.

// Light by the sun for 1 W/m² at normal incidence. `of_bake`: number of the receiver in the whole bake; `number`: of its path.
vec3 day_sun(uint path, uint of_bake, uint number, uint time, DaySun sun) {
    bool masks = (settings.flags & DAY_SUN_MASKS) != 0u;
    vec3 sum = vec3(0.0);
    for (uint k = 0u; k < counts[path]; ++k) {
        uint at = path * DAY_VERTICES + k;
        // The word of a group is the same for all its invocations: CPU drivers load it once, and skip vertices that the sun does not reach.
        uint seen = bits[(masks ? vertices[at].side : at) * day_words(settings) + gl_WorkGroupID.x];
        if ((seen >> time % DAY_TIMES & 1u) == 0u) continue;
        DayVertex vertex = vertices[at];
        vec2 disc = vec2(0.0);
        float stay = 1.0;
        // Points of masks have places on the disc of their own.
        if (!masks) {
            disc = sun_choice(of_bake, number, k).disc;
            stay = sun_stay(vertex, sun);
        }
        DaySunRay ray = day_sun_ray(vertex.position, sun, disc);
        float cosine = dot(vertex.normal, ray.direction);
        if (cosine <= 0.0 || dot(vertex.geometric, ray.direction) <= 0.0) continue;
        sum += vertex.weight * (ray.strength * cosine / stay);
    }
    return sum;
}
