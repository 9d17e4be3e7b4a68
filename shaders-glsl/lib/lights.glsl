// The punctual lights of the scene. Before including: #define LIGHTS_BINDING, or take the default.
#ifndef LIB_LIGHTS
#define LIB_LIGHTS

#ifndef LIGHTS_BINDING
#define LIGHTS_BINDING 20
#endif

const uint LIGHT_DIRECTIONAL = 0u; // export
const uint LIGHT_POINT = 1u; // export
const uint LIGHT_SPOT = 2u; // export

struct Light {
    vec3 position;    // metres
    uint kind;        // LIGHT_
    vec3 direction;   // unit, the way the light shines (spot, directional)
    float range;      // metres; 0: no cut-off
    vec3 intensity;   // colour * intensity: W/sr, or W/m2 for directional lights
    uint index;       // its own number
    float spot_scale; // glTF: saturate(cos(angle) * spot_scale + spot_offset)^2; 0 and 1 for other lights
    float spot_offset;
};

layout(binding = LIGHTS_BINDING, scalar) readonly buffer Lights { uint light_count; Light lights[]; };

Light light(uint i) { return lights[i]; }

// Cut-off window of KHR_lights_punctual: 1 at the light, 0 from its range on.
float light_window(Light l, float distance) {
    if (l.range <= 0.0) return 1.0;
    float q = distance / l.range;
    return clamp(1.0 - q * q * q * q, 0.0, 1.0);
}

// Share of the intensity that a spot light sends in the direction -to_light.
float light_cone(Light l, vec3 to_light) {
    float s = clamp(-dot(l.direction, to_light) * l.spot_scale + l.spot_offset, 0.0, 1.0);
    return s * s;
}

// Irradiance (W/m2) without shadow on a plane at `world` that faces the light; `to_light` becomes the unit vector to it.
vec3 light_irradiance(Light l, vec3 world, out vec3 to_light) {
    if (l.kind == LIGHT_DIRECTIONAL) {
        to_light = -l.direction;
        return l.intensity;
    }
    vec3 d = l.position - world;
    float r2 = max(dot(d, d), 1e-8);
    float r = sqrt(r2);
    to_light = d / r;
    return l.intensity * (light_cone(l, to_light) * light_window(l, r) / r2);
}

#endif
