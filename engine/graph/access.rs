//! What each pass does to which part of which resource, in one table, and the mistakes that show in a pass by itself.

use super::{
    Graph,
    format::{Class, Extent, Format, ImageDesc},
    handles::{Buffer, GraphId, Image, Sampler},
    pass::{Bound, Groups, Imported, Origin, Pass, Work},
    raster::{Depth, Draw, DrawKind, Load, Raster, Targets},
    vocab::{Access, Layout, Mistake, MistakeKind, Region, Resource, Scope, Stages, Usage, Use},
};
use crate::shader::{self, Binding, BindingKind, Dim, Stage, Texel};

/// Storage and uniform bindings start at multiples of this: the largest alignment that a device may ask for.
const BINDING_ALIGNMENT: u64 = 256;

/// Collects the uses of one pass.
pub(super) struct Collector<'a> {
    graph: &'a Graph,
    pass: &'a Pass,
    pub uses: Vec<Use>,
    pub mistakes: Vec<Mistake>,
}

impl<'a> Collector<'a> {
    /// The uses of `pass`.
    pub fn collect(graph: &'a Graph, pass: &'a Pass) -> Self {
        let mut c = Self { graph, pass, uses: Vec::new(), mistakes: Vec::new() };
        match &pass.work {
            Work::Upload { buffers } => {
                for b in buffers {
                    c.buffer(*b, Stages::TRANSFER, Access::TRANSFER_WRITE, Usage::COPY_TO, "upload");
                }
            }
            Work::Compute { bound, groups } => {
                c.bound(bound);
                if let Groups::Indirect { buffer, offset } = groups {
                    c.commands(*buffer, *offset, 12);
                }
            }
            Work::Raster { bound, targets, state, draw } => {
                c.bound(bound);
                c.targets(bound, targets, state);
                c.draw(draw);
            }
            Work::Clear { image, .. } => c.transfer(*image, true, "clear"),
            Work::Fill { buffer, .. } => {
                c.buffer(*buffer, Stages::TRANSFER, Access::TRANSFER_WRITE, Usage::COPY_TO, "fill");
                if !buffer.offset.is_multiple_of(4) || !buffer.size.is_multiple_of(4) {
                    let what =
                        format!("bytes {}..{} are not multiples of 4", buffer.offset, buffer.offset + buffer.size);
                    c.mistake(MistakeKind::Range, c.buffer_name(*buffer), what);
                }
            }
            Work::CopyImage { from, to } => c.copy_image(*from, *to),
            Work::Blit { from, to } => c.blit(*from, *to),
            Work::CopyBuffer { from, to } | Work::ReadBuffer { from, to } => {
                c.buffer(*from, Stages::TRANSFER, Access::TRANSFER_READ, Usage::COPY_FROM, "from");
                c.buffer(*to, Stages::TRANSFER, Access::TRANSFER_WRITE, Usage::COPY_TO, "to");
                if from.size != to.size {
                    let what = format!("{} bytes are copied into {}; sizes must be equal", from.size, to.size);
                    c.mistake(MistakeKind::Shape, c.buffer_name(*from), what);
                }
            }
            Work::ReadImage { from, to } => {
                c.transfer(*from, false, "from");
                c.one_level(*from, "can be read back");
                c.buffer(*to, Stages::TRANSFER, Access::TRANSFER_WRITE, Usage::COPY_TO, "to");
            }
        }
        c.resolve();
        c
    }

    fn mistake(&mut self, kind: MistakeKind, resource: impl Into<String>, what: impl Into<String>) {
        self.mistakes.push(Mistake {
            kind,
            graph: self.graph.name().to_owned(),
            pass: self.pass.name.clone(),
            resource: resource.into(),
            what: what.into(),
        });
    }

    fn own(&mut self, graph: GraphId, kind: &str) -> bool {
        if graph != self.graph.id {
            let what = format!("this {kind} belongs to graph `{}`; handles are valid for one graph", graph.name);
            self.mistake(MistakeKind::Foreign, format!("{kind} of {}", graph.name), what);
        }
        graph == self.graph.id
    }

    fn image_name(&self, image: Image) -> String {
        self.graph.short_name(image).to_owned()
    }

    fn buffer_name(&self, buffer: Buffer) -> String {
        self.graph.short_buffer_name(buffer).to_owned()
    }

    /// Description of an image of this graph.
    fn desc(&self, image: Image) -> Option<ImageDesc> {
        (image.graph == self.graph.id).then(|| self.graph.images[image.index as usize].desc)
    }

    /// Someone else's resource must have been made for this use.
    fn made_for(&mut self, origin: &Origin, usage: Usage, name: &str, role: &str) {
        if let Origin::Imported(Imported { usage: Some(made), .. }) = origin
            && !made.contains(usage)
        {
            let what = format!("`{role}` needs usage {usage:?}, but it was made for {made:?}");
            self.mistake(MistakeKind::ReadOnly, name, what);
        }
    }

    fn image(&mut self, image: Image, scope: Scope, layout: Layout, usage: Usage, role: &str) {
        if !self.own(image.graph, "image") {
            return;
        }
        let graph = self.graph;
        let entry = &graph.images[image.index as usize];
        let (name, desc) = (entry.name.clone(), entry.desc);
        self.made_for(&entry.origin, usage, &name, role);
        let Image { mip, mips, layer, layers, .. } = image;
        let ends = (mip.checked_add(mips), layer.checked_add(layers));
        let (Some(mip_end), Some(layer_end)) = ends else {
            return self.mistake(MistakeKind::Range, name, "levels or layers out of range");
        };
        if mips == 0 || layers == 0 || mip_end > desc.mips || layer_end > desc.layers {
            let what = format!(
                "`{role}` covers levels {mip}..{mip_end} and layers {layer}..{layer_end}, but it has {} and {}",
                desc.mips, desc.layers
            );
            return self.mistake(MistakeKind::Range, name, what);
        }
        if !scope.access.writes().is_empty() && matches!(entry.origin, Origin::History { next: false, .. }) {
            let what = format!("`{role}` writes last frame's image; write the other one that `history` returned");
            self.mistake(MistakeKind::ReadOnly, name, what);
        }
        self.uses.push(Use {
            resource: Resource::Image(image.index),
            region: Region::image(mip..mip_end, layer..layer_end),
            scope,
            layout,
            usage,
            role: role.to_owned(),
        });
    }

    fn buffer(&mut self, buffer: Buffer, stages: Stages, access: Access, usage: Usage, role: &str) {
        if !self.own(buffer.graph, "buffer") {
            return;
        }
        let graph = self.graph;
        let entry = &graph.buffers[buffer.index as usize];
        let (name, bytes) = (entry.name.clone(), entry.bytes);
        self.made_for(&entry.origin, usage, &name, role);
        let read_only = matches!(entry.origin, Origin::History { next: false, .. });
        let end = buffer.offset.saturating_add(buffer.size);
        if end > bytes {
            let what = format!("`{role}` covers bytes {}..{end}, but it has {bytes}", buffer.offset);
            return self.mistake(MistakeKind::Range, name, what);
        }
        if !access.writes().is_empty() && read_only {
            let what =
                format!("`{role}` writes last frame's buffer; write the other one that `history_buffer` returned");
            self.mistake(MistakeKind::ReadOnly, name, what);
        }
        // An empty buffer still is a resource that can be bound; it stands for one byte.
        let region = Region::buffer(buffer.offset..end.max(buffer.offset + 1));
        let resource = Resource::Buffer(buffer.index);
        let scope = Scope { stages, access };
        self.uses.push(Use { resource, region, scope, layout: Layout::Buffer, usage, role: role.to_owned() });
    }

    fn bound(&mut self, bound: &Bound) {
        let mut resources = bound.resources.iter();
        for binding in bound.shader.bindings {
            let mut stages = Stages::NONE;
            for stage in binding.stages {
                stages |= match stage {
                    Stage::Compute => Stages::COMPUTE,
                    Stage::Vertex => Stages::VERTEX,
                    Stage::Fragment => Stages::FRAGMENT,
                };
            }
            for element in 0..binding.count {
                let role = if binding.count > 1 { format!("{}[{element}]", binding.name) } else { binding.name.into() };
                let resource = resources.next();
                if let Some(shader::Resource::Image(image)) = resource {
                    self.texels(*image, binding, &role);
                }
                match (binding.kind, resource) {
                    (BindingKind::Sampled(dim), Some(shader::Resource::Image(image))) => {
                        self.sampled(*image, dim, stages, &role);
                    }
                    (BindingKind::Storage(dim), Some(shader::Resource::Image(image))) => {
                        self.storage(*image, dim, stages, binding.access, &role);
                    }
                    (BindingKind::Buffer, Some(shader::Resource::Buffer(buffer))) => {
                        self.buffer(*buffer, stages, storage_access(binding.access), Usage::STORAGE, &role);
                        if !buffer.offset.is_multiple_of(BINDING_ALIGNMENT) {
                            let what = format!(
                                "`{role}` starts at byte {}; a shader needs a multiple of {BINDING_ALIGNMENT}",
                                buffer.offset
                            );
                            self.mistake(MistakeKind::Range, self.buffer_name(*buffer), what);
                        }
                    }
                    (BindingKind::Uniform { size }, Some(shader::Resource::Uniform(slice))) => {
                        if self.own(slice.graph, "uniform block") && slice.size < size {
                            let what = format!("the shader reads {size} bytes, but it has {}", slice.size);
                            self.mistake(MistakeKind::Shape, role, what);
                        }
                    }
                    _ => self.mistake(MistakeKind::Shape, role, "this kind of resource cannot be bound"),
                }
            }
        }
    }

    /// Format and kind of numbers must be those that the shader names.
    fn texels(&mut self, image: Image, binding: &Binding, role: &str) {
        let Some(desc) = self.desc(image) else { return };
        let texel = match desc.format.class() {
            Class::Uint => Texel::Uint,
            Class::Sint => Texel::Sint,
            Class::Float | Class::Depth | Class::DepthStencil => Texel::Float,
        };
        let wanted = Format::from_spirv(binding.format);
        let wrong = match wanted {
            _ if texel != binding.texel => format!("{:?} values", binding.texel),
            Some(format) if format != desc.format => format!("{format:?}"),
            _ => return,
        };
        let what = format!("`{role}` is {wrong} in the shader, but the image is {:?}", desc.format);
        self.mistake(MistakeKind::Format, self.image_name(image), what);
    }

    fn view(&mut self, image: Image, dim: Dim, role: &str) {
        let Some(desc) = self.desc(image) else { return };
        let wrong = match dim {
            Dim::D1 => Some("one-dimensional images do not exist here".to_owned()),
            Dim::D2 if desc.depth > 1 => Some("a volume is bound to a 2D image".to_owned()),
            Dim::D2 if image.layers != 1 => Some(format!("{} layers; choose one with `.layer(i)`", image.layers)),
            Dim::D3 if desc.depth <= 1 => Some("a flat image is bound to a volume".to_owned()),
            Dim::Cube if !desc.cube || image.layers != 6 => Some("it is no cube of six layers".to_owned()),
            Dim::CubeArray if !desc.cube || !image.layers.is_multiple_of(6) => {
                Some("it is no array of cubes".to_owned())
            }
            _ => None,
        };
        if let Some(wrong) = wrong {
            self.mistake(MistakeKind::Shape, self.image_name(image), format!("`{role}`: {wrong}"));
        }
    }

    fn one_level(&mut self, image: Image, action: &str) {
        if image.mips != 1 {
            let what = format!("only one level {action}, this handle covers {}; choose one with `.mip(i)`", image.mips);
            self.mistake(MistakeKind::Shape, self.image_name(image), what);
        }
    }

    fn sampled(&mut self, image: Image, dim: Dim, stages: Stages, role: &str) {
        self.view(image, dim, role);
        if let Some(desc) = self.desc(image)
            && image.sampler == Sampler::Shadow
            && !desc.format.is_depth()
        {
            let what = format!("`{role}` compares depths, but the format is {:?}", desc.format);
            self.mistake(MistakeKind::Format, self.image_name(image), what);
        }
        let scope = Scope { stages, access: Access::SAMPLED };
        self.image(image, scope, Layout::ShaderRead, Usage::SAMPLED, role);
    }

    fn storage(&mut self, image: Image, dim: Dim, stages: Stages, access: shader::Access, role: &str) {
        self.view(image, dim, role);
        self.one_level(image, "can be bound as storage image");
        if let Some(desc) = self.desc(image)
            && (desc.format.is_depth() || matches!(desc.format, Format::RGBA8Srgb | Format::BGRA8Srgb | Format::Raw(_)))
        {
            let what = format!("`{role}` is a storage image, which {:?} cannot be", desc.format);
            self.mistake(MistakeKind::Format, self.image_name(image), what);
        }
        let scope = Scope { stages, access: storage_access(access) };
        self.image(image, scope, Layout::General, Usage::STORAGE, role);
    }

    fn targets(&mut self, bound: &Bound, targets: &Targets, state: &Raster) {
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
        if first.is_none() {
            self.mistake(MistakeKind::Shape, "-", "nothing to draw onto");
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
            let keeps = *load == Load::Keep || state.blend != super::raster::Blend::Replace;
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
                Depth::Clear(_) if targets.stencil == Some(super::raster::StencilLoad::Keep) => (keep, Layout::Depth),
                Depth::Clear(_) => (Scope { access: Access::DEPTH_WRITE, ..keep }, Layout::Depth),
            };
            self.image(image, scope, layout, Usage::DEPTH, "depth");
        } else if state.stencil.is_some() {
            self.mistake(MistakeKind::Shape, "-", "a stencil test without a depth target");
        }
    }

    fn commands(&mut self, buffer: Buffer, offset: u64, bytes: u64) {
        if !offset.is_multiple_of(4) || !buffer.offset.is_multiple_of(4) || offset.saturating_add(bytes) > buffer.size {
            let what = format!("{bytes} bytes of commands at {offset} do not fit into {}", buffer.size);
            self.mistake(MistakeKind::Range, self.buffer_name(buffer), what);
        }
        self.buffer(buffer, Stages::INDIRECT, Access::INDIRECT_READ, Usage::INDIRECT, "commands");
    }

    fn draw(&mut self, draw: &Draw) {
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

    fn transfer(&mut self, image: Image, write: bool, role: &str) {
        let (access, layout, usage) = if write {
            (Access::TRANSFER_WRITE, Layout::CopyTo, Usage::COPY_TO)
        } else {
            (Access::TRANSFER_READ, Layout::CopyFrom, Usage::COPY_FROM)
        };
        self.image(image, Scope { stages: Stages::TRANSFER, access }, layout, usage, role);
    }

    fn copy_image(&mut self, from: Image, to: Image) {
        self.transfer(from, false, "from");
        self.transfer(to, true, "to");
        let (Some(a), Some(b)) = (self.desc(from), self.desc(to)) else { return };
        if a.format != b.format {
            let what = format!("{:?} is copied to {:?}; formats must be equal, or use `blit`", a.format, b.format);
            self.mistake(MistakeKind::Format, self.image_name(to), what);
        }
        let shape = |d: ImageDesc, i: Image| (d.extent.mip(i.mip), d.depth >> i.mip.min(31), i.mips, i.layers);
        if shape(a, from) != shape(b, to) {
            let (x, y) = (a.extent.mip(from.mip), b.extent.mip(to.mip));
            let what = format!(
                "{x} with {} levels and {} layers is copied to {y} with {} and {}",
                from.mips, from.layers, to.mips, to.layers
            );
            self.mistake(MistakeKind::Shape, self.image_name(to), what);
        }
    }

    fn blit(&mut self, from: Image, to: Image) {
        self.transfer(from, false, "from");
        self.transfer(to, true, "to");
        self.one_level(from, "can be scaled");
        self.one_level(to, "can be scaled");
        let (Some(a), Some(b)) = (self.desc(from), self.desc(to)) else { return };
        let (x, y) = (a.format, b.format);
        let raw = matches!(x, Format::Raw(_)) || matches!(y, Format::Raw(_));
        if x.class() != y.class() || (x.is_depth() && x != y) || raw {
            self.mistake(MistakeKind::Format, self.image_name(to), format!("{x:?} cannot be scaled into {y:?}"));
        }
        if from.layers != to.layers {
            let what = format!("{} layers are scaled into {}", from.layers, to.layers);
            self.mistake(MistakeKind::Shape, self.image_name(to), what);
        }
    }

    /// One layout for parts that are used twice in the pass; two uses of which one writes are a mistake.
    fn resolve(&mut self) {
        let mut changed = true;
        while changed {
            changed = false;
            for i in 0..self.uses.len() {
                for j in 0..i {
                    let (a, b) = (&self.uses[i], &self.uses[j]);
                    if a.resource != b.resource || !a.region.overlaps(&b.region) || a.writes() || b.writes() {
                        continue;
                    }
                    let layout = match (a.layout, b.layout) {
                        (x, y) if x == y => x,
                        (Layout::ShaderRead, Layout::DepthRead) | (Layout::DepthRead, Layout::ShaderRead) => {
                            Layout::DepthRead
                        }
                        _ => Layout::General,
                    };
                    changed |= a.layout != layout || b.layout != layout;
                    self.uses[i].layout = layout;
                    self.uses[j].layout = layout;
                }
            }
        }
        let mut conflicts = Vec::new();
        for i in 0..self.uses.len() {
            for j in 0..i {
                let (a, b) = (&self.uses[j], &self.uses[i]);
                if a.resource == b.resource && a.region.overlaps(&b.region) && (a.writes() || b.writes()) {
                    let verb = |u: &Use| if u.writes() { "written" } else { "read" };
                    let what = format!(
                        "{} as `{}` and {} as `{}` in one pass; use two passes or two resources",
                        verb(a),
                        a.role,
                        verb(b),
                        b.role
                    );
                    conflicts.push((self.graph.resource_name(a.resource), what));
                }
            }
        }
        for (name, what) in conflicts {
            self.mistake(MistakeKind::Conflict, name, what);
        }
    }
}

fn storage_access(access: shader::Access) -> Access {
    match access {
        shader::Access::Read => Access::STORAGE_READ,
        shader::Access::Write => Access::STORAGE_WRITE,
        shader::Access::ReadWrite => Access::STORAGE_READ | Access::STORAGE_WRITE,
    }
}
