// Points of lib/points.glsl, two pairs of dimensions an invocation, for tests.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/random.glsl"
#include "lib/points.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) writeonly buffer Drawn { uvec4 drawn[]; };

layout(push_constant, scalar) uniform Push {
    uint width;   // pixels; the picture is a square
    uint samples; // of each pixel, one after the other
    uint plan;
    uint seed;
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= width * width * samples) return;
    uint pixel = i / samples;
    PointPlace place = point_place(uvec2(pixel % width, pixel / width), i % samples, plan, seed);
    drawn[i] = uvec4(point_words(place, 3u, seed), point_words(place, 4u, seed));
}
