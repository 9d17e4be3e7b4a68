#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "test/probe.glsl"
layout(local_size_x = 8, local_size_y = 4) in;
layout(constant_id = 3) const uint SAMPLES = 48;
layout(binding = 0) uniform sampler2DArray textures[3];
layout(binding = 1, rgba16f) uniform writeonly image2D color_out;
layout(binding = 2, scalar) uniform ProbeBlock { Probe probe; };
layout(binding = 3, scalar) readonly buffer Probes { uint count; Probe probes[]; };
layout(binding = 4, scalar) buffer Counters { uint counters[]; };
layout(push_constant, scalar) uniform Push { float radius; vec3 offset; ivec2 extent; };
void main() {
    vec4 c = textureLod(textures[1], vec3(0.5), 0.0) * probe.weight + probes[count].m[1] * radius;
    counters[0] = SAMPLES;
    imageStore(color_out, ivec2(gl_GlobalInvocationID.xy), c);
}
