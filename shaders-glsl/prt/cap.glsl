// The map between a square and the directions of a spherical cap. Equal areas stay equal. Twin: techniques::prt::cap.
// Before including: lib/sampling.glsl, prt/prt.glsl.

// Direction of a point of the unit square.
vec3 cap_direction(PrtCap cap, vec2 uv) {
    vec2 disc = sample_disc(uv);
    float square = min(dot(disc, disc), 1.0);
    float cosine = 1.0 - square * (1.0 - cap.cos_most);
    float sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    vec2 way = square > 0.0 ? disc / sqrt(square) : vec2(0.0);
    return frame_around(cap.axis) * vec3(way * sine, cosine);
}

// The point of the unit square of a direction. Directions beyond the cap are at its edge.
vec2 cap_place(PrtCap cap, vec3 direction) {
    vec3 d = direction * frame_around(cap.axis);
    float r = sqrt(clamp((1.0 - d.z) / (1.0 - cap.cos_most), 0.0, 1.0));
    float across = length(d.xy);
    if (across == 0.0) return vec2(0.5);
    vec2 way = d.xy / across;
    // Inverse of sample_disc.
    vec2 p;
    if (abs(way.x) > abs(way.y)) {
        p.x = way.x > 0.0 ? r : -r;
        p.y = p.x * atan(way.y / way.x) * (4.0 / SAMPLING_PI);
    } else {
        p.y = way.y > 0.0 ? r : -r;
        p.x = p.y * atan(way.x / way.y) * (4.0 / SAMPLING_PI);
    }
    return clamp(0.5 + 0.5 * p, 0.0, 1.0);
}
