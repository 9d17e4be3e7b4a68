// Light of the sun along one path.
// Before including: lib/trace.glsl, lib/sampling.glsl, daylight/daylight.glsl, and the blocks `settings`, `vertices` and `counts`.

// Light by the sun in the direction `sun`, for 1 W/m² at normal incidence: a shadow ray from each vertex. `around`: frame_around(sun).
vec3 day_sun(uint path, uint of_bake, uint number, vec3 sun, mat3 around) {
    vec3 sum = vec3(0.0);
    for (uint k = 0u; k < counts[path]; ++k) {
        DayVertex vertex = vertices[path * DAY_VERTICES + k];
        uvec4 hash = pcg4d(uvec4(of_bake, number, k, settings.seed ^ 0x5bd1e995u));
        // The same place on the disc at all times.
        vec2 disc = settings.sun_radius * sample_disc(unit_floats(hash.xy));
        vec3 direction = normalize(sun + around[0] * disc.x + around[1] * disc.y);
        float cosine = dot(vertex.normal, direction);
        if (cosine <= 0.0 || dot(vertex.geometric, direction) <= 0.0) continue;
        if (!trace_any(Ray(vertex.position, 0.0, direction, 1e30), TRACE_SHADOW, hash.z)) sum += vertex.weight * cosine;
    }
    return sum;
}
