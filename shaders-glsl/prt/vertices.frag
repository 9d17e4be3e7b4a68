// Light between vertices, where the G-buffer shows their triangle. The weight is below one beside vertices without samples.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/pixel_depth.glsl"
#include "lib/scene.glsl"

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 6) uniform sampler2D depth;

layout(location = 0) in vec3 seen;
layout(location = 1) in vec4 front_light;
layout(location = 2) in vec4 front_seen;
layout(location = 3) in vec4 back_light;
layout(location = 4) in vec4 back_seen;
layout(location = 5) flat in uint flipped;

layout(location = 0) out vec4 light_sum;
layout(location = 1) out vec4 seen_sum;

void main() {
    // Surfaces that the G-buffer does not show (cut out or blended) must not cover the visible surface.
    float shown = texelFetch(depth, ivec2(gl_FragCoord.xy), 0).r;
    if (abs(pixel_depth(view, seen) - shown) > 1e-4 * shown) discard;
    bool front = gl_FrontFacing != ((flipped & INSTANCE_FLIPPED) != 0u);
    light_sum = front ? front_light : back_light;
    seen_sum = front ? front_seen : back_seen;
}
