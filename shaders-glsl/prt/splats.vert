// Splats: discs in the tangent planes of samples, seen as ellipses. Six corners of a rectangle around each.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "prt/prt.glsl"

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1, scalar) readonly buffer Splats { PrtSplat splats[]; };
layout(binding = 2, scalar) readonly buffer Drawn { uint drawn[]; };
layout(binding = 3, scalar) readonly buffer Values { vec4 values[]; };

layout(push_constant, scalar) uniform Push {
    float splat;  // standard deviation of the weights, in distances of splats
};

layout(location = 0) flat out vec4 place;   // position, metres; standard deviation, metres
layout(location = 1) flat out vec3 normal;
layout(location = 2) flat out vec4 light;   // irradiance; weight
layout(location = 3) flat out vec4 seen;

void main() {
    PrtSplat s = splats[drawn[gl_InstanceIndex]];
    place = vec4(s.position, splat * s.spacing);
    normal = s.normal;
    light = values[2 * gl_InstanceIndex];
    seen = values[2 * gl_InstanceIndex + 1];
    vec3 eye = to_camera(view, s.position);
    // The first axis of the ellipse is parallel to the picture, the second one is foreshortened.
    vec3 across = cross(s.normal, eye);
    float sine = length(across);
    across = sine > 1e-4 ? across / sine : normalize(cross(s.normal, abs(s.normal.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0)));
    vec3 along = cross(s.normal, across);
    float cosine = max(abs(dot(s.normal, eye)), 0.05);
    // One pixel more on all sides, so that no middle of a pixel is left out.
    float pixel = view.pixel_angle * (view.orthographic != 0u ? 1.0 : distance(view.position, s.position));
    vec2 reach = PRT_SPLAT_END * place.w + vec2(pixel, pixel / cosine);
    const vec2 corners[6] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, -1), vec2(1, 1), vec2(-1, 1));
    vec2 corner = corners[gl_VertexIndex] * reach;
    vec3 world = s.position + corner.x * across + corner.y * along;
    gl_Position = view.clip_from_world * vec4(world, 1.0);
    // Surfaces that bulge over the disc must not hide it: it is tested nearer to the camera than it is.
    vec3 nearer = (view.view_from_world * vec4(world, 1.0)).xyz;
    nearer.z = min(nearer.z + 0.25 * s.spacing / cosine, -view.near);
    vec4 clip = view.clip_from_view * vec4(nearer, 1.0);
    gl_Position.z = gl_Position.w * clamp(clip.z / clip.w, 0.0, 1.0);
}
