layout(binding = 0) uniform sampler2D picture;
layout(binding = 1) uniform sampler2D indirect_light;
layout(push_constant) uniform Push { float direct; float indirect; };
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 light = texelFetch(picture, pixel, 0);
    vec3 bounced = texelFetch(indirect_light, pixel, 0).rgb;
    color = vec4(direct * (light.rgb - bounced) + indirect * bounced, light.a);
}
