// Orthographic depth images of an occluder along the directions of rays of the environment's cube map: how far the
// occluder extends to the back on each line, in sixteen bits. The occluder hides a direction from a point if this depth
// lies behind the point on the point's line.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "fiv/fiv.glsl"
#include "fiv/parallel.glsl"
#include "lib/trace.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) writeonly buffer Depths { uint depths[]; }; // two pixels per word, image after image

layout(push_constant, scalar) uniform Push {
    uint face;
    uint first;   // first direction of the face
    uint side;    // directions along an edge of a face
    float radius; // radius of the bounding sphere, metres
};

uint depth_of(vec3 along, vec2 st) {
    vec2 plane = (2.0 * st - 1.0) * radius * parallel_reach(along);
    // The end of the line on the far side of the sphere.
    vec3 end = vec3(plane + along.xy * radius, radius);
    Hit hit = trace_closest(Ray(parallel_direction(face, end), 0.0, -parallel_direction(face, along), 2.0 * radius), TRACE_SHADOW, 0u);
    if (hit.instance == NONE) return 0u;
    return 1u + uint(clamp(1.0 - 0.5 * hit.t / radius, 0.0, 1.0) * FIV_PARALLEL_STEPS);
}

void main() {
    uvec2 at = gl_GlobalInvocationID.xy;
    uint number = first + gl_WorkGroupID.z;
    if (number >= side * side || at.x >= FIV_PARALLEL_SIDE / 2u) return;
    vec2 st = (vec2(number % side, number / side) + 0.5) / float(side);
    vec3 along = parallel_coordinates(face, cube_direction(face, st));
    uint word = 0u;
    for (uint k = 0u; k < 2u; ++k) {
        word |= depth_of(along, (vec2(2u * at.x + k, at.y) + 0.5) / float(FIV_PARALLEL_SIDE)) << 16u * k;
    }
    depths[(number * FIV_PARALLEL_SIDE + at.y) * FIV_PARALLEL_SIDE / 2u + at.x] = word;
}
