// Layers of the sums over samples (see reference/path_sums.glsl), and the layers of the picture that is computed from them.
#ifndef LIB_PATH_LAYERS
#define LIB_PATH_LAYERS

const uint PATH_SUMS = 6u; // export
// The first PATH_EXACT_SUMS layers also have layers for their rounding errors.
const uint PATH_EXACT_SUMS = 3u; // export

const uint SHOWS_TOTAL = 0u; // export
const uint SHOWS_EMISSION = 1u; // export
const uint SHOWS_DIRECT = 2u; // export
const uint SHOWS_INDIRECT = 3u; // export
const uint SHOWS_ALBEDO = 4u; // export
const uint SHOWS_NORMAL = 5u; // export
const uint SHOWS_POSITION = 6u; // export
const uint SHOWS_DEPTH = 7u; // export
const uint SHOWS_SAMPLES = 8u; // export
const uint SHOWS_VARIANCE = 9u; // export

#endif
