// The share of the bright light that spreads is missing where it came from, so the sum of all light stays.
#include "bloom-bright.glsl"
layout(binding = 0) uniform sampler2D picture;
layout(binding = 1) uniform sampler2D spread;
layout(push_constant) uniform Push { float threshold; float share; };
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 color;

void main() {
    vec4 light = texelFetch(picture, ivec2(gl_FragCoord.xy), 0);
    color = vec4(light.rgb + share * (textureLod(spread, uv, 0.0).rgb - bright_part(light.rgb, threshold)), light.a);
}
