// Lists the occluders that may affect the surfaces of a tile of 8×8 pixels, a bit each. Occluders behind all surfaces
// of the tile or of negligible size are left out. Also computes a sphere around the surfaces of the tile.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "fiv/fiv.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint PARTIAL = 1;
layout(constant_id = 1) const uint NEGLIGIBLE = 0; // occluders that can hide only a small share of the light are left out

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3, scalar) readonly buffer Occluders { FivOccluder occluders[]; };
layout(binding = 4, scalar) writeonly buffer Near { uint near[]; };
layout(binding = 5, scalar) writeonly buffer Boxes { vec4 boxes[]; }; // centre and radius of a sphere around each tile's surfaces, metres
layout(binding = 6, scalar) readonly buffer Matter { float matter[]; };

layout(push_constant, scalar) uniform Push {
    uint count; // number of occluders
    uint words; // words of a tile
    float negligible; // share of the mean irradiance
};

#include "fiv/matter.glsl"

shared vec3 low[64];
shared vec3 high[64];
shared vec3 flat_low[64];
shared vec3 flat_high[64];
shared float over[64];
shared uint bits[2];

void main() {
    uint lane = gl_LocalInvocationIndex;
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    bool inside = all(lessThan(pixel, textureSize(depth, 0)));
    float z = inside ? texelFetch(depth, pixel, 0).r : 1.0;
    bool any = z < 1.0;
    vec3 n = vec3(0.0), p = vec3(0.0);
    if (any) {
        n = decode_normal(texelFetch(normal, pixel, 0));
        p = screen_position(view, pixel, 1.0, z);
    }
    low[lane] = any ? p : vec3(1e30);
    high[lane] = any ? p : vec3(-1e30);
    flat_low[lane] = any ? n : vec3(1.0);
    flat_high[lane] = any ? n : vec3(-1.0);
    barrier();
    for (uint step = 32u; step > 0u; step >>= 1u) {
        if (lane < step) {
            low[lane] = min(low[lane], low[lane + step]);
            high[lane] = max(high[lane], high[lane + step]);
            flat_low[lane] = min(flat_low[lane], flat_low[lane + step]);
            flat_high[lane] = max(flat_high[lane], flat_high[lane + step]);
        }
        barrier();
    }
    vec3 least = low[0], most = high[0];
    bool empty = least.x > most.x;
    // Greatest distance of a surface behind the plane through the middle that has the surface's normal.
    vec3 middle = 0.5 * (least + most);
    over[lane] = any ? dot(middle - p, n) : -1e30;
    barrier();
    for (uint step = 32u; step > 0u; step >>= 1u) {
        if (lane < step) over[lane] = max(over[lane], over[lane + step]);
        barrier();
    }
    uint tile = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    float half_size = 0.50001 * length(most - least);
    if (lane == 0u) boxes[tile] = vec4(middle, half_size + 1e-6 * length(middle));
    for (uint first = 0u; first < count; first += 64u) {
        if (lane < 2u) bits[lane] = 0u;
        barrier();
        uint i = first + lane;
        if (i < count && !empty) {
            vec3 offset = occluders[i].centre - middle;
            float radius = occluders[i].radius;
            vec3 ahead = max(offset * flat_low[0], offset * flat_high[0]);
            float slack = 1e-4 * (length(offset) + length(most - least) + radius);
            float front = ahead.x + ahead.y + ahead.z + over[0] + slack;
            bool matters = front > (PARTIAL != 0u ? -radius : 0.0);
            if (NEGLIGIBLE != 0u && matters) {
                float far = length(offset), near_end = far - half_size - slack;
                float off = 1.42 * (half_size + slack) / max(far, 1e-20);
                if (near_end > radius) matters = fiv_matter_around(offset / far, off, radius / near_end) > negligible;
            }
            if (matters) atomicOr(bits[lane >> 5u], 1u << (lane & 31u));
        }
        barrier();
        uint word = (first >> 5u) + lane;
        if (lane < 2u && word < words) near[tile * words + word] = bits[lane];
        barrier();
    }
}
