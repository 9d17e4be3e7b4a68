// Radiosity of the samples: albedo times irradiance.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Albedos { vec3 albedos[]; };
layout(binding = 1, scalar) readonly buffer Direct { vec3 direct[]; };      // irradiance, W/m²
layout(binding = 2, scalar) readonly buffer Indirect { vec3 indirect[]; };
layout(binding = 3, scalar) writeonly buffer Radiosities { vec3 radiosities[]; };

layout(push_constant, scalar) uniform Push {
    uint count;
    uint indirectly;  // 1: with `indirect`
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    vec3 light = direct[i];
    if (indirectly != 0u) light += indirect[i];
    radiosities[i] = albedos[i] * light;
}
