// Latitude-longitude environment maps: +Y up, the centre of the image looks down -Z, u grows towards +X there.
#ifndef LIB_ENVIRONMENT
#define LIB_ENVIRONMENT

// uv of a unit direction; `rotation` (radians about +Y, counter-clockwise from above) is that of the environment.
vec2 environment_uv(vec3 direction, float rotation) {
    float s = sin(rotation), c = cos(rotation);
    vec3 d = vec3(c * direction.x - s * direction.z, direction.y, s * direction.x + c * direction.z);
    return vec2(0.5 + atan(d.x, -d.z) * 0.15915494, acos(clamp(d.y, -1.0, 1.0)) * 0.31830989);
}

#endif
