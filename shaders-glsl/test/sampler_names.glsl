// What test/samplers.comp draws.
const uint SAMPLER_DISC = 0u; // export
const uint SAMPLER_COSINE = 1u; // export
const uint SAMPLER_CONE = 2u; // export
const uint SAMPLER_SPHERE = 3u; // export
const uint SAMPLER_TRIANGLE = 4u; // export
const uint SAMPLER_GGX = 5u; // export
const uint SAMPLER_BSDF = 6u; // export
const uint SAMPLER_ENVIRONMENT = 7u; // export
const uint SAMPLER_LIGHT = 8u; // export
const uint SAMPLER_NUMBERS = 9u; // export
const uint SAMPLER_SUN = 10u; // export
