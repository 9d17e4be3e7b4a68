//! Indirect light over time: each frame's paths take other numbers, and what they give is averaged over the frames in which a surface
//! is seen.
//!
//! Three things keep this from ghosting and from flickering:
//! - Each pixel looks up where its surface was in the last frame, with the camera of that frame and the surface's own motion (nodes,
//!   skins, morph targets), and takes from there only what lay in the same plane with a like normal.
//! - The last frame's paths are shot again in this frame's scene, and at one pixel of each square of pixels their light is gathered
//!   again. What differs from what they gave in the last frame has changed: it is no chance, for the numbers are the same. The more
//!   has changed the fewer frames count, so that the average lags by about [`Settings::history_lag`] at most; change that goes on for
//!   some frames is smoothed, and the average carried along with it.
//! - With the scene at rest the average goes over [`Settings::history`] frames, and the frames together are as many virtual lights, of
//!   each lamp and each path spread evenly.
//!
//! Nothing is kept on the host: what a frame leaves to the next one is [`Graph::history`] of the runner. The frames must follow each
//! other in `graph.frame`; where a number is left out, or history was forgotten, a frame stands for itself.

use super::{Igi, Settings, Shared, Vpls, halton};
use crate::{
    graph::{Buffer, Draw, Extent, Format, Graph, Image, Load, Raster, Targets},
    passes::gbuffer::GBuffer,
    scene::{
        View,
        cull::Frustum,
        resident::{Batches, Handles},
    },
    shaders::{
        consts,
        igi::{history, motion, probe, probe_light, recall, remember},
        types,
    },
};

/// Virtual lights that a probe looks at, at most.
const PROBE_LIGHTS: u32 = 256;
/// Bytes of a position.
const POSITION: u64 = 12;

/// What the last frame left, and what this one found out about it.
#[derive(Clone, Copy, Debug)]
pub struct Past {
    /// `types::HistoryFrame`, one.
    pub frame: Buffer,
    /// Irradiance, W/m²; alpha: how many frames it counts, 0: none.
    pub irradiance: Image,
    /// Normal, and linear depth / far in alpha.
    pub guide: Image,
    /// Relative change of irradiance a frame, smoothed over time; alpha: how large it has been, without sign.
    pub trend: Image,
    /// `types::HistoryProbe`, row by row.
    pub probes: Buffer,
    /// Light at the probes by the last frame's paths in the last frame, W/m², alpha unused.
    pub lit: Buffer,
    /// The same in this frame.
    pub relit: Buffer,
}

/// Where the probes lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    pub columns: u32,
    pub rows: u32,
    /// Pixels from probe to probe.
    pub side: u32,
}

impl Grid {
    /// For an image of `extent` pixels; farther apart where gathering itself is sparse.
    pub fn new(extent: Extent, downsample: u32) -> Self {
        let side = if downsample > 1 { 16 } else { 8 };
        Self { columns: extent.width.div_ceil(side), rows: extent.height.div_ceil(side), side }
    }

    /// How many there are.
    pub fn count(&self) -> u32 {
        self.columns * self.rows
    }
}

/// Blends `fresh`, this frame's irradiance, with that of the `past` into `blended` (alpha: how many frames count), and keeps normals
/// and depths in `guide`, and how light changes in `trend`: the three images that the next frame's `past` holds. `motion`: world position in the last frame of what moved,
/// alpha 0 elsewhere.
pub fn blend(
    graph: &mut Graph,
    g: &GBuffer,
    (motion, fresh): (Image, Image),
    (past, grid): (&Past, Grid),
    [blended, guide, trend]: [Image; 3],
    settings: &Settings,
) {
    let args = history::Args {
        view: g.view,
        before: past.frame,
        normal: g.normal,
        depth: g.depth,
        motion,
        irradiance: fresh,
        old: past.irradiance,
        old_guide: past.guide,
        old_trend: past.trend,
        probes: past.probes,
        lit: past.lit,
        relit: past.relit,
        blended,
        guide,
        trend,
        push: history::Push {
            frame: graph.frame,
            columns: grid.columns,
            rows: grid.rows,
            side: grid.side,
            most: settings.history.max(1) as f32,
            lag: settings.history_lag,
            range: settings.history_range,
        },
    };
    let extent = graph.extent(blended);
    graph.compute(args, extent);
}

/// Halton numbers of a path.
pub(super) fn dimensions(settings: &Settings) -> usize {
    (consts::VPL_FIRST_NUMBERS + 2 * settings.bounces) as usize
}

/// Seed of the random choices of a frame; that of the run in frame 0.
fn seed_of(seed: u32, frame: u32) -> u32 {
    if frame == 0 {
        return seed;
    }
    // Never 0, which stands for no turn.
    ((halton::shift(seed ^ 0x9e37_79b9, frame) * f64::from(u32::MAX)) as u32).max(1)
}

impl Igi {
    /// The same with the random numbers of `frame`: each frame takes the next ones of the sequence, and a few are left
    /// out so that in the long run every path has numbers of all kinds: each lamp has the same few paths in every frame.
    pub(super) fn numbered(graph: &mut Graph, shared: &Shared, settings: &Settings, frame: u32) -> Shared {
        if frame == 0 {
            return *shared;
        }
        let seed = seed_of(shared.seed, frame);
        let settings_block = graph.uniform(&types::IgiSettings { seed, ..shared.block });
        let first = frame.wrapping_mul(halton::step(settings.paths() * settings.candidates, dimensions(settings)));
        Shared { settings: settings_block, seed, first, ..*shared }
    }

    /// The mean of `fresh`, this frame's irradiance, and what is left of the frames before. `candidates` is what the paths left, `vpls`
    /// what was drawn from it; `shared` has the numbers of frame 0.
    pub(super) fn accumulate(
        &self,
        graph: &mut Graph,
        handles: &Handles,
        (g, view): (&GBuffer, &View),
        shared: &Shared,
        (candidates, vpls, fresh): (Vpls, Vpls, Image),
        settings: &Settings,
    ) -> Image {
        let extent = graph.extent(fresh);
        let frame = graph.frame;
        let grid = Grid::new(extent, settings.downsample);
        let motion = motion_of(graph, handles, g, view);
        let (frame_before, frame_next) =
            graph.history_buffer("igi.history.frame", size_of::<types::HistoryFrame>() as u64);
        let this = types::HistoryFrame { view: view.uniform(), next: frame.wrapping_add(1) };
        let this = graph.buffer_from("igi.history.this", &[this]);
        graph.copy_buffer(this, frame_next);

        let paths = settings.paths() * settings.candidates;
        let (total, count) = (candidates.count, vpls.count);
        let kept_bytes = u64::from(count) * size_of::<types::HistoryVpl>() as u64;
        let (kept_before, kept_next) = graph.history_buffer("igi.history.vpls", kept_bytes);
        let args = remember::Args {
            candidates: candidates.buffer,
            vpls: vpls.buffer,
            kept: kept_next,
            push: remember::Push { count, paths, total },
        };
        graph.compute(args, count);

        let probe_bytes = u64::from(grid.count()) * size_of::<types::HistoryProbe>() as u64;
        let light_bytes = 16 * u64::from(grid.count());
        let (probes_before, probes_next) = graph.history_buffer("igi.history.probes", probe_bytes);
        let (lit_before, lit_next) = graph.history_buffer("igi.history.lit", light_bytes);
        let Grid { columns, rows, side } = grid;
        let seed = seed_of(shared.seed, frame);
        let args = probe::Args {
            view: g.view,
            normal: g.normal,
            depth: g.depth,
            probes: probes_next,
            push: probe::Push { columns, rows, side, seed },
        };
        graph.compute(args, grid.count());
        self.light_probes(graph, (probes_next, lit_next, grid), vpls, (shared, seed), settings);

        let relit = graph.buffer("igi.history.relit", light_bytes);
        if let Some(last) = frame.checked_sub(1) {
            let then = Self::numbered(graph, shared, settings, last);
            let again = self.shoot(graph, handles, &then, settings);
            let recalled = Vpls {
                buffer: graph.buffer("igi.history.recalled", u64::from(count) * size_of::<types::Vpl>() as u64),
                count,
                tree: None,
            };
            let args = recall::Args {
                candidates: again.buffer,
                kept: kept_before,
                vpls: recalled.buffer,
                push: recall::Push { count, total },
            };
            graph.compute(args, count);
            self.light_probes(graph, (probes_before, relit, grid), recalled, (shared, then.seed), settings);
        } else {
            graph.fill(relit, 0);
        }

        let (old, blended) = graph.history("igi.history.irradiance", Format::RGBA32F, extent);
        let (old_guide, guide) = graph.history("igi.history.guide", Format::RGBA32F, extent);
        let (old_trend, trend) = graph.history("igi.history.trend", Format::RGBA32F, extent);
        let past = Past {
            frame: frame_before,
            irradiance: old.nearest(),
            guide: old_guide.nearest(),
            trend: old_trend.nearest(),
            probes: probes_before,
            lit: lit_before,
            relit,
        };
        blend(graph, g, (motion, fresh), (&past, grid), [blended, guide, trend], settings);
        blended
    }

    /// Sums the light of some of the virtual lights at the probes, from zero.
    fn light_probes(
        &self,
        graph: &mut Graph,
        (probes, lit, grid): (Buffer, Buffer, Grid),
        vpls: Vpls,
        (shared, seed): (&Shared, u32),
        settings: &Settings,
    ) {
        graph.fill(lit, 0);
        let stride = vpls.count.div_ceil(PROBE_LIGHTS).max(1);
        let rays = &shared.hidden_by;
        for (first, count) in self.batches(Extent::new(grid.count(), 1), vpls.count.div_ceil(stride)) {
            let args = crate::rays::traced!(
                probe_light::Args {
                    probes,
                    vpls: vpls.buffer,
                    lit,
                    push: probe_light::Push {
                        probe_count: grid.count(),
                        first,
                        count,
                        stride,
                        total: vpls.count,
                        least: shared.least,
                        seed,
                    },
                    spec: probe_light::Spec { imperfect: settings.imperfect.into() },
                },
                *rays
            );
            graph.compute(args, grid.count()).rays(super::rays(Extent::new(grid.count(), 1), count));
        }
    }
}

/// World positions that the visible surfaces had in the last frame, alpha 1, where they moved; alpha 0 elsewhere. Keeps instances and
/// deformed vertices for the next frame.
pub fn motion_of(graph: &mut Graph, handles: &Handles, g: &GBuffer, view: &View) -> Image {
    let extent = graph.extent(g.depth);
    let motion = graph.image("igi.motion", Format::RGBA32F, extent);
    let (before_instances, next) = graph.history_buffer("igi.history.instances", handles.instances.bytes());
    graph.copy_buffer(handles.instances, next);
    // Copies of deformed primitives stand behind all others in the streams.
    let deformed = handles.moment.instances.iter().filter(|i| i.deformed).map(|i| i.first_vertex).min();
    let before_positions = match deformed {
        Some(first) => {
            let written = handles.positions.range(u64::from(first) * POSITION..handles.positions.bytes());
            let (before, next) = graph.history_buffer("igi.history.positions", written.bytes());
            graph.copy_buffer(written, next);
            before
        }
        // Never read.
        None => handles.positions,
    };
    let frustum = Frustum::new(view);
    let batches = Batches::new(&handles.moment, Some(&frustum), view.position);
    let visible = batches.visible_buffer(graph, "igi.visible");
    let calls: Vec<_> = batches.list.iter().flat_map(|batch| batch.calls.iter().copied()).collect();
    let args = motion::Args {
        view: g.view,
        instances: handles.instances,
        visible,
        positions: handles.positions,
        before_instances,
        before_positions,
        depth: g.depth,
        push: motion::Push { first_deformed: deformed.unwrap_or(u32::MAX) },
    };
    let targets = Targets::new().color(motion, Load::Clear([0.0; 4]));
    graph.raster(targets, Raster::new(), args, Draw::indexed(handles.indices, calls));
    motion
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_seeds_of_their_own_and_the_first_has_that_of_the_run() {
        for seed in [0, 1, 77] {
            assert_eq!(seed_of(seed, 0), seed);
            let mut all: Vec<u32> = (1..1000).map(|frame| seed_of(seed, frame)).collect();
            assert!(all.iter().all(|&s| s != 0));
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), 999);
        }
    }

    #[test]
    fn probes_cover_the_picture() {
        let grid = Grid::new(Extent::new(50, 33), 1);
        assert_eq!((grid.columns, grid.rows, grid.side, grid.count()), (7, 5, 8, 35));
        assert_eq!(Grid::new(Extent::new(50, 33), 4), Grid { columns: 4, rows: 3, side: 16 });
    }
}
