// How far a texel is from the surface of another, relative to the depth: what bilateral weights are made of.
// Twin: engine/reference/isr.rs.

// |n · (X - P)| / z: zero on the plane of P, however steeply it is seen.
float bilateral_plane_distance(vec3 p, vec3 p_normal, vec3 x, float eye_z) {
    return abs(dot(p_normal, x - p)) / eye_z;
}
