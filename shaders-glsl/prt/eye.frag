// The view of one eye in its half of a picture.
#version 460

layout(binding = 0) uniform sampler2D eye;
layout(push_constant) uniform Push { int left; };  // first column of the half

layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 value;

void main() {
    value = texelFetch(eye, ivec2(gl_FragCoord.xy) - ivec2(left, 0), 0);
}
