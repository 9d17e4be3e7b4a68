// The mean along the way to a centre.
layout(binding = 0) uniform sampler2D picture;
layout(push_constant) uniform Push { vec2 centre; float length; };
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 color;

const int STEPS = 32;

void main() {
    vec4 sum = vec4(0.0);
    for (int i = 0; i < STEPS; ++i) {
        float way = length * (float(i) + 0.5) / float(STEPS);
        sum += textureLod(picture, mix(uv, centre, way), 0.0);
    }
    color = sum / float(STEPS);
}
