// From the logarithm that a solver found to light of any scale: values above 0, which a selection by digits can order.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D logarithm;
layout(binding = 1, r32f) uniform writeonly image2D light;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(light)))) return;
    imageStore(light, at, vec4(exp2(clamp(3.321928095 * texelFetch(logarithm, at, 0).r, -60.0, 60.0))));
}
