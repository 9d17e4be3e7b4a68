//! The history: indirect light averaged over time. The light paths of each frame have other random numbers. The irradiance of a
//! surface is averaged over the frames in which the surface is visible.
//!
//! Three measures prevent ghosting and flicker:
//! - Each pixel looks up the position of its surface in the last frame, from that frame's camera and the surface's own motion (nodes,
//!   skins, morph targets). It reuses irradiance only from surfaces in the same plane with a similar normal (reprojection, Nehab et
//!   al. 2007).
//! - The light paths of the last frame are shot again in this frame's scene, and their light is gathered again at one pixel of each
//!   square of pixels (a probe). The random numbers are the same, so a difference is a change of the light and not noise (Schied,
//!   Peters and Dachsbacher 2018). The larger the change, the fewer frames count, so that the average lags by at most about
//!   [`Settings::history_lag`]. Change that continues over some frames is smoothed, and the average is extrapolated by it.
//! - In a resting scene the average goes over [`Settings::history`] frames. All frames together have as many virtual lights as one
//!   frame with `history` times the paths, evenly distributed for each lamp and each path.
//!
//! The host keeps no data: [`Graph::history`] passes data from frame to frame through the runner. `graph.frame` must grow by one from
//! frame to frame. If a number is skipped, or the history is forgotten, the next frame has no past.

use super::{Igi, Settings, Shared, Vpls, halton};
use crate::{
    graph::{Buffer, Extent, Format, Graph, Image},
    passes::{gbuffer::GBuffer, motion},
    resident::Handles,
    scene::View,
    shaders::{
        consts,
        igi::{history, probe, probe_light, recall, remember},
        types,
    },
};

/// Maximum of virtual lights whose light is gathered at a probe.
const PROBE_LIGHTS: u32 = 256;

/// The data of the last frame, and the light of its paths in this frame.
#[derive(Clone, Copy, Debug)]
pub struct Past {
    /// One `types::HistoryFrame`.
    pub frame: Buffer,
    /// Average irradiance, W/m²; alpha: number of averaged frames, 0 for none.
    pub irradiance: Image,
    /// Unit normal; alpha: linear depth / far.
    pub guide: Image,
    /// Relative change of the irradiance per frame, smoothed over time; alpha: its smoothed magnitude.
    pub trend: Image,
    /// `types::HistoryProbe` values, row by row.
    pub probes: Buffer,
    /// Irradiance at the probes from the last frame's paths in the last frame, W/m²; alpha is unused.
    pub lit: Buffer,
    /// Irradiance at the probes from the last frame's paths, shot again in this frame, W/m²; alpha is unused.
    pub relit: Buffer,
}

/// The grid of the probes: one probe in each square of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    pub columns: u32,
    pub rows: u32,
    /// Side of a square, pixels.
    pub side: u32,
}

impl Grid {
    /// The grid for an image of `extent` pixels. With `downsample` the squares are larger, because gathering costs less as well.
    pub fn new(extent: Extent, downsample: u32) -> Self {
        let side = if downsample > 1 { 16 } else { 8 };
        Self { columns: extent.width.div_ceil(side), rows: extent.height.div_ceil(side), side }
    }

    /// Number of probes.
    pub fn count(&self) -> u32 {
        self.columns * self.rows
    }
}

/// Blends `fresh`, this frame's irradiance, with the average irradiance of `past`. Writes the three images that are part of the next
/// frame's past: `blended` (irradiance; alpha: number of averaged frames), `guide` (normals and depths) and `trend` (change of the
/// light). `motion`: world position in the last frame of surfaces that moved, alpha 1; alpha 0 elsewhere.
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

/// Number of Halton dimensions of a path.
pub(super) fn dimensions(settings: &Settings) -> usize {
    (consts::VPL_FIRST_NUMBERS + 2 * settings.bounces) as usize
}

/// Seed of the random numbers of a frame. Frame 0 has the seed of the run.
fn seed_of(seed: u32, frame: u32) -> u32 {
    if frame == 0 {
        return seed;
    }
    // Not 0, because seed 0 means no rotation.
    ((halton::shift(seed ^ 0x9e37_79b9, frame) * f64::from(u32::MAX)) as u32).max(1)
}

impl Igi {
    /// `shared` with the random numbers of `frame`. Each frame uses the next points of the Halton sequence. Some points are skipped
    /// between frames ([`halton::step`]). A lamp has the same few paths in every frame; skipping gives these paths points from the
    /// whole sequence.
    pub(super) fn numbered(graph: &mut Graph, shared: &Shared, settings: &Settings, frame: u32) -> Shared {
        if frame == 0 {
            return *shared;
        }
        let seed = seed_of(shared.seed, frame);
        let settings_block = graph.uniform(&types::IgiSettings { seed, ..shared.block });
        let first = frame.wrapping_mul(halton::step(settings.paths() * settings.candidates, dimensions(settings)));
        Shared { settings: settings_block, seed, first, ..*shared }
    }

    /// Blends `fresh`, this frame's irradiance, with the history. `candidates`: the virtual lights that the paths left; `vpls`: the virtual
    /// lights drawn among them. `shared` must have the random numbers of frame 0.
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
        let motion = motion::draw(graph, handles, g, view, "igi");
        let (frame_before, frame_next) =
            graph.history_buffer("igi.history.frame", size_of::<types::HistoryFrame>() as u64);
        let this =
            types::HistoryFrame { view: view.uniform(), next: frame.wrapping_add(1), shift: view.shift().to_array() };
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

    /// Computes the irradiance at the probes from at most [`PROBE_LIGHTS`] of the virtual lights.
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
        let args = crate::rays::traced!(
            probe_light::Args {
                probes,
                vpls: vpls.buffer,
                lit,
                push: probe_light::Push {
                    probe_count: grid.count(),
                    stride,
                    total: vpls.count,
                    least: shared.least,
                    seed,
                    ..Default::default()
                },
                spec: probe_light::Spec { imperfect: settings.imperfect.into() },
            },
            *rays
        );
        let lights = self.items(vpls.count.div_ceil(stride), grid.count().into());
        graph.compute_over(args, grid.count(), lights);
    }
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
