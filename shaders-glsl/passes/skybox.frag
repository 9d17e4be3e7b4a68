// The environment, or a constant, behind everything: drawn where nothing stands.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "passes/environment.glsl"

layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 radiance_out;
layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D environment; // repeating
layout(push_constant, scalar) uniform Push {
    vec3 scale;     // on the environment
    float rotation; // radians
    vec3 constant;  // radiance added to it
};

void main() {
    vec2 at = environment_uv(normalize(view_ray(view, uv)), rotation);
    // The image repeats around the horizon but not over the poles.
    float half_texel = 0.5 / float(textureSize(environment, 0).y);
    at.y = clamp(at.y, half_texel, 1.0 - half_texel);
    radiance_out = vec4(textureLod(environment, at, 0.0).rgb * scale + constant, 1.0);
}
