// A constant colour on the full screen
#version 460
#extension GL_EXT_scalar_block_layout : require
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 color_out;
layout(push_constant, scalar) uniform Push { vec4 color; };
void main() { color_out = color; }
