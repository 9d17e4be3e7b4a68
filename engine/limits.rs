//! Limits for files that may be hostile.

/// Limits on what a scene file may ask for. Reading never allocates more than these allow.
#[derive(Clone, Debug)]
pub struct Limits {
    /// Bytes of one file.
    pub max_file: u64,
    /// Bytes of one decoded buffer or image, and of all decoded texels together ×4.
    pub max_alloc: u64,
    /// Texels of one image.
    pub max_image_pixels: u64,
    /// Vertices and indices of a scene, each.
    pub max_vertices: u64,
    pub max_nodes: u64,
    /// Depth of the node hierarchy.
    pub max_depth: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_file: 2 << 30,
            max_alloc: 1 << 30,
            max_image_pixels: 1 << 28,
            max_vertices: 1 << 28,
            max_nodes: 1 << 20,
            max_depth: 256,
        }
    }
}
