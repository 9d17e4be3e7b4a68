// Radiosity of the samples, projected on the vectors of their cluster: one vector for each invocation.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;

// First sample, samples, first weight, vectors of the cluster, and the vector's number there.
struct PrtVector {
    uint first_sample;
    uint samples;
    uint first_weight;
    uint stride;
    uint number;
    float shift;   // coefficient of the mean
    float fixed_value; // coefficient that is there without light
    uint is_mean;
};

layout(binding = 0, scalar) readonly buffer Vectors { PrtVector vectors[]; };
layout(binding = 1, scalar) readonly buffer Weights { float weights[]; };
layout(binding = 2, scalar) readonly buffer Radiosities { vec3 radiosities[]; };
layout(binding = 3, scalar) writeonly buffer Coefficients { vec3 coefficients[]; };

layout(push_constant, scalar) uniform Push { uint count; };

void main() {
    uint v = gl_GlobalInvocationID.x;
    if (v >= count) return;
    PrtVector of = vectors[v];
    vec3 sum = vec3(of.fixed_value - of.shift);
    if (of.is_mean == 0u) {
        for (uint i = 0u; i < of.samples; ++i) {
            sum += weights[of.first_weight + i * of.stride + of.number] * radiosities[of.first_sample + i];
        }
    }
    coefficients[v] = sum;
}
