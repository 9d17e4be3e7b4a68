layout(binding = 0) uniform sampler2D picture;
layout(binding = 1) uniform sampler2D spread;
layout(push_constant) uniform Push { float share; };
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 color;

void main() {
    color = texture(picture, uv) + vec4(share * textureLod(spread, uv, 0.0).rgb, 0.0);
}
