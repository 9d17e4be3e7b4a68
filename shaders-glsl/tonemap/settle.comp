// Local adaptation that follows that of the frame (thesis 4.4.2.2).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D adaptation;
layout(binding = 1, scalar) buffer Last { float last[]; };  // of the frame before, row by row
layout(binding = 2, r32f) uniform writeonly image2D settled;

layout(push_constant, scalar) uniform Push {
    float share;  // of the way to the frame's adaptation
};

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 extent = imageSize(settled);
    if (any(greaterThanEqual(pixel, extent))) return;
    float now = texelFetch(adaptation, pixel, 0).r;
    uint index = uint(pixel.y) * uint(extent.x) + uint(pixel.x);
    // Below zero: there is no frame before. The same value stays the same value.
    if (last[index] >= 0.0) now = last[index] + share * (now - last[index]);
    last[index] = now;
    imageStore(settled, pixel, vec4(now));
}
