// Pulled triangles; the instance chooses depth and colour
#version 460
#extension GL_EXT_scalar_block_layout : require
struct Corner { vec2 at; };
layout(binding = 0, scalar) readonly buffer Corners { Corner corners[]; };
layout(push_constant, scalar) uniform Push { float depth_step; };
layout(location = 0) flat out uint instance;
void main() {
    instance = gl_InstanceIndex;
    gl_Position = vec4(corners[gl_VertexIndex].at, 0.25 + depth_step * float(gl_InstanceIndex), 1.0);
}
