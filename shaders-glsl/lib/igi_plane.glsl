// How far places of the picture lie from a pixel's plane. Include lib/view.glsl before.
#ifndef LIB_IGI_PLANE
#define LIB_IGI_PLANE

// n · (X - P) / (z range) of what is seen at uv in depth w is base + along uv + (ray + across uv) w.
struct PixelPlane {
    float base;
    float ray;
    vec2 along;
    vec2 across;
};

// Of a pixel at `position` (metres), linear depth z, with unit normal n. `range`: distance relative to the pixel's depth that counts as 1;
// 0: everything lies in the plane.
PixelPlane pixel_plane(View view, vec3 position, float z, vec3 n, float range) {
    float scale = range > 0.0 ? 1.0 / (z * view.far * range) : 0.0;
    PixelPlane plane;
    plane.base = dot(n, view.base_o - position) * scale;
    plane.ray = dot(n, view.frustum_o) * scale;
    plane.along = vec2(dot(n, view.base_u), dot(n, view.base_v)) * scale;
    plane.across = vec2(dot(n, view.frustum_u), dot(n, view.frustum_v)) * scale;
    return plane;
}

float off_plane(PixelPlane plane, vec2 uv, float w) {
    return plane.base + dot(plane.along, uv) + (plane.ray + dot(plane.across, uv)) * w;
}

#endif
