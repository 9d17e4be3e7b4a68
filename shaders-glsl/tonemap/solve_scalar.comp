// The end of a sum of solve_dot, and the step of the conjugate gradients that needs this sum.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/solve.glsl"

layout(local_size_x = 256) in;

layout(binding = 0, scalar) readonly buffer Sums { float sums[]; };
layout(binding = 1, scalar) buffer Solve { TonemapSolve solve; };
layout(binding = 2, scalar) writeonly buffer Means { float means[]; };

layout(push_constant, scalar) uniform Push {
    uint count;       // of sums
    uint stage;       // TONEMAP_SOLVE_…
    float tolerance;  // of r · z, as a share of the first
    float divisor;    // of a mean
    uint mean;        // its number
};

shared float shares[256];

void main() {
    uint lane = gl_LocalInvocationIndex;
    if (solve.done != 0u) return;
    precise float part = 0.0;
    for (uint i = lane; i < count; i += TONEMAP_SOLVE_SUMS) {
        part += sums[i];
    }
    shares[lane] = part;
    barrier();
    for (uint step = 1u; step < 256u; step *= 16u) {
        if (lane % (16u * step) == 0u) {
            precise float group = shares[lane];
            for (uint i = lane + step; i < lane + 16u * step; i += step) {
                group += shares[i];
            }
            shares[lane] = group;
        }
        barrier();
    }
    if (lane != 0u) return;
    float sum = shares[0];
    // Comparisons with NaN are false, so NaN ends the work, too.
    if (stage == TONEMAP_SOLVE_FIRST) {
        solve.energy = sum;
        solve.first = sum;
        solve.done = sum > 0.0 ? 0u : 1u;
    } else if (stage == TONEMAP_SOLVE_STEP) {
        solve.alpha = solve.energy / sum;
        solve.done = sum > 0.0 ? 0u : 1u;
        solve.steps += 1u;
    } else if (stage == TONEMAP_SOLVE_NEXT) {
        // An error that grows so much in one step is rounding: there is nothing left to find.
        bool lost = !(sum < 16.0 * solve.energy);
        solve.beta = sum / solve.energy;
        solve.energy = sum;
        solve.done = !lost && sum > tolerance * solve.first ? 0u : 1u;
    } else if (stage == TONEMAP_SOLVE_RIGHT) {
        solve.right = sum;
    } else if (stage == TONEMAP_SOLVE_RESIDUAL) {
        solve.residual = solve.right > 0.0 ? sqrt(sum / solve.right) : 0.0;
    } else {
        means[mean] = sum / divisor;
    }
}
