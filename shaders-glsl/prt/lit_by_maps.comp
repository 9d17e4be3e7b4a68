// Direct light at the samples by shadow maps.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#define LIGHTS_BINDING 1
#define SHADOWS_BINDING 2
#define SHADOW_MAPS_BINDING 3
#include "lib/shadow.glsl"
#include "prt/prt.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Samples { PrtSample samples[]; };
layout(binding = 4, scalar) writeonly buffer Direct { vec3 direct[]; };    // irradiance, W/m²
layout(binding = 5, scalar) writeonly buffer Visible { float visible[]; }; // share of each light that a sample sees; light after light

layout(push_constant, scalar) uniform Push {
    uint count;
    float strength;
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    PrtSample s = samples[i];
    vec3 sum = vec3(0.0);
    for (uint l = 0u; l < light_count; ++l) {
        Light one = light(l);
        float seen = 0.0;
        if (one.kind != LIGHT_DIRECTIONAL) {
            vec3 to_light;
            vec3 e = light_irradiance(one, s.position, to_light) * strength;
            float cosine = dot(to_light, s.normal);
            if (cosine > 0.0 && dot(to_light, s.side) > 0.0 && e != vec3(0.0)) {
                seen = shadow_factor(one, s.position, s.side);
                sum += e * cosine * seen;
            }
        }
        visible[l * count + i] = seen;
    }
    direct[i] = sum;
}
