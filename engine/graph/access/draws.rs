//! What a raster pass draws onto, and the buffers that its draws fetch from.

use super::Collector;
use crate::graph::{
    format::{Class, Extent, Format},
    handles::Buffer,
    pass::Bound,
    raster::{Blend, Depth, Draw, DrawKind, Load, Raster, StencilLoad, Targets},
    vocab::{Access, Layout, MistakeKind, Scope, Stages, Usage},
};

/// Views of one pass that each device with multiview can draw.
const MOST_VIEWS: u32 = 6;

impl Collector<'_> {
    pub(super) fn targets(&mut self, bound: &Bound, targets: &Targets, state: &Raster) {
        let mut first: Option<(String, Extent, u32)> = None;
        let all = targets.colors.iter().map(|(i, _)| *i).chain(targets.depth.map(|(i, _)| i));
        for image in all {
            let Some(desc) = self.desc(image) else { continue };
            self.one_level(image, "can be drawn to");
            let (name, extent) = (self.image_name(image), desc.extent.mip(image.mip));
            match &first {
                None => first = Some((name, extent, image.layers)),
                Some((other, e, l)) if *e != extent || *l != image.layers => {
                    let what =
                        format!("targets differ: {extent} and {} layers here, {e} and {l} of `{other}`", image.layers);
                    self.mistake(MistakeKind::Shape, name, what);
                }
                Some(_) => {}
            }
        }
        if let (Some([x, y, w, h]), Some((name, e, _))) = (targets.area, &first)
            && (x.saturating_add(w) > e.width || y.saturating_add(h) > e.height || w == 0 || h == 0)
        {
            let what = format!("the area {w}×{h} at ({x}, {y}) does not fit into {e}");
            self.mistake(MistakeKind::Shape, name.clone(), what);
        }
        match &first {
            None => self.mistake(MistakeKind::Shape, "-", "nothing to draw onto"),
            Some((name, _, layers)) if targets.views && !(2..=MOST_VIEWS).contains(layers) => {
                let what = format!("{layers} layers cannot be views, 2 to {MOST_VIEWS} can");
                self.mistake(MistakeKind::Shape, name.clone(), what);
            }
            Some(_) => {}
        }
        let outputs = bound.shader.color_outputs as usize;
        if outputs != targets.colors.len() || outputs > 8 {
            let what = format!("the shader writes {outputs} colours, the pass has {} targets", targets.colors.len());
            self.mistake(MistakeKind::Shape, "-", what);
        }
        for (i, (image, load)) in targets.colors.iter().enumerate() {
            let format = self.desc(*image).map_or(Format::RGBA8, |d| d.format);
            if format.is_depth() || matches!(format, Format::Raw(_)) {
                let what = format!("{format:?} cannot be a colour target");
                self.mistake(MistakeKind::Format, self.image_name(*image), what);
            }
            if matches!(load, Load::ClearUint(_)) != (format.class() == Class::Uint)
                && !matches!(load, Load::Keep | Load::Discard)
            {
                let what =
                    format!("a {format:?} target is cleared by {load:?}; use ClearUint for unsigned integers only");
                self.mistake(MistakeKind::Format, self.image_name(*image), what);
            }
            let keeps = *load == Load::Keep || state.blend != Blend::Replace;
            let mut access = Access::COLOR_WRITE;
            if *load == Load::Keep {
                access |= Access::COLOR_READ;
            }
            self.image(
                *image,
                Scope { stages: Stages::COLOR, access },
                Layout::Color,
                Usage::COLOR,
                &format!("colour {i}"),
            );
            if keeps && *load == Load::Discard {
                let what = "blending reads the target, but its contents are discarded";
                self.mistake(MistakeKind::ReadBeforeWrite, self.image_name(*image), what);
            }
        }
        if let Some((image, load)) = targets.depth {
            let format = self.desc(image).map_or(Format::D32F, |d| d.format);
            if !format.is_depth() {
                self.mistake(
                    MistakeKind::Format,
                    self.image_name(image),
                    format!("{format:?} cannot be a depth target"),
                );
            }
            if state.stencil.is_some() && format.class() != Class::DepthStencil {
                self.mistake(MistakeKind::Format, self.image_name(image), format!("{format:?} has no stencil"));
            }
            let keep = Scope { stages: Stages::DEPTH, access: Access::DEPTH_READ | Access::DEPTH_WRITE };
            let (scope, layout) = match load {
                Depth::ReadOnly => (Scope { access: Access::DEPTH_READ, ..keep }, Layout::DepthRead),
                Depth::Keep => (keep, Layout::Depth),
                Depth::Clear(_) if targets.stencil == Some(StencilLoad::Keep) => (keep, Layout::Depth),
                Depth::Clear(_) => (Scope { access: Access::DEPTH_WRITE, ..keep }, Layout::Depth),
            };
            self.image(image, scope, layout, Usage::DEPTH, "depth");
        } else if state.stencil.is_some() || targets.stencil.is_some() {
            self.mistake(MistakeKind::Shape, "-", "stencil without a depth target");
        }
    }

    pub(super) fn commands(&mut self, buffer: Buffer, offset: u64, bytes: u64) {
        if !offset.is_multiple_of(4) || !buffer.offset.is_multiple_of(4) || offset.saturating_add(bytes) > buffer.size {
            let what = format!("{bytes} bytes of commands at {offset} do not fit into {}", buffer.size);
            self.mistake(MistakeKind::Range, self.buffer_name(buffer), what);
        }
        self.buffer(buffer, Stages::INDIRECT, Access::INDIRECT_READ, Usage::INDIRECT, "commands");
    }

    pub(super) fn draw(&mut self, draw: &Draw) {
        if draw.depth.is_some_and(|d| !(0.0..=1.0).contains(&d)) {
            self.mistake(MistakeKind::Shape, "-", "the depth of the draw is outside of [0, 1]");
        }
        match &draw.kind {
            DrawKind::Calls(_) => {}
            DrawKind::Indexed { indices, calls } => {
                self.buffer(*indices, Stages::INDEX, Access::INDEX_READ, Usage::INDEX, "indices");
                let end =
                    calls.iter().map(|c| (u64::from(c.first_index) + u64::from(c.indices)) * 4).max().unwrap_or(0);
                if end > indices.size || !indices.offset.is_multiple_of(4) {
                    let what = format!("draws reach byte {end} of the indices, which have {}", indices.size);
                    self.mistake(MistakeKind::Range, self.buffer_name(*indices), what);
                }
            }
            DrawKind::Indirect { commands, count } => self.commands(*commands, 0, u64::from(*count) * 16),
            DrawKind::IndexedIndirect { indices, commands, count } => {
                self.buffer(*indices, Stages::INDEX, Access::INDEX_READ, Usage::INDEX, "indices");
                self.commands(*commands, 0, u64::from(*count) * 20);
            }
        }
    }
}
