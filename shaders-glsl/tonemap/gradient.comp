// Magnitude of the gradient of one level of a pyramid of logarithms, by differences of the neighbours on both sides (Fattal 2002, section 4).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D logarithm;
layout(binding = 1, r32f) uniform writeonly image2D gradient;

layout(push_constant, scalar) uniform Push {
    float scale;  // 2^−(k+1): one over the distance of the two neighbours, in pixels of the picture
};

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    ivec2 extent = imageSize(gradient);
    if (any(greaterThanEqual(at, extent))) return;
    ivec2 before = max(at - 1, ivec2(0));
    ivec2 after = min(at + 1, extent - 1);
    vec2 slope = vec2(texelFetch(logarithm, ivec2(after.x, at.y), 0).r - texelFetch(logarithm, ivec2(before.x, at.y), 0).r,
                      texelFetch(logarithm, ivec2(at.x, after.y), 0).r - texelFetch(logarithm, ivec2(at.x, before.y), 0).r);
    imageStore(gradient, at, vec4(scale * length(slope)));
}
