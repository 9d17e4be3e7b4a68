// Shadow maps of virtual lights: three views from each light, which together cover its hemisphere. The hemisphere's axis is the diagonal
// of the three views' axes. A view covers the directions nearest to its own axis; along each of the two other axes they reach from -2 to 1
// times the view's depth. Straight edges stay straight, unlike in paraboloid maps.
// Before including: lib/vpl.glsl, lib/sampling.glsl.
#ifndef LIB_VPL_MAP
#define LIB_VPL_MAP

const uint VPL_MAPS = 3u; // export

// The axes of the views: orthonormal, right-handed, their sum along the normal.
mat3 vpl_map_axes(vec3 normal) {
    const float along = 0.577350269, side = 0.816496581, half_side = 0.408248290, slant = 0.707106781;
    return frame_around(normal) * mat3(vec3(side, 0.0, along), vec3(-half_side, slant, along), vec3(-half_side, -slant, along));
}

// The view that covers a direction, given in the coordinates of the axes.
uint vpl_map_face(vec3 d) {
    if (d.x >= d.y) return d.x >= d.z ? 0u : 2u;
    return d.y >= d.z ? 1u : 2u;
}

// The direction in the view's own coordinates: right, up, and depth.
vec3 vpl_map_turned(vec3 d, uint face) {
    return face == 0u ? d.yzx : face == 1u ? d.zxy : d;
}

// Clip space of the view, with reversed depth and an infinite far plane. Casters nearer than `nearest`, metres, are clipped.
vec4 vpl_map_clip(Vpl vpl, uint face, float nearest, vec3 position) {
    vec3 from = vpl.position + vpl.normal * vpl.gap;
    vec3 v = vpl_map_turned(transpose(vpl_map_axes(vpl.normal)) * (position - from), face);
    return vec4((v.xy + 0.5 * v.z) / 1.5, nearest, v.z);
}

#endif
