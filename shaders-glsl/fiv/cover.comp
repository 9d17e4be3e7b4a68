// Vectors of the light that an occluder hides from many points ([FIV 10]): one ray per texel makes the occluder's mask
// on the cube map, and the covered texels are summed up (Michael 2010, section 3.3.2). Or, for samples on the
// occluder's surface, vectors of the light that remains in front of each sample. A workgroup has one point and some
// tiles of 8×8 texels.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "fiv/fiv.glsl"
#include "lib/trace.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Texels { FivTexel texels[]; };
layout(binding = 1, scalar) readonly buffer Points { FivPoint points[]; };
layout(binding = 2, scalar) writeonly buffer Partials { float partials[]; }; // ten floats for each point and chunk
layout(binding = 3, scalar) readonly buffer Turns { FivTurn turns[]; };
layout(binding = 4, scalar) readonly buffer Normals { vec3 normals[]; }; // of the samples on the surface

layout(push_constant, scalar) uniform Push {
    uint first;   // first point
    uint size;    // texels of the environment along an edge
    uint split;   // rays along the edge of a texel
    uint tiles;   // tiles of a chunk
    uint own;     // 1: the points lie on the occluder's surface, and the visible light in front of them is summed up
};

shared vec3 sums[3][64];
shared float covered[64];

void main() {
    uint lane = gl_LocalInvocationID.x;
    // Eight neighbouring invocations form a block of 4×2 texels, because CPU drivers run them together.
    uvec2 within = uvec2(lane & 3u | (lane >> 3u & 1u) << 2u, lane >> 2u & 1u | (lane >> 4u & 3u) << 1u);
    uint side = size * split, row = side / 8u;
    vec3 origin = points[first + gl_WorkGroupID.x].at;
    FivTurn turn = turns[points[first + gl_WorkGroupID.x].turn];
    float radius = turn.radius;
    vec3 start = turn.centre + turn.geometry_from_world * origin;
    vec3 normal = own != 0u ? normals[first + gl_WorkGroupID.x] : vec3(0.0);
    float rho2 = dot(origin, origin), radius2 = radius * radius;
    float share = 1.0 / float(split * split);
    vec3 x = vec3(0.0), y = vec3(0.0), z = vec3(0.0);
    float angle = 0.0;
    uint begin = gl_WorkGroupID.y * tiles, end = min(begin + tiles, 6u * row * row);
    for (uint tile = begin; tile < end; ++tile) {
        uint face = tile / (row * row), place = tile % (row * row);
        uvec2 at = 8u * uvec2(place % row, place / row) + within;
        vec3 direction = cube_direction(face, (vec2(at) + 0.5) / float(side));
        // Only rays that meet the bounding sphere can hit the occluder. The test uses the distance of the line from the
        // centre, which stays exact at a great distance.
        vec3 across = cross(origin, direction);
        bool near = rho2 <= radius2
            || (dot(origin, direction) < 0.0 && dot(across, across) <= radius2 * dot(direction, direction));
        FivTexel t = texels[(face * size + at.y / split) * size + at.x / split];
        if (own != 0u ? dot(t.area, normal) <= 0.0 : !near) continue;
        if (near) {
            // The random number of a blended surface depends only on the point and the ray, so a sample does not depend
            // on the other samples of the dispatch.
            uint salt = pcg4d(uvec4(floatBitsToUint(origin), at.x + side * (at.y + side * face))).x;
            Ray ray = Ray(start, 0.0, turn.geometry_from_world * direction, 1.01 * (sqrt(rho2) + radius));
            if (trace_any(ray, TRACE_SHADOW, salt) == (own != 0u)) continue;
        }
        x += t.radiance * (t.area.x * share); // [FIV 10]
        y += t.radiance * (t.area.y * share);
        z += t.radiance * (t.area.z * share);
        angle += t.angle * share;
    }
    sums[0][lane] = x;
    sums[1][lane] = y;
    sums[2][lane] = z;
    covered[lane] = angle;
    barrier();
    for (uint step = 32u; step > 0u; step >>= 1u) {
        if (lane < step) {
            for (uint k = 0u; k < 3u; ++k) sums[k][lane] += sums[k][lane + step];
            covered[lane] += covered[lane + step];
        }
        barrier();
    }
    uint out_at = 10u * (gl_WorkGroupID.x * gl_NumWorkGroups.y + gl_WorkGroupID.y);
    if (lane < 9u) partials[out_at + lane] = sums[lane / 3u][0][lane % 3u];
    if (lane == 9u) partials[out_at + 9u] = covered[0];
}
