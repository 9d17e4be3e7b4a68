// Faces of directions, texels beside borders, and patches of the sky: for the comparison with their twins on the processor.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/sampling.glsl"
#include "daylight/daylight.glsl"
#include "daylight/cube.glsl"

layout(local_size_x = 64) in;

struct DayLookup {
    vec3 direction;
    uint face;
    vec2 place;
    uint sky_patch;
    uint there;
    uvec3 texel;     // of the one at `step` from the border
    ivec2 step;
};

layout(binding = 0, scalar) buffer Lookups { DayLookup lookups[]; };

layout(push_constant, scalar) uniform Push {
    uint count;
    uint side;
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    vec2 place;
    uint face = day_cube_face(lookups[i].direction, place);
    uvec3 texel = uvec3(0u);
    bool there = day_cube_texel(face, lookups[i].step, side, texel);
    lookups[i].face = face;
    lookups[i].place = place;
    lookups[i].sky_patch = sky_patch(normalize(lookups[i].direction));
    lookups[i].there = there ? 1u : 0u;
    lookups[i].texel = texel;
}
