// Chooses visible points that measure the importance of the candidates.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "lib/vpl.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D albedo;
layout(binding = 2) uniform sampler2D normal;
layout(binding = 3) uniform sampler2D depth;
layout(binding = 4, scalar) writeonly buffer Points { SeenPoint points[]; };

layout(push_constant, scalar) uniform Push {
    uint count;
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= count) return;
    // The R2 sequence (Roberts) is spread evenly over the picture.
    vec2 u = fract(0.5 + float(at) * vec2(0.75487767, 0.56984029));
    ivec2 pixel = min(ivec2(u * view.extent), ivec2(view.extent) - 1);
    SeenPoint point = SeenPoint(vec3(0.0), 0.0, vec3(0.0), 0.0);
    float z = texelFetch(depth, pixel, 0).r;
    if (z < 1.0) {
        point.position = screen_position(view, pixel, 1.0, z);
        point.normal = decode_normal(texelFetch(normal, pixel, 0));
        point.gap = surface_step(view, point.position, z);
        point.position = stepped_back(view, point.position, point.gap);
        // Irradiance matters in proportion to the albedo. The minimum of 0.05 is for mirrors, whose reflections the G-buffer does not know.
        // Unlit surfaces receive no light.
        vec4 color = texelFetch(albedo, pixel, 0);
        point.weight = color.a > 0.5 ? max(dot(color.rgb, vec3(0.2126, 0.7152, 0.0722)), 0.05) : 0.0;
    }
    points[at] = point;
}
