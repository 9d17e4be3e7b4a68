// Weights of the fast way, at signed distances −48 to 47: [group][distance / 32][distance % 32], zero beyond the radii. Four Gaussians
// lie in each vec4.
struct TonemapWeights {
    vec4 at[32];
};

struct TonemapKernels {
    TonemapWeights part[18];
};

// Of the search among averages, what is not of their number.
struct TonemapChoice {
    float slope;
    float offset[16];
};
