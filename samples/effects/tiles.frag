layout(binding = 0) uniform sampler2D picture;
layout(push_constant) uniform Push { int side; float joint; };
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), first = pixel / side * side, last = textureSize(picture, 0) - 1;
    vec4 sum = vec4(0.0);
    // The mean of at most 8×8 pixels.
    int steps = min(side, 8);
    for (int y = 0; y < steps; ++y) {
        for (int x = 0; x < steps; ++x) {
            sum += texelFetch(picture, min(first + (ivec2(x, y) * side + side / 2) / steps, last), 0);
        }
    }
    vec2 inside = vec2(pixel - first) + 0.5;
    float border = min(min(inside.x, inside.y), float(side) - max(inside.x, inside.y));
    color = sum / float(steps * steps) * (border < joint ? 0.35 : 1.0);
}
