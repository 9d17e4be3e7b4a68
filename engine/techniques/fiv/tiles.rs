//! Lists for tiles of pixels that precede the irradiance pass: the occluders that may affect a tile, and the pairs of
//! them that may overlap.

use super::{Settings, Specular};
use crate::{
    graph::{Buffer, Extent, Graph},
    passes::gbuffer::GBuffer,
    shaders::fiv,
};

/// Pixels along an edge of a tile of `near.comp`.
const TILE: u32 = 8;
/// Most iterations of the loops over occluders in one invocation: for some milliseconds on a GPU, and for drivers that
/// end loops early.
const MOST_TURNS: u32 = 1 << 20;
const TURNS_LIMITED: u32 = 20_000;
/// Most occluders whose direction and size a pixel keeps, 28 bytes each.
const MOST_HELD: u32 = 128;
/// Bytes of the rows of overlapping occluders, approximately.
const MOST_PAIRS: u64 = 64 << 20;

/// Lists of the tiles of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Tiles {
    /// Occluders that may affect a tile, a bit each.
    pub near: Buffer,
    /// Words of a tile.
    pub words: u32,
    /// Occluders that one call of the irradiance pass can process.
    pub each: u32,
    occluders: Buffer,
    count: u32,
    boxes: Buffer,
    pairs: Buffer,
    extent: Extent,
}

impl Tiles {
    /// Declares the pass that lists the occluders among the first `count` of `occluders` that may affect each tile.
    /// `matter`: the table of [`negligible`](super::negligible), and whether occluders may be negligible. `limited`:
    /// the driver ends loops early.
    pub fn new(
        graph: &mut Graph,
        gbuffer: &GBuffer,
        (occluders, count): (Buffer, u32),
        matter: (Buffer, bool),
        settings: &Settings,
        limited: bool,
    ) -> Self {
        let extent = graph.extent(gbuffer.depth);
        let tiles = Extent::new(extent.width.div_ceil(TILE), extent.height.div_ceil(TILE));
        let words = count.div_ceil(32).max(1);
        let row = 4 * tiles.pixels() * u64::from(words);
        let near = graph.buffer("fiv.near", row);
        let boxes = graph.buffer("fiv.tiles", 16 * tiles.pixels());
        // Without the correction for partial occluders, occluders with their centres behind the plane do not affect a
        // surface. But a surface lies in front of the centre of its own occluder, and separated texels and reflections
        // need every occluder that reaches in front of the plane.
        let whole = settings.suns > 0 || settings.specular != Specular::Off;
        let partial = settings.partial || whole || settings.self_shadow && !settings.on_surface();
        let args = fiv::near::Args {
            view: gbuffer.view,
            normal: gbuffer.normal,
            depth: gbuffer.depth,
            occluders,
            near,
            boxes,
            matter: matter.0,
            push: fiv::near::Push { count, words, negligible: settings.negligible },
            spec: fiv::near::Spec { partial: partial.into(), negligible: matter.1.into() },
        };
        graph.compute(args, extent);
        // The overlap correction compares each occluder with all others at most.
        let turns = if settings.overlap { count + words + 8 } else { 8 };
        let most = if limited { TURNS_LIMITED } else { MOST_TURNS };
        let mut each = (most / turns).max(1);
        let overlap = settings.overlap && count > 1;
        if overlap {
            each = each.min((MOST_PAIRS / row.max(1)).clamp(1, u64::from(u32::MAX)) as u32);
        }
        let bytes = if overlap { row * u64::from(each.min(count)) } else { 4 };
        let pairs = graph.buffer("fiv.pairs", bytes);
        if !overlap {
            graph.fill(pairs, 0);
        }
        Self { near, words, each, occluders, count, boxes, pairs, extent: tiles }
    }

    /// The number of occluders whose direction and size each pixel keeps for the overlap correction; 1 for none. On a
    /// CPU driver the overlap of pairs is then cheaper to compute. The list needs memory in each invocation, which
    /// [`MOST_HELD`] limits. A GPU with its thousands of invocations has little memory for such lists.
    pub fn held(&self, settings: &Settings) -> u32 {
        let overlap = settings.overlap && self.count > 1;
        if overlap && self.count <= MOST_HELD { self.count.next_power_of_two().max(8) } else { 1 }
    }

    /// Declares the pass that finds which occluders may overlap one of these occluders. Returns a row of bits for each
    /// of them.
    pub fn pairs(&self, graph: &mut Graph, (first, count): (u32, u32), settings: &Settings) -> Buffer {
        if settings.overlap && self.count > 1 {
            let args = fiv::pairs::Args {
                occluders: self.occluders,
                near: self.near,
                boxes: self.boxes,
                pairs: self.pairs,
                push: fiv::pairs::Push { occluder_count: self.count, first, count, words: self.words },
            };
            graph.compute(args, [64 * self.extent.width, self.extent.height, 1]);
        }
        self.pairs
    }
}
