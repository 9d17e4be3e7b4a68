// One triangle that covers the target. The draw call sets the depth through the viewport's depth range.
#version 460

layout(location = 0) out vec2 uv; // (0, 0) at the top left pixel corner, (1, 1) at the bottom right

void main() {
    vec2 corner = vec2((gl_VertexIndex << 1) & 2, gl_VertexIndex & 2);
    uv = vec2(corner.x, 1.0 - corner.y);
    // Clip space has +Y up here; the viewport flips it once for the whole engine.
    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}
