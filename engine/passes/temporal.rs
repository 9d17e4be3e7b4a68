//! Temporal anti-aliasing: the average of a sequence over time, with smooth edges at the cost of one picture a frame.
//!
//! Each frame looks at another place of each pixel ([`place`], by [`View::shifted`]). [`accumulate`] finds each pixel's surface in the last
//! frame, from that frame's camera and the surface's own motion (reprojection, Nehab et al. 2007), and blends the frame with the average
//! from there. L. Yang, S. Liu and M. Salvi (2020) survey the method. Four measures keep the past out of the picture:
//! - What another surface hid in the last frame has no past. Pixels beside an edge count as visible, so that edges keep their average.
//! - The past is limited to the range of colours around the pixel (variance clipping in YCoCg, Salvi 2016), so that shadows and
//!   highlights do not leave traces. The range is also as wide as the pixel swings between surfaces from frame to frame,
//!   because a thin wire is missing in most frames. Where something moves, it is not.
//! - What had to be limited counts as fewer frames.
//! - A bright sample that is alone in place and time at most doubles the light. All else is averaged as linear radiance, so the mean
//!   light stays the same.
//!
//! The host keeps no data: [`Graph::history`] passes data from frame to frame through the runner. `graph.frame` must grow by one from
//! frame to frame. If a number is skipped, or the history is forgotten, the next frame has no past.

use super::{gbuffer::GBuffer, motion};
use crate::{
    Error, Result,
    graph::{Buffer, Format, Graph, Image},
    resident::Handles,
    scene::View,
    shaders::{passes::temporal as shader, types},
};
use glam::{DVec2, Vec2};

/// Frames of the average, if nothing else is asked for.
pub const FRAMES: u32 = 8;
/// Frames of an average at most.
pub const MOST: u32 = 256;

/// Settings of the average.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Maximum of frames that the average holds, 1 to [`MOST`]. Later frames have this share.
    pub frames: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { frames: FRAMES }
    }
}

impl Settings {
    /// Checks that all values are in their ranges.
    ///
    /// # Errors
    /// `Usage`, naming the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        if (1..=MOST).contains(&self.frames) {
            return Ok(());
        }
        let what = format!("the average of {} frames is not allowed; allowed: 1 to {MOST}", self.frames);
        Err(Error::usage(what).at("temporal.frames"))
    }
}

/// Where the pixels of a frame look: shares of a pixel, x to the right and y down, in [0, 1). The middle in frame 0. Any successive frames
/// are evenly distributed (the R2 sequence, Roberts 2018, which has no period).
pub fn place(frame: u32) -> DVec2 {
    // Powers of the inverse of the real root of x³ = x + 1.
    let step = DVec2::new(0.754_877_666_246_692_8, 0.569_840_290_998_053_3);
    (DVec2::splat(0.5) + f64::from(frame) * step).fract()
}

/// The data of the last frame. All images have the extent of the picture.
#[derive(Clone, Copy, Debug)]
pub struct Past {
    /// One `types::HistoryFrame`.
    pub frame: Buffer,
    /// Average radiance, W/(sr·m²); alpha: number of averaged frames.
    pub average: Image,
    /// Unit normal; alpha: linear depth / far.
    pub guide: Image,
    /// Radiance of the frame alone, YCoCg; alpha: its luma less that of the frame before.
    pub fresh: Image,
    /// How far the radiance swings from frame to frame (root mean square), YCoCg.
    pub swing: Image,
}

/// Blends `fresh`, the radiance of this frame, with the average of `past`. Writes the four images of the next frame's past, in the order of
/// [`Past`]: average, guide (RGBA32F), fresh, swing (RGBA16F). `motion`: of [`motion::draw`]. `shift`: where the pixels of this frame look,
/// from their middles to the right and down, pixels.
pub fn blend(
    graph: &mut Graph,
    g: &GBuffer,
    (motion, fresh): (Image, Image),
    past: &Past,
    [blended, guide, kept, swings]: [Image; 4],
    shift: Vec2,
    settings: Settings,
) {
    let args = shader::Args {
        view: g.view,
        before: past.frame,
        normal: g.normal,
        depth: g.depth,
        motion,
        fresh,
        old: past.average,
        old_guide: past.guide,
        old_fresh: past.fresh,
        old_swing: past.swing,
        blended,
        guide,
        kept,
        swings,
        push: shader::Push { frame: graph.frame, most: settings.frames as f32, shift: shift.to_array() },
    };
    let extent = graph.extent(blended);
    graph.compute(args, extent);
}

/// Averages `fresh`, linear radiance as `view` sees it, over the frames. Returns the average, RGBA32F; alpha: number of averaged frames.
/// `g`: the G-buffer of `view`, of the same extent.
///
/// # Errors
/// `Usage` if a setting is out of its range, or if the radiance does not have the extent of the G-buffer.
pub fn accumulate(
    graph: &mut Graph,
    handles: &Handles,
    (g, view): (&GBuffer, &View),
    fresh: Image,
    settings: Settings,
) -> Result<Image> {
    settings.validate()?;
    let extent = graph.extent(g.depth);
    let given = graph.extent(fresh);
    if given != extent {
        return Err(Error::usage(format!("the picture has {given:?}, but its G-buffer has {extent:?}")).at("temporal"));
    }
    Ok(graph.scope("temporal", |graph| {
        let motion = motion::draw(graph, handles, g, view, "temporal");
        let (frame, frame_next) =
            graph.history_buffer("temporal.history.frame", size_of::<types::HistoryFrame>() as u64);
        let next = graph.frame.wrapping_add(1);
        let this = types::HistoryFrame { view: view.uniform(), next, shift: view.shift().to_array() };
        let this = graph.buffer_from("temporal.history.this", &[this]);
        graph.copy_buffer(this, frame_next);
        let [average, guide, kept, swing] = [
            ("temporal.history.average", Format::RGBA32F),
            ("temporal.history.guide", Format::RGBA32F),
            ("temporal.history.fresh", Format::RGBA16F),
            ("temporal.history.swing", Format::RGBA16F),
        ]
        .map(|(name, format)| graph.history(name, format, extent));
        let past = Past {
            frame,
            average: average.0.nearest(),
            guide: guide.0.nearest(),
            fresh: kept.0.nearest(),
            swing: swing.0.nearest(),
        };
        let next = [average.1, guide.1, kept.1, swing.1];
        blend(graph, g, (motion, fresh), &past, next, view.shift(), settings);
        average.1
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_begin_in_the_middle_and_are_even_in_all_windows() {
        assert_eq!(place(0), DVec2::splat(0.5));
        for first in [0, 5, 1000, u32::MAX - 64] {
            for count in [4u32, 8, 16, 64] {
                let places: Vec<DVec2> = (first..first + count).map(place).collect();
                assert!(places.iter().all(|at| at.min_element() >= 0.0 && at.max_element() < 1.0));
                let mean = places.iter().sum::<DVec2>() / f64::from(count);
                assert!((mean - 0.5).abs().max_element() < 2.0 / f64::from(count), "{first} {count} {mean}");
            }
        }
    }

    #[test]
    fn numbers_of_frames_out_of_range_are_named() {
        for frames in [0, MOST + 1] {
            let text = Settings { frames }.validate().unwrap_err().to_string();
            assert!(text.contains(&frames.to_string()) && text.contains("1 to 256"), "{text}");
        }
        assert!(Settings { frames: MOST }.validate().is_ok());
    }
}
