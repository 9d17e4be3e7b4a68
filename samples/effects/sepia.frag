// Luminance in brown tones.
layout(binding = 0) uniform sampler2D picture;
layout(push_constant) uniform Push { float strength; };
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 color;

void main() {
    vec4 light = texelFetch(picture, ivec2(gl_FragCoord.xy), 0);
    float luminance = dot(light.rgb, vec3(0.2126, 0.7152, 0.0722));
    color = vec4(mix(light.rgb, luminance * vec3(1.18, 0.98, 0.70), strength), light.a);
}
