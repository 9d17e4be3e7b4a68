// The samples and pixels of paths. Before including: `settings`, and of the push constants `first`, the slot of the first path within its sample,
// and `sample_index`, the sample of that path. The paths of a dispatch may belong to several samples.

// Number of the sample of a path.
uint sample_of(uint slot) {
    return sample_index + (first + slot) / settings.slots;
}

// Pixel of a path. Slots are ordered by blocks of 8 × 8 pixels, so that the rays of a workgroup are close to each other.
uvec2 pixel_of(uint slot) {
    uint at = settings.first_slot + (first + slot) % settings.slots;
    uint block = at / 64u;
    uint inside = at % 64u;
    uvec2 corner = 8u * uvec2(block % settings.blocks, block / settings.blocks);
    return corner + uvec2(inside % 8u, inside / 8u);
}
