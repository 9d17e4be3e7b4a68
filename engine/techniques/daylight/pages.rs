//! Images in blocks on the device: pages of textures, of which each image of a tile has a square.

use ash::vk;

use super::{
    Baked,
    blocks::{Coding, Layout, SIDE},
};
use crate::{
    Result,
    gpu::{Gpu, ImageDesc, OwnedImage, Region},
    graph::{Graph, Image},
};

/// Largest side of a page, texels, if a tile is not larger.
const MOST_SIDE: u32 = 2048;

/// The textures of a bake.
#[derive(Debug)]
pub(super) struct BlockPages {
    /// BC6H.
    hdr: Option<OwnedImage>,
    /// BC5: red and green.
    pairs: Option<OwnedImage>,
    /// BC4: blue.
    blues: Option<OwnedImage>,
}

/// The layers of an array of textures, filled image by image.
struct Filling {
    /// Bytes of a block.
    bytes: usize,
    /// Blocks along a side of an image's square.
    side: u32,
    /// Images along a side of a page.
    along: u32,
    layers: Vec<Vec<u8>>,
}

impl Filling {
    fn new(count: u32, side: u32, bytes: usize) -> Self {
        let along = (MOST_SIDE / (SIDE * side)).max(1).min(f64::from(count).sqrt().ceil() as u32).max(1);
        let layer = vec![0; (along * along * side * side) as usize * bytes];
        Self { bytes, side, along, layers: vec![layer; count.div_ceil(along * along) as usize] }
    }

    /// Puts a block of an image in its place.
    fn put(&mut self, slot: u32, [column, row]: [u32; 2], block: &[u8]) {
        let (on_page, layer) = (slot % (self.along * self.along), slot / (self.along * self.along));
        let [x, y] = [on_page % self.along * self.side + column, on_page / self.along * self.side + row];
        let at = (y * self.along * self.side + x) as usize * self.bytes;
        self.layers[layer as usize][at..at + self.bytes].copy_from_slice(block);
    }

    /// `None`: there are no images.
    fn uploaded(self, gpu: &Gpu, name: &str, format: vk::Format) -> Result<Option<OwnedImage>> {
        if self.layers.is_empty() {
            return Ok(None);
        }
        let texels = SIDE * self.along * self.side;
        let desc = ImageDesc::new(format, texels, texels).layers(self.layers.len() as u32);
        let regions: Vec<Region<'_>> =
            (0..).zip(&self.layers).map(|(layer, bytes)| Region { mip: 0, layer, bytes }).collect();
        OwnedImage::with_contents(gpu, name, desc, &regions).map(Some)
    }
}

impl BlockPages {
    /// Uploads the blocks of a bake, in the order of [`super::pictures::packed`].
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if there are more than the device's textures can hold.
    pub fn new(gpu: &Gpu, baked: &Baked) -> Result<Self> {
        let stored = &baked.stored;
        let [_, _, hdr, pairs] = stored.kinds();
        let side = stored.plan.side().div_ceil(SIDE);
        let filling = |count: u64, bytes: usize| Filling::new(count as u32, side, bytes);
        let [mut of_hdr, mut of_pairs, mut of_blues] = [filling(hdr, 16), filling(pairs, 16), filling(pairs, 8)];
        let (mut hdr_slot, mut pair_slot) = (0, 0);
        for (number, tile) in (0..).zip(&stored.tiles) {
            let [_, _, columns, rows] = stored.plan.tile(number);
            let layout = Layout::new(&tile.mask, [columns, rows]);
            for blocks in tile.layers().into_iter().filter_map(|layer| layer.blocks.as_ref()) {
                for image in 0..blocks.images() {
                    let (coding, bytes) = blocks.image(image, &layout);
                    for (corner, block) in layout.corners.iter().zip(bytes.chunks_exact(coding.bytes())) {
                        match coding {
                            Coding::Hdr => of_hdr.put(hdr_slot, *corner, block),
                            Coding::Pair => {
                                of_pairs.put(pair_slot, *corner, &block[..16]);
                                of_blues.put(pair_slot, *corner, &block[16..]);
                            }
                        }
                    }
                    match coding {
                        Coding::Hdr => hdr_slot += 1,
                        Coding::Pair => pair_slot += 1,
                    }
                }
            }
        }
        Ok(Self {
            hdr: of_hdr.uploaded(gpu, "daylight.bc6h", vk::Format::BC6H_SFLOAT_BLOCK)?,
            pairs: of_pairs.uploaded(gpu, "daylight.bc5", vk::Format::BC5_SNORM_BLOCK)?,
            blues: of_blues.uploaded(gpu, "daylight.bc4", vk::Format::BC4_SNORM_BLOCK)?,
        })
    }

    /// Whether there are blocks.
    pub fn are_there(&self) -> bool {
        self.hdr.is_some() || self.pairs.is_some()
    }

    /// The textures of BC6H, of BC5 and of BC4; `other` in place of those that are not there.
    pub fn images(&self, graph: &mut Graph, other: Image) -> [Image; 3] {
        [&self.hdr, &self.pairs, &self.blues]
            .map(|image| image.as_ref().map_or(other, |image| graph.import_image(image)))
    }
}
