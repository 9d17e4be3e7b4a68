// Which occluder each pixel shows, and at which depth: where that is not the G-buffer's, something was cut out here.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/scene.glsl"

layout(binding = 0, scalar) uniform ViewBlock { View view; };

layout(location = 0) in float eye_z;
layout(location = 1) flat in uint owner;
layout(location = 0) out vec2 identity; // number of the occluder plus one, 0: none; linear depth

void main() {
    identity = vec2(owner == NONE ? 0.0 : float(owner + 1u), eye_z / view.far);
}
