//! What each pass does to which part of which resource, in one table, and the mistakes that show in a pass by itself.

mod accel;
mod bindings;
mod draws;

use super::{
    Graph,
    format::{Format, ImageDesc},
    handles::{Buffer, GraphId, Image},
    pass::{Groups, Imported, Origin, Pass, Work},
    vocab::{Access, Layout, Mistake, MistakeKind, Region, Resource, Scope, Stages, Usage, Use},
};

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
            Work::Compute { bound, groups, .. } => {
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
            Work::BuildBottoms { accel, builds, scratch } => c.build_bottoms(*accel, builds, *scratch),
            Work::BuildTop { accel, instances, count, scratch } => c.build_top(*accel, *instances, *count, *scratch),
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
        for (buffer, written) in &pass.addressed {
            let access = if *written { Access::STORAGE_READ | Access::STORAGE_WRITE } else { Access::STORAGE_READ };
            c.buffer(*buffer, Stages::COMPUTE, access, Usage::STORAGE, "by address");
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

    fn one_level(&mut self, image: Image, action: &str) {
        if image.mips != 1 {
            let what = format!("only one level {action}, this handle covers {}; choose one with `.mip(i)`", image.mips);
            self.mistake(MistakeKind::Shape, self.image_name(image), what);
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
