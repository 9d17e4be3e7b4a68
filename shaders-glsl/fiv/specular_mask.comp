// Share of the light of each cell of the environment that an occluder hides from many points: a ray for each texel. A
// workgroup has one point and one tile of 8×8 texels, which are four cells of 4×4 texels.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "fiv/fiv.glsl"
#include "fiv/specular.glsl"
#include "lib/trace.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Weights { float weights[]; }; // share of each texel in the light of its cell
layout(binding = 1, scalar) readonly buffer Points { FivPoint points[]; };
layout(binding = 2, scalar) readonly buffer Turns { FivTurn turns[]; };
layout(binding = 3, scalar) writeonly buffer Shares { uint shares[]; }; // a word for each point and tile, a byte for each cell

layout(push_constant, scalar) uniform Push {
    uint first; // first point
    uint size;  // texels of the environment along an edge
    uint words; // words of a point
};

shared float hidden[64];

void main() {
    uint lane = gl_LocalInvocationID.x;
    // Bits of column and row alternate, so the 16 invocations of a cell lie next to each other.
    uvec2 within = uvec2(lane & 1u | (lane >> 1u & 2u) | (lane >> 2u & 4u), (lane >> 1u & 1u) | (lane >> 2u & 2u) | (lane >> 3u & 4u));
    uint row = size / 8u, tile = gl_WorkGroupID.y, point = gl_WorkGroupID.x;
    uint face = tile / (row * row), place = tile % (row * row);
    uvec2 at = 8u * uvec2(place % row, place / row) + within;
    vec3 origin = points[first + point].at;
    FivTurn turn = turns[points[first + point].turn];
    vec3 start = turn.centre + turn.geometry_from_world * origin;
    float rho2 = dot(origin, origin), radius2 = turn.radius * turn.radius;
    float weight = weights[(face * size + at.y) * size + at.x];
    vec3 direction = cube_direction(face, (vec2(at) + 0.5) / float(size));
    float along = -dot(origin, direction), squared = dot(direction, direction);
    // Only rays that meet the bounding sphere can hit the occluder.
    bool met = weight > 0.0 && (rho2 <= radius2 || (along > 0.0 && along * along >= (rho2 - radius2) * squared));
    if (met) {
        // The random number of a blended surface depends only on the point and the ray.
        uint salt = pcg4d(uvec4(floatBitsToUint(origin), at.x + size * (at.y + size * face))).x;
        Ray ray = Ray(start, 0.0, turn.geometry_from_world * direction, 1.01 * (sqrt(rho2) + turn.radius));
        met = trace_any(ray, TRACE_SHADOW, salt);
    }
    hidden[lane] = met ? weight : 0.0;
    barrier();
    for (uint step = FIV_CELL * FIV_CELL / 2u; step > 0u; step >>= 1u) {
        if ((lane & 15u) < step) hidden[lane] += hidden[lane + step];
        barrier();
    }
    if (lane == 0u) {
        vec4 cells = vec4(hidden[0], hidden[16], hidden[32], hidden[48]);
        shares[point * words + tile] = packUnorm4x8(cells);
    }
}
