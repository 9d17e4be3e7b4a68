// The terms of isr/isr.glsl at given points: for comparison with the CPU reference.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "isr/isr.glsl"
layout(local_size_x = 64) in;
struct TermQuery {
    vec3 p;
    vec3 p_normal;
    vec3 x;
    vec3 x_normal;
    float radius;
    float bias;
};
layout(binding = 0, scalar) readonly buffer Queries { TermQuery queries[]; };
layout(binding = 1, scalar) writeonly buffer Answers { vec4 answers[]; };
layout(binding = 2, scalar) writeonly buffer Places { vec4 places[]; };
layout(push_constant, scalar) uniform Push {
    uint samples;
    uint rings;
    uint jittered;
    float reach;
    float spread;
};
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(queries.length())) {
        TermQuery q = queries[i];
        float f = isr_form_factor(q.p, q.p_normal, q.x, q.x_normal, 0.0);
        float o = isr_occlusion(q.p, q.p_normal, q.x, q.radius, q.bias);
        answers[i] = vec4(f, o, isr_form_factor(q.p, q.p_normal, q.x, q.x_normal, q.radius), 0.0);
    }
    // 16 jitters of all samples: place i is sample i % samples of texel i / samples.
    if (i < samples * 16u) {
        uint texel = i / samples;
        vec2 jitter = jittered != 0u ? isr_jitter(ivec2(texel % 4u, texel / 4u)) : vec2(0.5);
        places[i] = vec4(isr_sample(i % samples, samples, rings != 0u, reach, spread, jitter, jittered != 0u), 0.0);
    }
}
