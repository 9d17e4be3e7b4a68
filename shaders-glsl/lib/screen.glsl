// Texels of full-resolution (factor 1) and half-resolution (factor 2) buffers in space. Include lib/view.glsl before.

// Image coordinates (0..1, y down) of the centre of a texel that covers factor² pixels.
vec2 screen_uv(View view, ivec2 texel, float factor) {
    return (vec2(texel) + 0.5) * factor / view.extent;
}

// Where the texel's centre lies at linear depth z.
vec3 screen_position(View view, ivec2 texel, float factor, float z) {
    return world_from_depth(view, screen_uv(view, texel, factor), z);
}

// The camera's unit vector into the scene.
vec3 screen_axis(View view) {
    return -vec3(view.view_from_world[0].z, view.view_from_world[1].z, view.view_from_world[2].z);
}

// Area in m² of a texel on a plane that faces the camera axis at linear depth z.
float screen_facing_area(View view, float factor, float z) {
    float side = factor * view.pixel_angle * (view.orthographic != 0u ? 1.0 : z * view.far);
    return side * side;
}
