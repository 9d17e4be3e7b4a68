// Light of the sun along one path.
// Before including: lib/sampling.glsl, daylight/daylight.glsl, daylight/sun_ray.glsl, daylight/sun_roulette.glsl, and the blocks `settings`,
// `vertices`, `counts` and `bits`. A group of invocations has DAY_TIMES times.

// Light by the sun for 1 W/m² at normal incidence.
vec3 day_sun(uint path, uint of_bake, uint number, uint time, DaySun sun) {
    bool masks = (settings.flags & DAY_SUN_MASKS) != 0u;
    vec3 sum = vec3(0.0);
    for (uint k = 0u; k < counts[path]; ++k) {
        uint at = path * DAY_VERTICES + k;
        // The word of a group is the same for all its invocations: CPU drivers load it once, and skip vertices that the sun does not reach.
        uint seen = bits[(masks ? vertices[at].side : at) * settings.words + gl_WorkGroupID.x];
        if (seen == 0u) continue;
        DayVertex vertex = vertices[at];
        DaySunChoice choice = sun_choice(of_bake, number, k);
        // Points of masks have places on the disc of their own.
        DaySunRay ray = day_sun_ray(vertex.position, sun, masks ? vec2(0.0) : choice.disc);
        float cosine = dot(vertex.normal, ray.direction);
        if ((seen >> (time & 31u) & 1u) == 0u || cosine <= 0.0 || dot(vertex.geometric, ray.direction) <= 0.0) continue;
        sum += vertex.weight * (ray.strength * cosine / (masks ? 1.0 : sun_stay(vertex, sun)));
    }
    return sum;
}
