//! Local adaptation that goes on from frame to frame ([`Settings::adapt_local`]).

use super::{Mode, Settings};
use crate::{
    Result,
    gpu::{Gpu, OwnedBuffer},
    graph::{Buffer, Extent, Format, Graph, Image},
    shaders::tonemap::settle,
};

/// The local adaptation of the last frame.
#[derive(Debug, Default)]
pub struct Last(Option<(OwnedBuffer, Extent)>);

/// The last frame in a graph, and the share of the way that adaptation goes from it.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    last: Buffer,
    share: f32,
}

/// Whether local adaptation goes on from frame to frame. `dt`: seconds since the last frame; `None`: the picture stands for itself.
pub fn goes_on(settings: &Settings, dt: Option<f32>) -> bool {
    settings.adapt_local > 0.0 && settings.mode() != Mode::Global && !settings.operator.solves() && dt.is_some()
}

impl Last {
    /// `None` if local adaptation follows each frame at once. A frame of another extent starts anew.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub fn known(
        &mut self,
        gpu: &Gpu,
        graph: &mut Graph,
        extent: Extent,
        dt: Option<f32>,
        settings: &Settings,
    ) -> Result<Option<Known>> {
        // As for the statistics, a frame without a known time starts anew.
        let Some(dt) = dt.filter(|dt| dt.is_finite() && goes_on(settings, Some(*dt))) else {
            self.0 = None;
            return Ok(None);
        };
        let share = -(-dt.max(0.0) / settings.adapt_local).exp_m1();
        if let Some((buffer, _)) = self.0.as_ref().filter(|(_, of)| *of == extent) {
            return Ok(Some(Known { last: graph.import_buffer(buffer), share }));
        }
        // Below zero: no adaptation yet, also if this graph never runs.
        let none = vec![-1.0f32; extent.pixels() as usize];
        let buffer = OwnedBuffer::with_contents(gpu, "tonemap.last", bytemuck::cast_slice(&none))?;
        let known = Known { last: graph.import_buffer(&buffer), share };
        self.0 = Some((buffer, extent));
        Ok(Some(known))
    }
}

/// The local adaptation of this frame between that of the last one and `adaptation`.
pub fn settle(graph: &mut Graph, adaptation: Image, known: Known) -> Image {
    let settled = graph.image("tonemap.settled", Format::R32F, graph.extent(adaptation));
    let push = settle::Push { share: known.share };
    graph.compute(settle::Args { adaptation, last: known.last, settled, push }, graph.extent(adaptation));
    settled
}
