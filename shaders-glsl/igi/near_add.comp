// Adds the filtered light of the short paths to the irradiance of the visible surfaces.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D light; // a: below 0 where there is no lit surface
layout(binding = 1, rgba32f) uniform image2D irradiance;

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(texel, imageSize(irradiance)))) return;
    vec4 near = texelFetch(light, texel, 0);
    if (near.a < 0.0) return;
    imageStore(irradiance, texel, imageLoad(irradiance, texel) + vec4(near.rgb, 0.0));
}
