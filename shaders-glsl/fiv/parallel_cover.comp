// Vectors of the light that an occluder hides from many points in some directions ([FIV 10]), by lookups in its depth
// images. An invocation has one point. Neighbouring invocations read the same image.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "fiv/fiv.glsl"
#include "fiv/parallel.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Texels { FivTexel texels[]; };
layout(binding = 1, scalar) readonly buffer Points { FivPoint points[]; };
layout(binding = 2, scalar) writeonly buffer Partials { float partials[]; }; // ten floats for each point and chunk
layout(binding = 3, scalar) readonly buffer Depths { uint depths[]; };       // depth images of this face

layout(push_constant, scalar) uniform Push {
    uint first;   // first point
    uint count;
    uint face;
    uint size;    // texels of the environment along an edge
    uint split;   // directions along the edge of a texel
    uint each;    // directions of a chunk
    uint chunk;   // first chunk of this face
    uint chunks;  // chunks of all faces
    float radius; // half the width of the depth images, metres
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    uint side = size * split;
    vec3 at = parallel_coordinates(face, points[first + i].at) / radius;
    float share = 1.0 / float(split * split);
    // In steps of the stored depth, without the step that marks a miss.
    float depth = (0.5 + 0.5 * at.z) * FIV_PARALLEL_STEPS + 0.5;
    vec3 x = vec3(0.0), y = vec3(0.0), z = vec3(0.0);
    float angle = 0.0;
    uint end = min((gl_WorkGroupID.y + 1u) * each, side * side);
    for (uint number = gl_WorkGroupID.y * each; number < end; ++number) {
        uvec2 place = uvec2(number % side, number / side);
        vec3 along = parallel_coordinates(face, cube_direction(face, (vec2(place) + 0.5) / float(side)));
        vec2 st = 0.5 + 0.5 * (at.xy - along.xy * at.z) / parallel_reach(along);
        if (any(lessThan(st, vec2(0.0))) || any(greaterThanEqual(st, vec2(1.0)))) continue;
        uvec2 pixel = min(uvec2(st * float(FIV_PARALLEL_SIDE)), uvec2(FIV_PARALLEL_SIDE - 1u));
        uint word = depths[((number * FIV_PARALLEL_SIDE + pixel.y) * FIV_PARALLEL_SIDE + pixel.x) >> 1u];
        uint stored = word >> 16u * (pixel.x & 1u) & 0xffffu;
        if (stored == 0u || float(stored) < depth) continue;
        FivTexel t = texels[(face * size + place.y / split) * size + place.x / split];
        x += t.radiance * (t.area.x * share); // [FIV 10]
        y += t.radiance * (t.area.y * share);
        z += t.radiance * (t.area.z * share);
        angle += t.angle * share;
    }
    uint out_at = 10u * (i * chunks + chunk + gl_WorkGroupID.y);
    for (uint k = 0u; k < 3u; ++k) {
        partials[out_at + k] = x[k];
        partials[out_at + 3u + k] = y[k];
        partials[out_at + 6u + k] = z[k];
    }
    partials[out_at + 9u] = angle;
}
