// Shadow map of a separated texel: how far the occluder extends towards the light, on a plane across the light's
// direction. Points behind this depth lie in the shadow.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "fiv/fiv.glsl"
#include "lib/trace.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) writeonly buffer Depths { float depths[]; }; // metres from the centre

layout(push_constant, scalar) uniform Push {
    vec3 direction; // to the light
    vec3 right;
    vec3 up;
    float radius; // radius of the bounding sphere, whose centre is the origin, metres
};

void main() {
    uvec2 at = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(at, uvec2(FIV_SUN_SIDE)))) return;
    vec2 p = (2.0 * (vec2(at) + 0.5) / float(FIV_SUN_SIDE) - 1.0) * radius;
    float start = 1.01 * radius;
    vec3 origin = right * p.x + up * p.y + direction * start;
    uint place = at.y * FIV_SUN_SIDE + at.x;
    Hit hit = trace_closest(Ray(origin, 0.0, -direction, 2.0 * start), TRACE_SHADOW, place);
    depths[place] = hit.instance == NONE ? FIV_SUN_FREE : start - hit.t;
}
