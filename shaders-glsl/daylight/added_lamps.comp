// Adds the light of lamps to the direct light of the objects that were added at run time.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D mask;   // above 0.5 at their pixels
layout(binding = 1) uniform sampler2D lamps;  // radiance towards the camera
layout(binding = 2, rgba16f) uniform image2D direct;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(direct))) || texelFetch(mask, pixel, 0).r < 0.5) return;
    vec4 before = imageLoad(direct, pixel);
    imageStore(direct, pixel, vec4(before.rgb + texelFetch(lamps, pixel, 0).rgb, before.a));
}
