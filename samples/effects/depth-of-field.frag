// Gathering with the circle of confusion of a thin lens. A sample counts where its own circle, or that of the pixel if the sample lies behind it,
// reaches the pixel, so that sharp surfaces do not leak into what is behind them.
#include "lib/view.glsl"
layout(binding = 0) uniform sampler2D picture;
layout(binding = 1) uniform sampler2D depth;
layout(binding = 2, scalar) uniform ViewBlock { View view; };
layout(push_constant) uniform Push { float focus; float aperture; };
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 color;

const int SAMPLES = 96;

float circle(float distance) {
    return aperture * abs(distance - focus) / max(distance, 1e-4);
}

void main() {
    vec2 texel = 1.0 / vec2(textureSize(picture, 0));
    float own = textureLod(depth, uv, 0.0).r * view.far;
    float radius = circle(own);
    vec4 sum = texelFetch(picture, ivec2(gl_FragCoord.xy), 0);
    float weights = 1.0;
    for (int i = 0; i < SAMPLES; ++i) {
        // Even points of a disc, on a spiral of the golden angle.
        float r = sqrt((float(i) + 0.5) / float(SAMPLES));
        float angle = 2.399963 * float(i);
        vec2 at = uv + aperture * r * vec2(cos(angle), sin(angle)) * texel;
        float other = textureLod(depth, at, 0.0).r * view.far;
        float reach = other > own ? min(circle(other), radius) : circle(other);
        // A sample spreads its light over its circle.
        float covers = smoothstep(-1.0, 1.0, reach - aperture * r) / max(reach * reach, 1.0);
        sum += covers * textureLod(picture, at, 0.0);
        weights += covers;
    }
    color = sum / weights;
}
