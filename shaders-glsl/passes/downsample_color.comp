// A radiance image at half width and height, with the texel choice of passes/downsample. Alpha becomes the radiation mask times
// the share of the texel that the chosen ones cover, so that surfaces do not send from more area than they have.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "passes/downsample.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint FACTOR = 2;
layout(constant_id = 1) const uint DEPTH_AWARE = 0;

layout(binding = 0) uniform sampler2D color;
layout(binding = 1) uniform sampler2D depth;
layout(binding = 2) uniform sampler2D albedo;  // a: radiation mask
layout(binding = 3, rgba16f) uniform writeonly image2D coarse;

layout(push_constant, scalar) uniform Push {
    float tolerance;  // relative depth difference within one surface
};

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(coarse)))) {
        return;
    }
    ivec2 last = textureSize(depth, 0) - 1;
    int factor = int(FACTOR);
    float nearest = 1.0;
    for (int i = 0; i < factor * factor; ++i) {
        ivec2 at = min(pixel * factor + ivec2(i % factor, i / factor), last);
        nearest = min(nearest, texelFetch(depth, at, 0).r);
    }
    vec3 sum = vec3(0.0);
    float mask = 0.0;
    float count = 0.0;
    for (int i = 0; i < factor * factor; ++i) {
        ivec2 at = min(pixel * factor + ivec2(i % factor, i / factor), last);
        if (downsample_takes(texelFetch(depth, at, 0).r, nearest, DEPTH_AWARE, tolerance)) {
            sum += texelFetch(color, at, 0).rgb;
            mask += texelFetch(albedo, at, 0).a;
            count += 1.0;
        }
    }
    imageStore(coarse, pixel, vec4(sum / count, mask / float(factor * factor)));
}
