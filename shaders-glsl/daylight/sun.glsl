// Light of the sun along one path.
// Before including: lib/sampling.glsl, daylight/daylight.glsl, daylight/sun_ray.glsl, lib/trace.glsl, and the blocks `settings`, `vertices`,
// `counts` and `bits`.

// 1: masks say from where the sun is seen. 0: a shadow ray from each vertex finds it.
layout(constant_id = 0) const uint MASKS = 0;

// Light by the sun for 1 W/m² at normal incidence. `sun`: as for day_sun_ray(). `around`: sun_frame(sun).
vec3 day_sun(uint path, uint of_bake, uint number, uint time, vec4 sun, mat3 around) {
    vec3 sum = vec3(0.0);
    for (uint k = 0u; k < counts[path]; ++k) {
        DayVertex vertex = vertices[path * DAY_VERTICES + k];
        if (vertex.sun == 0.0) continue;
        uvec4 hash = pcg4d(uvec4(of_bake, number, k, settings.seed ^ 0x5bd1e995u));
        // Points of masks have places on the disc of their own.
        vec2 disc = MASKS != 0u ? vec2(0.0) : day_sun_disc(hash.xy, settings.sun_radius);
        DaySunRay ray = day_sun_ray(vertex.position, sun, around, disc);
        float cosine = dot(vertex.normal, ray.direction);
        if (cosine <= 0.0 || dot(vertex.geometric, ray.direction) <= 0.0) continue;
        bool seen;
        if (MASKS != 0u) seen = (bits[vertex.side * settings.mask_words + (time >> 5u)] >> (time & 31u) & 1u) != 0u;
        else seen = !trace_any(Ray(vertex.position, 0.0, ray.direction, ray.far), TRACE_SHADOW, hash.z);
        if (seen) sum += vertex.weight * (vertex.sun * ray.strength * cosine);
    }
    return sum;
}
