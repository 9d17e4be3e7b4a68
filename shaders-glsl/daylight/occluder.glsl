// The triangle that hid the sun from a point at one time. It most often hides the sun at the next times too, and then a few products replace a shadow
// ray.
// Before including: lib/hit_surface.glsl, lib/material.glsl, daylight/sun_ray.glsl.

// The way from the point to a place of the triangle is a sum of the ways to its corners. The weights of that sum are products of the direction and
// of these vectors. All are 0 where the triangle is left out.
struct DayOccluder {
    vec3 weights[3];
};

// Weights below this share of their sum are too near to a side of the triangle: rounding might see the wrong side.
const float OCCLUDER_MARGIN = 1e-3;
// The volume of point and triangle, relative to that of three orthogonal edges of the same lengths. Below it, the triangle is seen from
// its side, or it is small and far away.
const float OCCLUDER_VOLUME = 1e-3;

DayOccluder no_occluder() {
    return DayOccluder(vec3[](vec3(0.0), vec3(0.0), vec3(0.0)));
}

// The triangle as an occluder, seen from a point. Triangles that are not there everywhere are left out.
DayOccluder occluder_of(uint instance, uint triangle, vec3 from) {
    if ((MATERIAL_AT(INSTANCE_AT(instance).material).flags & (MATERIAL_MASK | MATERIAL_BLEND)) != 0u) return no_occluder();
    vec3 corners[3] = surface_corners(instance, surface_vertices(instance, triangle));
    vec3 a = corners[0] - from, b = corners[1] - from, c = corners[2] - from;
    vec3 across = cross(b, c);
    float volume = dot(a, across);
    if (!(abs(volume) > OCCLUDER_VOLUME * length(a) * length(b) * length(c))) return no_occluder();
    return DayOccluder(vec3[](across / volume, cross(c, a) / volume, cross(a, b) / volume));
}

// Whether the triangle is in the way of a ray from the point, well within its sides.
bool is_hidden(DayOccluder occluder, DaySunRay ray) {
    vec3 w = vec3(dot(occluder.weights[0], ray.direction), dot(occluder.weights[1], ray.direction), dot(occluder.weights[2], ray.direction));
    float sum = w.x + w.y + w.z;
    // The triangle's plane is at the distance 1 / sum.
    return min(w.x, min(w.y, w.z)) > OCCLUDER_MARGIN * sum && sum * ray.far > 1.0 + OCCLUDER_MARGIN;
}
