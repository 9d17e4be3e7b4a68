// The place in the lightmap of the surface that the G-buffer shows at each pixel.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/pixel_depth.glsl"

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 6) uniform sampler2D depth;

layout(location = 0) in vec3 seen;
layout(location = 1) in vec2 front;
layout(location = 2) in vec2 back;
layout(location = 3) flat in uint flipped;
layout(location = 4) flat in uint sides;
layout(location = 5) flat in uint has_back;

layout(location = 0) out vec2 texel;

void main() {
    // Surfaces that the G-buffer does not show (cut out, blended or hidden) must not cover the visible surface.
    float shown = texelFetch(depth, ivec2(gl_FragCoord.xy), 0).r;
    if (abs(pixel_depth(view, seen) - shown) > 1e-4 * shown) discard;
    // The pipeline's front face is that of unmirrored meshes.
    bool is_front = gl_FrontFacing != (flipped != 0u);
    // Nobody sees the back of a one-sided surface, which may be at the depth of a front.
    if (!is_front && sides == 1u) discard;
    texel = is_front ? front : has_back != 0u ? back : vec2(-1.0);
}
