// The distance of visible points from a pixel's tangent plane. Include lib/view.glsl before.
#ifndef LIB_IGI_PLANE
#define LIB_IGI_PLANE

// For the point X seen at uv with linear depth w, n · (X - P) / (z range) is base + along · uv + (ray + across · uv) w.
struct PixelPlane {
    float base;
    float ray;
    vec2 along;
    vec2 across;
};

// The plane of a pixel with world position `position` (metres), linear depth z and unit normal n. `range`: distance, relative to the
// pixel's depth, at which off_plane returns 1; with 0 it always returns 0.
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
