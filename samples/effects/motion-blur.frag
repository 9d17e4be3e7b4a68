// The mean along the way of each pixel on the screen, by the position of its surface in the camera of the frame before.
#include "lib/view.glsl"
layout(binding = 0) uniform sampler2D picture;
layout(binding = 1) uniform sampler2D depth;
layout(binding = 2, scalar) uniform ViewBlock { View view; };
layout(push_constant, scalar) uniform Push { vec2 turn; vec3 step; float shutter; };
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 color;

const int STEPS = 24;

void main() {
    vec3 world = world_from_depth(view, uv, textureLod(depth, uv, 0.0).r);
    vec3 eye = (view.view_from_world * vec4(world, 1.0)).xyz;
    // In the camera of the frame before, which stood back by the step and was turned back.
    eye += vec3(step.xy, -step.z);
    vec2 angle = radians(turn);
    eye.xz = mat2(cos(angle.x), sin(angle.x), -sin(angle.x), cos(angle.x)) * eye.xz;
    eye.yz = mat2(cos(angle.y), sin(angle.y), -sin(angle.y), cos(angle.y)) * eye.yz;
    vec4 clip = view.clip_from_view * vec4(eye, 1.0);
    vec2 before = vec2(0.5) + vec2(0.5, -0.5) * clip.xy / max(clip.w, 1e-6);
    vec2 way = shutter * (before - uv);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < STEPS; ++i) {
        vec2 at = uv + way * ((float(i) + 0.5) / float(STEPS) - 0.5);
        sum += textureLod(picture, clamp(at, 0.0, 1.0), 0.0);
    }
    color = sum / float(STEPS);
}
