// Weights of the candidates and their running sum. One workgroup: each invocation sums a range of candidates, then adds the sums of the
// ranges before it.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/vpl.glsl"

layout(local_size_x = 256) in;

layout(binding = 0, scalar) readonly buffer Candidates { Vpl candidates[]; };
layout(binding = 1, scalar) readonly buffer Importances { float importances[]; };
layout(binding = 2, scalar) writeonly buffer Weights { float weights[]; };
layout(binding = 3, scalar) writeonly buffer Sums { float sums[]; };

layout(push_constant, scalar) uniform Push {
    uint total;
};

// Share of the probability that follows the flux alone. There are few visible points; a candidate that lights none of them may still light
// other parts of the view.
const float BY_FLUX = 0.5;

shared float important[256];
shared float flux[256];

float strength(uint i) {
    return dot(candidates[i].flux, vec3(1.0));
}

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint each = (total + 255u) / 256u;
    uint begin = min(lane * each, total), end = min(begin + each, total);
    float a = 0.0, b = 0.0;
    for (uint i = begin; i < end; ++i) {
        a += importances[i];
        b += strength(i);
    }
    important[lane] = a;
    flux[lane] = b;
    barrier();
    float all_important = 0.0, all_flux = 0.0;
    // Sums at both borders of the lane's range. All lanes add in the same order, so that the end of one range equals the start of the next
    // bit for bit.
    vec2 borders[2] = vec2[2](vec2(0.0), vec2(0.0));
    for (uint i = 0u; i < 256u; ++i) {
        if (i == lane) borders[0] = vec2(all_important, all_flux);
        all_important += important[i];
        all_flux += flux[i];
        if (i == lane) borders[1] = vec2(all_important, all_flux);
    }
    float by_flux = all_important > 0.0 ? BY_FLUX : 1.0;
    float k_important = all_important > 0.0 ? (1.0 - by_flux) / all_important : 0.0;
    float k_flux = all_flux > 0.0 ? by_flux / all_flux : 0.0;
    precise float last = k_important * borders[0].x + k_flux * borders[0].y;
    precise float most = k_important * borders[1].x + k_flux * borders[1].y;
    a = borders[0].x;
    b = borders[0].y;
    for (uint i = begin; i < end; ++i) {
        a += importances[i];
        b += strength(i);
        precise float sum = k_important * a + k_flux * b;
        // Rounding must not make the sum fall. The weight is the difference of the rounded sums, because this difference is the actual
        // probability of the draw.
        sum = i + 1u == end ? most : clamp(sum, last, most);
        weights[i] = sum - last;
        sums[i] = sum;
        last = sum;
    }
}
