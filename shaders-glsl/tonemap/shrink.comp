// Luminance averaged over boxes of factor x factor pixels, for identification at reduced size. Boxes at the right and lower
// border average what lies inside the image.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D luminance;
layout(binding = 1, r32f) uniform writeonly image2D small;

layout(push_constant, scalar) uniform Push {
    uint factor;
};

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(small)))) return;
    ivec2 begin = at * int(factor);
    ivec2 end = min(begin + int(factor), textureSize(luminance, 0));
    // Divided before the sum, which then cannot overflow.
    float share = 1.0 / float((end.x - begin.x) * (end.y - begin.y));
    precise float mean = 0.0;
    for (int y = begin.y; y < end.y; ++y) {
        for (int x = begin.x; x < end.x; ++x) mean += share * texelFetch(luminance, ivec2(x, y), 0).r;
    }
    imageStore(small, at, vec4(mean));
}
