// Displacement by the slope of a height field of sines, and brighter lines on the slopes that face the light.
layout(binding = 0) uniform sampler2D picture;
layout(push_constant) uniform Push { vec2 size; float bumps; float bend; };
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 color;

void main() {
    vec2 aspect = vec2(size.x / size.y, 1.0);
    vec2 at = uv * aspect * bumps * 6.2831853;
    vec2 slope = vec2(cos(at.x) * sin(at.y), sin(at.x) * cos(at.y));
    vec4 light = textureLod(picture, clamp(uv + bend * slope / aspect, 0.0, 1.0), 0.0);
    color = vec4(light.rgb * (1.0 + 0.12 * dot(slope, vec2(-0.7, -0.7))), light.a);
}
