//! Records a plan: barriers, labels, timestamps, compute and raster passes.

use ash::vk;

use super::{
    super::{
        Graph,
        format::{Class, Extent, Format},
        handles::{Buffer, Image},
        over::Limits,
        pass::{Bound, Groups, Work},
        plan::{Barrier, Plan},
        raster::{Depth, Draw, DrawKind, Load, Raster, StencilLoad, Targets},
        vocab::{Resource, Stages},
        vulkan,
    },
    bind::mismatch,
    parts::Parts,
    pool::{Memory, device_format},
};
use crate::{
    Error, ErrorKind, Result,
    gpu::{Commands, DescriptorArena, Gpu, OwnedBuffer, Pipeline, RasterState, Stencil, ViewDesc},
};

/// Everything that recording needs.
pub(super) struct Recorder<'a> {
    pub gpu: &'a Gpu,
    pub graph: &'a Graph,
    pub plan: &'a Plan,
    /// The memory of each physical resource.
    pub memory: &'a [Memory],
    pub uniforms: Option<OwnedBuffer>,
    /// Contents of the buffers of the upload pass, one after the other.
    pub staging: Option<OwnedBuffer>,
    pub sets: &'a mut DescriptorArena,
    pub commands: Commands,
    pub parts: Parts<'a>,
    /// Labels that are open.
    pub open: &'a [String],
    pub limits: Limits,
}

impl Recorder<'_> {
    pub fn memory_of_image(&self, image: Image) -> Result<&Memory> {
        let physical = self.plan.physical_of(Resource::Image(image.index));
        physical.and_then(|p| self.memory.get(p)).ok_or_else(|| mismatch(self.graph.short_name(image)))
    }

    pub fn raw_image(&self, image: Image) -> Result<vk::Image> {
        match self.memory_of_image(image)? {
            Memory::Image(owned) => Ok(owned.raw()),
            _ => Err(mismatch(self.graph.short_name(image))),
        }
    }

    pub fn raw_buffer(&self, buffer: Buffer) -> Result<vk::Buffer> {
        let physical = self.plan.physical_of(Resource::Buffer(buffer.index));
        match physical.and_then(|p| self.memory.get(p)) {
            Some(Memory::Buffer(owned)) => Ok(owned.raw()),
            _ => Err(mismatch(self.graph.short_buffer_name(buffer))),
        }
    }

    /// The format that the device has for `image`.
    pub fn format(&self, image: Image) -> Format {
        device_format(self.gpu, self.graph.images[image.index as usize].desc.format)
    }

    pub fn extent(&self, image: Image) -> Extent {
        self.graph.images[image.index as usize].desc.extent.mip(image.mip)
    }

    /// Records `barriers` as one command.
    pub fn barriers(&mut self, barriers: &[Barrier]) {
        let mut images = Vec::new();
        let mut buffers = Vec::new();
        for b in barriers {
            let (src, dst) = (vulkan::stages(b.src.stages), vulkan::stages(b.dst.stages));
            let buffer = match self.memory.get(b.physical) {
                Some(Memory::Buffer(buffer)) => Some(buffer),
                Some(Memory::Accel(accel)) => Some(accel.buffer()),
                _ => None,
            };
            let (made, seen) = (vulkan::access(b.src.access), vulkan::access(b.dst.access));
            match (self.memory.get(b.physical), buffer) {
                (Some(Memory::Image(image)), _) => images.push(
                    vk::ImageMemoryBarrier2::default()
                        .src_stage_mask(src)
                        .src_access_mask(made)
                        .dst_stage_mask(dst)
                        .dst_access_mask(seen)
                        .old_layout(b.from.to_vk())
                        .new_layout(b.to.to_vk())
                        .image(image.raw())
                        .subresource_range(vk::ImageSubresourceRange {
                            aspect_mask: image.desc().aspects(),
                            base_mip_level: b.region.a.0 as u32,
                            level_count: (b.region.a.1 - b.region.a.0) as u32,
                            base_array_layer: b.region.b.0 as u32,
                            layer_count: (b.region.b.1 - b.region.b.0) as u32,
                        }),
                ),
                (_, Some(buffer)) => buffers.push(
                    vk::BufferMemoryBarrier2::default()
                        .src_stage_mask(src)
                        .src_access_mask(made)
                        .dst_stage_mask(dst)
                        .dst_access_mask(seen)
                        .buffer(buffer.raw())
                        .offset(b.region.a.0)
                        .size(b.region.a.1 - b.region.a.0),
                ),
                _ => {}
            }
        }
        if images.is_empty() && buffers.is_empty() {
            return;
        }
        let info = vk::DependencyInfo::default().image_memory_barriers(&images).buffer_memory_barriers(&buffers);
        // SAFETY: in recording, outside of rendering; images and buffers are alive and the ranges inside of them.
        unsafe { self.gpu.device().cmd_pipeline_barrier2(self.commands.raw(), &info) };
    }

    /// Records what pass `index` does.
    pub fn work(&mut self, index: usize, work: &Work) -> Result<()> {
        match work {
            Work::Compute { bound, groups, .. } => {
                let pipeline = self.prepare(index, bound)?;
                self.push(bound, &pipeline);
                self.dispatch(groups)
            }
            Work::Raster { bound, targets, state, draw } => self.raster(index, bound, targets, state, draw),
            Work::BuildBottoms { accel, builds, scratch } => self.build_bottoms(*accel, builds, *scratch),
            Work::BuildTop { accel, instances, count, scratch } => self.build_top(*accel, *instances, *count, *scratch),
            other => self.transfer(other),
        }
    }

    /// Binds pipeline and descriptors of a compute pass.
    pub fn prepare(&mut self, index: usize, bound: &Bound) -> Result<Pipeline> {
        let pipeline = self.gpu.compute_pipeline(bound.shader, &bound.spec)?;
        self.bind(index, bound, &pipeline)?;
        Ok(pipeline)
    }

    /// A dispatch waits for the one before it in the same pass.
    pub fn between_dispatches(&mut self) {
        let barrier = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER)
            .src_access_mask(vk::AccessFlags2::SHADER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER)
            .dst_access_mask(vk::AccessFlags2::SHADER_READ | vk::AccessFlags2::SHADER_WRITE)];
        let info = vk::DependencyInfo::default().memory_barriers(&barrier);
        // SAFETY: in recording, outside of rendering.
        unsafe { self.gpu.device().cmd_pipeline_barrier2(self.commands.raw(), &info) };
    }

    /// Records the dispatch of what [`Self::prepare`] bound.
    pub fn dispatch(&mut self, groups: &Groups) -> Result<()> {
        let raw = self.commands.raw();
        match groups {
            Groups::Direct(groups) => {
                let limit = self.gpu.caps().limits.work_group_count;
                if (0..3).any(|i| groups[i] > limit[i]) {
                    let what = format!("{groups:?} workgroups; the device allows {limit:?}");
                    return Err(Error::new(ErrorKind::Runtime, what).help("Use a smaller image or split the pass"));
                }
                if groups.iter().all(|n| *n > 0) {
                    // SAFETY: in recording, with pipeline and descriptors bound; counts inside the limits.
                    unsafe { self.gpu.device().cmd_dispatch(raw, groups[0], groups[1], groups[2]) };
                }
            }
            Groups::Indirect { buffer, offset } => {
                let commands = self.raw_buffer(*buffer)?;
                // SAFETY: the plan checked that the parameters lie inside the buffer at a multiple of 4.
                unsafe { self.gpu.device().cmd_dispatch_indirect(raw, commands, buffer.offset + offset) };
            }
        }
        Ok(())
    }

    fn raster(&mut self, index: usize, bound: &Bound, targets: &Targets, state: &Raster, draw: &Draw) -> Result<()> {
        if targets.views && !self.gpu.caps().multiview {
            let what = "the device cannot draw several views in one pass (multiview)";
            return Err(Error::new(ErrorKind::Runtime, what).help("Draw each view in a pass of its own"));
        }
        let first = targets.colors.first().map(|(i, _)| *i).or(targets.depth.map(|(i, _)| i));
        let Some(first) = first else { return Err(mismatch("targets")) };
        let views = if targets.views { (1 << first.layers) - 1 } else { 0 };
        let raster = RasterState { view_mask: views, ..self.raster_state(targets, state) };
        let pipeline = self.gpu.raster_pipeline(bound.shader, &bound.spec, &raster)?;
        let full = self.extent(first);
        let mut colors = Vec::with_capacity(targets.colors.len());
        for (image, load) in &targets.colors {
            let (load, value) = match load {
                Load::Clear(c) => (vk::AttachmentLoadOp::CLEAR, vk::ClearColorValue { float32: *c }),
                Load::ClearUint(c) => (vk::AttachmentLoadOp::CLEAR, vk::ClearColorValue { uint32: *c }),
                Load::Keep => (vk::AttachmentLoadOp::LOAD, vk::ClearColorValue::default()),
                Load::Discard => (vk::AttachmentLoadOp::DONT_CARE, vk::ClearColorValue::default()),
            };
            colors.push(
                vk::RenderingAttachmentInfo::default()
                    .image_view(self.target_view(*image)?)
                    .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
                    .load_op(load)
                    .store_op(vk::AttachmentStoreOp::STORE)
                    .clear_value(vk::ClearValue { color: value }),
            );
        }
        let (depth, stencil) = self.depth_attachments(index, targets)?;
        let mut info = vk::RenderingInfo::default()
            .render_area(vk::Rect2D {
                offset: vk::Offset2D::default(),
                extent: vk::Extent2D { width: full.width, height: full.height },
            })
            .layer_count(first.layers)
            .view_mask(raster.view_mask)
            .color_attachments(&colors);
        if let Some(depth) = &depth {
            info = info.depth_attachment(depth);
        }
        if let Some(stencil) = &stencil {
            info = info.stencil_attachment(stencil);
        }
        // Descriptors first: an error must not leave rendering open.
        self.bind(index, bound, &pipeline)?;
        self.push(bound, &pipeline);
        let raw = self.commands.raw();
        let [x, y, w, h] = targets.area.unwrap_or([0, 0, full.width, full.height]);
        let (near, far) = draw.depth.map_or((0.0, 1.0), |d| (d, d));
        // The one place where the picture is flipped: clip space has +Y up, row 0 is the top.
        let viewport = vk::Viewport {
            x: x as f32,
            y: (y + h) as f32,
            width: w as f32,
            height: -(h as f32),
            min_depth: near,
            max_depth: far,
        };
        let scissor = vk::Rect2D {
            offset: vk::Offset2D { x: x as i32, y: y as i32 },
            extent: vk::Extent2D { width: w, height: h },
        };
        let device = self.gpu.device();
        // SAFETY: in recording; views are alive and in the layouts that the plan brought them to.
        unsafe {
            device.cmd_begin_rendering(raw, &info);
            device.cmd_set_viewport(raw, 0, &[viewport]);
            device.cmd_set_scissor(raw, 0, &[scissor]);
            if let Some(bias) = state.depth_bias {
                device.cmd_set_depth_bias(raw, bias.constant, 0.0, bias.slope);
            }
        }
        let drawn = self.draw(draw);
        // SAFETY: rendering was begun above.
        unsafe { self.gpu.device().cmd_end_rendering(raw) };
        drawn
    }

    fn raster_state(&self, targets: &Targets, state: &Raster) -> RasterState {
        let read_only = matches!(targets.depth, Some((_, Depth::ReadOnly)));
        let depth = targets.depth.map(|(image, _)| self.format(image));
        let blend = |image: Image| match self.format(image).class() {
            Class::Uint | Class::Sint => None,
            _ => vulkan::blend(state.blend),
        };
        RasterState {
            color_formats: targets.colors.iter().map(|(i, _)| self.format(*i).to_vk()).collect(),
            depth_format: depth.map(Format::to_vk),
            stencil_format: depth.filter(|f| f.class() == Class::DepthStencil).map(Format::to_vk),
            topology: vulkan::topology(state.topology),
            cull: vulkan::cull(state.cull),
            front_face: vk::FrontFace::COUNTER_CLOCKWISE,
            depth_compare: depth.map(|_| vulkan::compare(state.depth_compare)),
            depth_write: depth.is_some() && state.depth_write && !read_only,
            depth_bias: state.depth_bias.is_some(),
            depth_clamp: state.depth_clamp,
            stencil: state.stencil.map(|s| Stencil {
                compare: vulkan::compare(s.compare),
                pass: vulkan::stencil_op(s.pass),
                fail: vulkan::stencil_op(s.fail),
                depth_fail: vulkan::stencil_op(s.depth_fail),
                read_mask: s.read_mask.into(),
                write_mask: if read_only { 0 } else { s.write_mask.into() },
                reference: s.reference.into(),
            }),
            blend: targets.colors.iter().map(|(i, _)| blend(*i)).collect(),
            view_mask: 0,
        }
    }

    fn target_view(&self, image: Image) -> Result<vk::ImageView> {
        let Memory::Image(owned) = self.memory_of_image(image)? else { return Err(mismatch("target")) };
        let ty = if image.layers > 1 { vk::ImageViewType::TYPE_2D_ARRAY } else { vk::ImageViewType::TYPE_2D };
        owned.view(ViewDesc {
            ty,
            aspect: owned.desc().aspects(),
            base_mip: image.mip,
            mips: 1,
            base_layer: image.layer,
            layers: image.layers,
        })
    }

    #[allow(clippy::type_complexity)]
    fn depth_attachments(
        &self,
        index: usize,
        targets: &Targets,
    ) -> Result<(Option<vk::RenderingAttachmentInfo<'static>>, Option<vk::RenderingAttachmentInfo<'static>>)> {
        let Some((image, load)) = targets.depth else { return Ok((None, None)) };
        let resource = Resource::Image(image.index);
        let uses = &self.plan.passes[index].uses;
        let layout = uses.iter().rev().find(|u| u.resource == resource && u.scope.stages == Stages::DEPTH);
        let layout = layout.map_or(vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL, |u| u.layout.to_vk());
        let (depth_load, value) = match load {
            Depth::Clear(value) => (vk::AttachmentLoadOp::CLEAR, value),
            Depth::Keep | Depth::ReadOnly => (vk::AttachmentLoadOp::LOAD, 0.0),
        };
        let (stencil_load, stencil) = match (targets.stencil, load) {
            (Some(StencilLoad::Clear(value)), Depth::Clear(_) | Depth::Keep) => {
                (vk::AttachmentLoadOp::CLEAR, u32::from(value))
            }
            (None, Depth::Clear(_)) => (vk::AttachmentLoadOp::CLEAR, 0),
            _ => (vk::AttachmentLoadOp::LOAD, 0),
        };
        // Storing would be a write.
        let store = if load == Depth::ReadOnly { vk::AttachmentStoreOp::NONE } else { vk::AttachmentStoreOp::STORE };
        let view = self.target_view(image)?;
        let attachment = |load, value| {
            vk::RenderingAttachmentInfo::default()
                .image_view(view)
                .image_layout(layout)
                .load_op(load)
                .store_op(store)
                .clear_value(vk::ClearValue { depth_stencil: value })
        };
        let value = vk::ClearDepthStencilValue { depth: value, stencil };
        let has_stencil = self.format(image).class() == Class::DepthStencil;
        Ok((Some(attachment(depth_load, value)), has_stencil.then(|| attachment(stencil_load, value))))
    }

    fn draw(&mut self, draw: &Draw) -> Result<()> {
        let raw = self.commands.raw();
        let device = self.gpu.device();
        let many = self.gpu.caps().multi_draw_indirect;
        // SAFETY: inside rendering, with everything bound; the plan checked that indices and parameters lie inside their
        // buffers.
        unsafe {
            match &draw.kind {
                DrawKind::Calls(calls) => {
                    for c in calls {
                        device.cmd_draw(raw, c.vertices, c.instances, c.first_vertex, c.first_instance);
                    }
                }
                DrawKind::Indexed { indices, calls } => {
                    let buffer = self.raw_buffer(*indices)?;
                    device.cmd_bind_index_buffer(raw, buffer, indices.offset, vk::IndexType::UINT32);
                    for c in calls.iter() {
                        device.cmd_draw_indexed(
                            raw,
                            c.indices,
                            c.instances,
                            c.first_index,
                            c.vertex_offset,
                            c.first_instance,
                        );
                    }
                }
                DrawKind::Indirect { commands, count } => {
                    let buffer = self.raw_buffer(*commands)?;
                    let (calls, each) = if many { (1, *count) } else { (*count, 1) };
                    for i in 0..calls {
                        device.cmd_draw_indirect(raw, buffer, commands.offset + 16 * u64::from(i), each, 16);
                    }
                }
                DrawKind::IndexedIndirect { indices, commands, count } => {
                    let buffer = self.raw_buffer(*indices)?;
                    device.cmd_bind_index_buffer(raw, buffer, indices.offset, vk::IndexType::UINT32);
                    let buffer = self.raw_buffer(*commands)?;
                    let (calls, each) = if many { (1, *count) } else { (*count, 1) };
                    for i in 0..calls {
                        device.cmd_draw_indexed_indirect(raw, buffer, commands.offset + 20 * u64::from(i), each, 20);
                    }
                }
            }
        }
        Ok(())
    }
}
