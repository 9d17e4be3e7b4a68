// The beginning of paths: random numbers and camera rays. Before including: `view` and `settings`.

// The dimension of the random numbers that decide about blended surfaces along the ray to a surface. `vertex`: number of surfaces before it.
uint path_dimension(uint vertex) {
    return 1u + 5u * vertex;
}

// The ray of sample `number`, of which `limit` is in lengths of the direction.
Ray camera_ray(uvec2 pixel, uint number) {
    vec2 inside = vec2(0.5);
    if ((settings.flags & PATH_JITTER) != 0u) {
        inside = unit_floats(point_words(point_place(pixel, number, settings.plan, settings.seed), 0u, settings.seed));
    }
    vec2 uv = (vec2(pixel) + inside) / vec2(settings.extent);
    // From the near plane to the far plane, like the rasteriser.
    float near = view.near / view.far;
    vec3 direction = view_ray(view, uv);
    return Ray(view_base(view, uv) + near * direction, 0.0, direction, 1.0 - near);
}
