// Looks into a volume and along the six axes of a cube
#version 460
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 1) in;
layout(binding = 0) uniform sampler3D volume;
layout(binding = 1) uniform samplerCube sky;
layout(binding = 2, scalar) writeonly buffer Seen { vec4 seen[]; };
void main() {
    seen[0] = textureLod(volume, vec3(0.5), 0.0);
    for (int i = 0; i < 6; ++i) {
        vec3 axis = vec3(0.0);
        axis[i / 2] = i % 2 == 0 ? 1.0 : -1.0;
        seen[1 + i] = textureLod(sky, axis, 0.0);
    }
}
