#version 450
// egui wants gamma-encoded colours to be multiplied and blended as they are. A texture's bytes thus reach the window unchanged.
layout(location = 0) in vec2 uv;
layout(location = 1) in vec4 color;
layout(set = 0, binding = 0) uniform sampler2D image;
layout(constant_id = 0) const bool TARGET_ENCODES = false; // the target's format applies the sRGB curve
layout(location = 0) out vec4 result;
void main() {
    vec4 painted = color * texture(image, uv);
    if (TARGET_ENCODES) {
        bvec3 low = lessThanEqual(painted.rgb, vec3(0.04045));
        painted.rgb = mix(pow((painted.rgb + 0.055) / 1.055, vec3(2.4)), painted.rgb / 12.92, low);
    }
    result = painted;
}
