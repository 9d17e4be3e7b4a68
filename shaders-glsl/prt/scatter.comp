// All scatterings between the bases: the product of a matrix for each colour with the projected light.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Matrices { float matrices[]; };  // column after column: red, green, blue
layout(binding = 1, scalar) readonly buffer Before { vec3 before[]; };
layout(binding = 2, scalar) writeonly buffer After { vec3 after[]; };

layout(push_constant, scalar) uniform Push { uint count; };

void main() {
    uint v = gl_GlobalInvocationID.x;
    if (v >= count) return;
    vec3 sum = vec3(0.0);
    uint all = count * count;
    for (uint u = 0u; u < count; ++u) {
        uint at = u * count + v;
        sum += vec3(matrices[at], matrices[all + at], matrices[2u * all + at]) * before[u];
    }
    after[v] = sum;
}
