#version 450
// The triangles of the user interface.
layout(location = 0) in vec2 position; // in points
layout(location = 1) in vec2 uv;
layout(location = 2) in vec4 color; // gamma-encoded, premultiplied
layout(push_constant) uniform Push { vec2 points_to_clip; };
layout(location = 0) out vec2 out_uv;
layout(location = 1) out vec4 out_color;
void main() {
    out_uv = uv;
    out_color = color;
    gl_Position = vec4(position * points_to_clip - 1.0, 0.0, 1.0);
}
