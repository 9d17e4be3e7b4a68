// The bound of one direction, and the bound for all directions and radii around it
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "fiv/fiv.glsl"
layout(local_size_x = 64) in;
struct MatterQuery { vec3 around; float off; float most; vec3 direction; float radius; };
layout(binding = 0, scalar) readonly buffer Matter { float matter[]; };
layout(binding = 1, scalar) readonly buffer Queries { MatterQuery queries[]; };
layout(binding = 2, scalar) writeonly buffer Bounds { vec2 bounds[]; };
#include "fiv/matter.glsl"
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= queries.length()) return;
    MatterQuery q = queries[i];
    bounds[i] = vec2(fiv_matter(q.direction, q.radius), fiv_matter_around(q.around, q.off, q.most));
}
