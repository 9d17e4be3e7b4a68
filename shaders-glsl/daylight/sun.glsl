// Light of the sun along one path.
// Before including: lib/sampling.glsl, daylight/daylight.glsl, daylight/sun_ray.glsl, lib/trace.glsl, and the blocks `settings`, `vertices`,
// `counts` and `bits`. A group of invocations has DAY_TIMES times.

// 1: masks say from where the sun is seen. 0: a shadow ray from each vertex finds it.
layout(constant_id = 0) const uint MASKS = 0;

// Russian roulette of shadow rays. A vertex costs a ray for each time of the day. Where a vertex's share times its cosine at the
// sun is below this value, a ray is sent with a probability: late vertices carry little light, and so do surfaces that the sun grazes.
const float SHADOW_ROULETTE = 0.3;

// Light by the sun for 1 W/m² at normal incidence. `sun`: as for day_sun_ray(). `around`: sun_frame(sun).
vec3 day_sun(uint path, uint of_bake, uint number, uint time, vec4 sun, mat3 around) {
    vec3 sum = vec3(0.0);
    for (uint k = 0u; k < counts[path]; ++k) {
        uint at = path * DAY_VERTICES + k;
        uint seen = 0xffffffffu;
        // The word of a group is the same for all its invocations: CPU drivers load it once, and skip vertices that the sun does not reach.
        if (MASKS != 0u) seen = bits[vertices[at].side * settings.mask_words + gl_WorkGroupID.x];
        if (seen == 0u) continue;
        DayVertex vertex = vertices[at];
        uvec4 hash = pcg4d(uvec4(of_bake, number, k, settings.seed ^ 0x5bd1e995u));
        // Points of masks have places on the disc of their own.
        vec2 disc = MASKS != 0u ? vec2(0.0) : day_sun_disc(hash.xy, settings.sun_radius);
        DaySunRay ray = day_sun_ray(vertex.position, sun, around, disc);
        float cosine = dot(vertex.normal, ray.direction);
        if (cosine <= 0.0 || dot(vertex.geometric, ray.direction) <= 0.0) continue;
        float stay = 1.0;
        if (MASKS != 0u) {
            if ((seen >> (time & 31u) & 1u) == 0u) continue;
        } else {
            stay = min(vertex.share * cosine / SHADOW_ROULETTE, 1.0);
            // All times have one number, so that neighbouring rays stay together.
            if (unit_float(hash.w) >= stay) continue;
            if (trace_any(Ray(vertex.position, 0.0, ray.direction, ray.far), TRACE_SHADOW, hash.z)) continue;
        }
        sum += vertex.weight * (ray.strength * cosine / stay);
    }
    return sum;
}
