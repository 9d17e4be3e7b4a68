// A volume: (x, y, z, 1)
#version 460
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 0, rgba32f) uniform writeonly image3D volume_out;
void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(at, imageSize(volume_out)))) return;
    imageStore(volume_out, at, vec4(at, 1.0));
}
