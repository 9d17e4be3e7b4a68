// Lists the tiles of 8 x 8 pixels that have an important one, in no particular order.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D importance;
layout(binding = 1, scalar) buffer Count { uint count; };
layout(binding = 2, scalar) writeonly buffer Tiles { uint tiles[]; };  // x in the low 16 bits, y in the high ones

shared uint any_important;

void main() {
    if (gl_LocalInvocationIndex == 0u) any_important = 0u;
    barrier();
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    bool inside = all(lessThan(pixel, textureSize(importance, 0)));
    if (inside && texelFetch(importance, pixel, 0).r != 0.0) any_important = 1u;
    barrier();
    if (gl_LocalInvocationIndex == 0u && any_important != 0u) {
        tiles[atomicAdd(count, 1u)] = gl_WorkGroupID.x | gl_WorkGroupID.y << 16;
    }
}
