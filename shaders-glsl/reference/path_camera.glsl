// The beginning of paths: slots, pixels, camera rays. Before including: `view`, `settings` and `sample_index`.

// Pixel of a slot. Slots are ordered by blocks of 8 × 8 pixels, so that the rays of a workgroup are close to each other.
uvec2 pixel_of(uint slot) {
    uint block = slot / 64u;
    uint inside = slot % 64u;
    uvec2 corner = 8u * uvec2(block % settings.blocks, block / settings.blocks);
    return corner + uvec2(inside % 8u, inside / 8u);
}

// The dimension of the random numbers that decide about blended surfaces along the ray to a surface. `vertex`: number of surfaces before it.
uint path_dimension(uint vertex) {
    return 1u + 5u * vertex;
}

// A ray, of which `limit` is in lengths of the direction.
Ray camera_ray(uvec2 pixel) {
    vec2 inside = vec2(0.5);
    if ((settings.flags & PATH_JITTER) != 0u) {
        inside = unit_floats(point_words(point_place(pixel, sample_index, settings.plan, settings.seed), 0u, settings.seed));
    }
    vec2 uv = (vec2(pixel) + inside) / vec2(settings.extent);
    // From the near plane to the far plane, like the rasteriser.
    float near = view.near / view.far;
    vec3 direction = view_ray(view, uv);
    return Ray(view_base(view, uv) + near * direction, 0.0, direction, 1.0 - near);
}
