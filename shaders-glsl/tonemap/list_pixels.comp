// Lists the important pixels of some rows, in no particular order.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D importance;
layout(binding = 1, scalar) buffer Count { uint count; };
layout(binding = 2, scalar) writeonly buffer Pixels { uint pixels[]; };  // x in the low 16 bits, y in the high ones

layout(push_constant, scalar) uniform Push {
    uint first_row;
    uint rows;
};

shared uint here;   // important ones of the workgroup
shared uint begin;  // their place in the list

void main() {
    if (gl_LocalInvocationIndex == 0u) here = 0u;
    barrier();
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, first_row);
    bool inside = gl_GlobalInvocationID.y < rows && all(lessThan(pixel, textureSize(importance, 0)));
    bool important = inside && texelFetch(importance, pixel, 0).r != 0.0;
    uint place = important ? atomicAdd(here, 1u) : 0u;
    barrier();
    // One global operation for each workgroup.
    if (gl_LocalInvocationIndex == 0u && here > 0u) begin = atomicAdd(count, here);
    barrier();
    if (important) pixels[begin + place] = uint(pixel.x) | uint(pixel.y) << 16;
}
