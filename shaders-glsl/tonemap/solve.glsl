// Shared by the shaders of the solver: the state of the conjugate gradients, and the weights of the edges between pixels.
//
// The edge to the right of a pixel has its weight in `across`, the edge below it in `down`; both are 0 where no pixel follows.

struct TonemapSolve {
    float energy;    // r · z of the last step
    float first;     // r · z of the first step
    float alpha;
    float beta;
    float right;     // |b|²
    float residual;  // |b − Ax| / |b| of the solution
    uint done;       // 1: the solution is within the tolerance, and all passes that follow leave at once
    uint steps;
};

// Pixels of a column that one invocation of solve_dot has.
const uint TONEMAP_DOT_ROWS = 32;  // export
// Invocations of solve_scalar.
const uint TONEMAP_SOLVE_SUMS = 256;
// Uses of a sum by solve_scalar.
const uint TONEMAP_SOLVE_FIRST = 0;  // export
const uint TONEMAP_SOLVE_STEP = 1;  // export
const uint TONEMAP_SOLVE_NEXT = 2;  // export
const uint TONEMAP_SOLVE_RIGHT = 3;  // export
const uint TONEMAP_SOLVE_RESIDUAL = 4;  // export
const uint TONEMAP_SOLVE_MEAN = 5;  // export
// Side of the level that solve_coarse relaxes in one group.
const uint TONEMAP_COARSE = 16;  // export
