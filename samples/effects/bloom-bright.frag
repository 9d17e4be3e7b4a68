// The light above a threshold, at a quarter of the size: each pixel is the mean of the sixteen under it.
#include "bloom-bright.glsl"
layout(binding = 0) uniform sampler2D picture;
layout(push_constant) uniform Push { float threshold; };
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 color;

void main() {
    vec2 texel = 1.0 / vec2(textureSize(picture, 0));
    vec3 sum = vec3(0.0);
    for (int y = -1; y <= 1; y += 2) {
        for (int x = -1; x <= 1; x += 2) {
            sum += bright_part(textureLod(picture, uv + vec2(x, y) * texel, 0.0).rgb, threshold);
        }
    }
    color = vec4(min(sum / 4.0, vec3(60000.0)), 1.0);
}
