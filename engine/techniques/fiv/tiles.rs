//! What is known of tiles of pixels before light is: which occluders may matter to them, and which of those can overlap.

use super::{Settings, Specular};
use crate::{
    graph::{Buffer, Extent, Graph},
    passes::gbuffer::GBuffer,
    shaders::fiv,
};

/// Pixels along the edge of a tile of `near.comp`.
const TILE: u32 = 8;
/// Turns of the loops over occluders of one invocation: some milliseconds on a GPU; and where a driver ends loops early.
const MOST_TURNS: u32 = 1 << 20;
const TURNS_LIMITED: u32 = 20_000;
/// Occluders of which a pixel keeps how it sees them, 28 bytes each.
const MOST_HELD: u32 = 128;
/// Bytes of the rows of occluders that can overlap, about.
const MOST_PAIRS: u64 = 64 << 20;

/// Lists of the tiles of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Tiles {
    /// Occluders that may matter, a bit each.
    pub near: Buffer,
    /// Of the bits of a tile.
    pub words: u32,
    /// Occluders for which light can be summed up in one call.
    pub each: u32,
    occluders: Buffer,
    count: u32,
    boxes: Buffer,
    pairs: Buffer,
    extent: Extent,
}

impl Tiles {
    /// Declares the pass that lists what may matter among the first `count` of `occluders`; `matter`: the table of
    /// [`negligible`](super::negligible), if something is negligible; `limited`: the driver ends loops early.
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
        // Without the correction for partial occluders those whose centres are in front matter to others; but a surface has the centre of
        // its own occluder behind it, and lights kept apart and reflections ask for all that is in front.
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
        // With the correction each occluder looks at all others at most.
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

    /// Of how many occluders a pixel keeps how it sees them, for the correction; 1: of none. On a CPU driver pairs cost less so. It takes
    /// memory of each invocation, which ends with [`MOST_HELD`], and of which a GPU, with its thousands of invocations, has little.
    pub fn held(&self, settings: &Settings) -> u32 {
        let overlap = settings.overlap && self.count > 1;
        if overlap && self.count <= MOST_HELD { self.count.next_power_of_two().max(8) } else { 1 }
    }

    /// Declares the pass that finds which occluders can overlap one of these, and gives its rows of bits.
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
