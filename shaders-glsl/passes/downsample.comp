// CLR, NRM and DPT at half width and height: the 2 × 2 mean of each (dissertation, section 4.2). Texels beyond an odd border
// repeat the border. FACTOR 1 keeps the resolution and only decodes.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/gbuffer.glsl"
#include "passes/downsample.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint FACTOR = 2;
layout(constant_id = 1) const uint DEPTH_AWARE = 0;

layout(binding = 0) uniform sampler2D albedo;
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3, rgba16f) uniform writeonly image2D coarse_albedo;
layout(binding = 4, rgba16f) uniform writeonly image2D coarse_normal;  // decoded, mean, not normalised
layout(binding = 5, r32f) uniform writeonly image2D coarse_depth;

layout(push_constant, scalar) uniform Push {
    float tolerance;  // relative depth difference within one surface
};

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(coarse_depth)))) {
        return;
    }
    ivec2 last = textureSize(depth, 0) - 1;
    int factor = int(FACTOR);
    float nearest = 1.0;
    for (int i = 0; i < factor * factor; ++i) {
        ivec2 at = min(pixel * factor + ivec2(i % factor, i / factor), last);
        nearest = min(nearest, texelFetch(depth, at, 0).r);
    }
    vec4 c = vec4(0.0);
    vec3 n = vec3(0.0);
    float z = 0.0;
    float count = 0.0;
    for (int i = 0; i < factor * factor; ++i) {
        ivec2 at = min(pixel * factor + ivec2(i % factor, i / factor), last);
        float at_z = texelFetch(depth, at, 0).r;
        if (downsample_takes(at_z, nearest, DEPTH_AWARE, tolerance)) {
            c += texelFetch(albedo, at, 0);
            n += decode_normal(texelFetch(normal, at, 0));
            z += at_z;
            count += 1.0;
        }
    }
    imageStore(coarse_albedo, pixel, c / count);
    imageStore(coarse_normal, pixel, vec4(n / count, 0.0));
    // Exactly 1 where all are background: rounding must not make background of a surface or the reverse.
    imageStore(coarse_depth, pixel, vec4(nearest >= 1.0 ? 1.0 : z / count));
}
