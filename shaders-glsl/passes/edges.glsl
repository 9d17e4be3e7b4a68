// Neighbours of a pixel whose light smooth edges take.
#ifndef PASSES_EDGES
#define PASSES_EDGES

const int EDGE_NEIGHBOURS = 8;

// From the pixel to a neighbour, row by row, pixels.
ivec2 edge_neighbour(int number) {
    int cell = number < 4 ? number : number + 1;
    return ivec2(cell % 3, cell / 3) - 1;
}

#endif
