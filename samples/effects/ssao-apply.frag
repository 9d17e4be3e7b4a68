// The picture times the open share, whose noise a mean over 4×4 pixels of about the same depth removes.
layout(binding = 0) uniform sampler2D picture;
layout(binding = 1) uniform sampler2D open;
layout(binding = 2) uniform sampler2D depth;
layout(push_constant) uniform Push { float strength; };
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float own = texelFetch(depth, pixel, 0).r;
    float sum = 0.0, weights = 0.0;
    ivec2 last = textureSize(open, 0) - 1;
    for (int y = -2; y <= 2; ++y) {
        for (int x = -2; x <= 2; ++x) {
            ivec2 at = clamp(pixel + ivec2(x, y), ivec2(0), last);
            float weight = exp(-abs(texelFetch(depth, at, 0).r / own - 1.0) * 100.0);
            sum += weight * texelFetch(open, at, 0).r;
            weights += weight;
        }
    }
    vec4 light = texelFetch(picture, pixel, 0);
    color = vec4(light.rgb * pow(sum / weights, strength), light.a);
}
