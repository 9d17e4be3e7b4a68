// Light of the sun along one path.
// Before including: lib/trace.glsl, lib/sampling.glsl, daylight/daylight.glsl, and the blocks `settings`, `vertices` and `counts`.

// Light by the sun for 1 W/m² at normal incidence: a shadow ray from each vertex. `sun`: direction and 0, or place of a sun that is a point and
// the square of the distance at which it has 1 W/m². `around`: sun_frame(sun).
vec3 day_sun(uint path, uint of_bake, uint number, vec4 sun, mat3 around) {
    vec3 sum = vec3(0.0);
    for (uint k = 0u; k < counts[path]; ++k) {
        DayVertex vertex = vertices[path * DAY_VERTICES + k];
        uvec4 hash = pcg4d(uvec4(of_bake, number, k, settings.seed ^ 0x5bd1e995u));
        // The same place on the disc at all times.
        vec2 disc = settings.sun_radius * sample_disc(unit_floats(hash.xy));
        vec3 direction = normalize(sun.xyz + around[0] * disc.x + around[1] * disc.y);
        float strength = 1.0;
        float far = 1e30;
        if (sun.w > 0.0) {
            vec3 way = sun.xyz - vertex.position;
            far = length(way);
            direction = way / far;
            strength = sun.w / (far * far);
        }
        float cosine = dot(vertex.normal, direction);
        if (cosine <= 0.0 || dot(vertex.geometric, direction) <= 0.0) continue;
        if (!trace_any(Ray(vertex.position, 0.0, direction, far), TRACE_SHADOW, hash.z)) sum += vertex.weight * (strength * cosine);
    }
    return sum;
}

mat3 sun_frame(vec4 sun) {
    return frame_around(sun.w > 0.0 ? vec3(0.0, 1.0, 0.0) : sun.xyz);
}
