// Draws the virtual lights among the candidates by systematic resampling, in proportion to the weights. The flux is divided by the
// expected number of draws, so that the estimate is unbiased.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/vpl.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Candidates { Vpl candidates[]; };
layout(binding = 1, scalar) readonly buffer Weights { float weights[]; };
layout(binding = 2, scalar) readonly buffer Sums { float sums[]; };
layout(binding = 3, scalar) writeonly buffer Vpls { Vpl vpls[]; };

layout(push_constant, scalar) uniform Push {
    uint total;   // candidates
    uint count;   // virtual lights
    float offset; // in 0..1
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= count) return;
    float all = sums[total - 1u];
    // Equal steps through the running sum. The position stays below the total, because the last candidates may have no weight.
    float wanted = min((float(at) + offset) / float(count), 0.99999994) * all;
    if (wanted >= all) wanted = 0.0;
    uint low = 0u, high = total - 1u;
    while (low < high) {
        uint middle = (low + high) / 2u;
        if (sums[middle] > wanted) high = middle;
        else low = middle + 1u;
    }
    Vpl vpl = candidates[low];
    float weight = weights[low];
    vpl.flux = weight > 0.0 && all > 0.0 ? vpl.flux * (all / (weight * float(count))) : vec3(0.0);
    vpls[at] = vpl;
}
