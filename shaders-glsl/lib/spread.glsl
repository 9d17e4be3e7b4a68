// Which texel an invocation works at, where the work of texels differs much: in workgroups of 8 × 8.
#ifndef LIB_SPREAD
#define LIB_SPREAD

uint spread_divisor(uint a, uint b) {
    while (b != 0u) {
        uint rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}

// CPU drivers give each of their threads one run of workgroups, and a picture's floor may take ten times its ceiling: so rows of
// workgroups follow each other by the golden ratio of their number, and each run has some of everywhere. Within a workgroup, eight
// invocations make a block of 4 × 2 texels, which have more in common than a row of eight.
ivec2 spread_texel() {
    uint rows = gl_NumWorkGroups.y;
    uint stride = max(uint(0.618034 * float(rows)), 1u);
    while (spread_divisor(rows, stride) != 1u) {
        ++stride;
    }
    uint local = gl_LocalInvocationIndex;
    uvec2 place = uvec2(local & 3u | (local >> 3u & 1u) << 2u, local >> 2u & 1u | (local >> 4u & 3u) << 1u);
    return ivec2(uvec2(gl_WorkGroupID.x, gl_WorkGroupID.y * stride % rows) * 8u + place);
}

#endif
