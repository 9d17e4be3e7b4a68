// Contrasts of one level of a pyramid of log10 L: the weight and the mapped value of each (Mantiuk 2006).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D logarithm;
layout(binding = 1, r32f) uniform writeonly image2D across;  // weights
layout(binding = 2, r32f) uniform writeonly image2D down;
layout(binding = 3, r32f) uniform writeonly image2D flow_across;  // weights times the wanted contrast
layout(binding = 4, r32f) uniform writeonly image2D flow_down;

layout(push_constant, scalar) uniform Push {
    float scale;  // of the response
};

const float FACTOR = 0.038737;  // of the threshold ΔG = FACTOR · G^(1 − POWER)
const float POWER = 0.462244;
const float LINEAR = 0.0211893;  // log10(1.05): below it the threshold is that of this contrast

// Response R to a contrast G: the integral of 1 / ΔG. In units of 1 / (FACTOR · POWER), less what LINEAR^POWER would be.
float response(float g) {
    return g <= LINEAR ? POWER * (g / LINEAR - 1.0) * pow(LINEAR, POWER) : pow(g, POWER) - pow(LINEAR, POWER);
}

float contrast(float r) {
    return r <= 0.0 ? max(LINEAR * (1.0 + r / (POWER * pow(LINEAR, POWER))), 0.0) : pow(r + pow(LINEAR, POWER), 1.0 / POWER);
}

// The response is 0 where there is no contrast.
float scaled(float g) {
    float none = response(0.0);
    return contrast(none + scale * (response(g) - none));
}

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    ivec2 extent = imageSize(across);
    if (any(greaterThanEqual(at, extent))) return;
    float own = texelFetch(logarithm, at, 0).r;
    vec2 weights = vec2(0.0);
    vec2 flow = vec2(0.0);
    for (int i = 0; i < 2; ++i) {
        ivec2 next = at + ivec2(1 - i, i);
        if (all(lessThan(next, extent))) {
            float g = texelFetch(logarithm, next, 0).r - own;
            float wanted = scaled(abs(g));
            weights[i] = 1.0 / (FACTOR * pow(max(wanted, 0.001), 1.0 - POWER));
            flow[i] = weights[i] * sign(g) * wanted;
        }
    }
    imageStore(across, at, vec4(weights.x));
    imageStore(down, at, vec4(weights.y));
    imageStore(flow_across, at, vec4(flow.x));
    imageStore(flow_down, at, vec4(flow.y));
}
