// The beginning of paths: slots, pixels, camera rays. Before including: `view`, `settings` and `sample_index`.

// Pixel of a slot. Slots are ordered by blocks of 8 × 8 pixels, so that the rays of a workgroup are close to each other.
uvec2 pixel_of(uint slot) {
    uint block = slot / 64u;
    uint inside = slot % 64u;
    uvec2 corner = 8u * uvec2(block % settings.blocks, block / settings.blocks);
    return corner + uvec2(inside % 8u, inside / 8u);
}

// The dimension of the random numbers that decide about blended surfaces along the ray to a surface.
uint path_dimension(PathState path) {
    return 1u + 4u * path.vertex;
}

PathState camera_path(uvec2 pixel) {
    PathState path;
    vec2 inside = vec2(0.5);
    if ((settings.flags & PATH_JITTER) != 0u) {
        inside = unit_floats(random_words(pixel, sample_index, 0u, settings.seed).xy);
    }
    vec2 uv = (vec2(pixel) + inside) / vec2(settings.extent);
    // From the near plane to the far plane, like the rasteriser.
    float near = view.near / view.far;
    path.direction = view_ray(view, uv);
    path.origin = view_base(view, uv) + near * path.direction;
    path.limit = 1.0 - near;
    path.density = 0.0;
    path.throughput = vec3(1.0);
    path.alive = 1u;
    path.vertex = 0u;
    path.scattered = 0u;
    path.specular = 0u;
    path.emission = vec3(0.0);
    path.direct = vec3(0.0);
    path.indirect = vec3(0.0);
    path.waiting = 0u;
    return path;
}
