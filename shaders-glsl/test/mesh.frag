#version 460
#extension GL_EXT_scalar_block_layout : require
layout(location = 0) flat in uint instance;
layout(location = 0) out vec4 color_out;
layout(location = 1) out uvec2 id_out;
void main() {
    color_out = vec4(1.0, 0.5 * float(instance), gl_FragCoord.y, gl_FrontFacing ? 1.0 : 0.0);
    id_out = uvec2(instance, 7u);
}
