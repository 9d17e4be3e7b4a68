// Which of the texels under a coarse texel take part, and with what weight. Twin: engine/reference/isr.rs.

// 0: the mean of all four (dissertation). 1: the mean of those on the nearest surface, so that a coarse texel never lies
// between two surfaces.
bool downsample_takes(float z, float nearest, uint aware, float tolerance) {
    return aware == 0u || (z < 1.0 && z <= nearest * (1.0 + tolerance)) || nearest >= 1.0;
}
