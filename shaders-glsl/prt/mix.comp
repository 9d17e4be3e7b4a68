// The vectors of the receivers of each cluster, from the coefficients of all light.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Rows { float rows[]; };  // a row of all vectors of light for each vector of receivers
layout(binding = 1, scalar) readonly buffer Coefficients { vec3 coefficients[]; };
layout(binding = 2, scalar) writeonly buffer Mixed { vec3 mixed[]; };

layout(push_constant, scalar) uniform Push {
    uint count;    // vectors of receivers of all clusters
    uint vectors;  // of light
};

void main() {
    uint r = gl_GlobalInvocationID.x;
    if (r >= count) return;
    vec3 sum = vec3(0.0);
    for (uint v = 0u; v < vectors; ++v) sum += rows[r * vectors + v] * coefficients[v];
    mixed[r] = sum;
}
