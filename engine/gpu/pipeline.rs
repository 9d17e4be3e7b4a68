//! Pipelines: made once for each shader, specialisation and state, owned by the device.

use std::collections::HashMap;

use ash::vk;

use super::{
    Gpu,
    device::{Context, lock},
    modules::Modules,
};
use crate::{
    Error, ErrorKind, Result,
    shader::{BindingKind, ENGINE_SPEC, Shader, Stage},
};

/// What to bind to run a shader. The handles live as long as the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pipeline {
    pub raw: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    /// Layout of descriptor set 0.
    pub set_layout: vk::DescriptorSetLayout,
    pub bind_point: vk::PipelineBindPoint,
    /// Stages that see the push constants; empty if there are none.
    pub push_stages: vk::ShaderStageFlags,
}

/// How a colour target is blended: `src * source + dst * target`, for colour and alpha alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Blend {
    pub src: vk::BlendFactor,
    pub dst: vk::BlendFactor,
    pub op: vk::BlendOp,
}

impl Blend {
    /// Sum.
    pub const ADD: Self = Self { src: vk::BlendFactor::ONE, dst: vk::BlendFactor::ONE, op: vk::BlendOp::ADD };
    /// Over, with premultiplied alpha.
    pub const OVER: Self =
        Self { src: vk::BlendFactor::ONE, dst: vk::BlendFactor::ONE_MINUS_SRC_ALPHA, op: vk::BlendOp::ADD };
    /// Product.
    pub const MULTIPLY: Self =
        Self { src: vk::BlendFactor::DST_COLOR, dst: vk::BlendFactor::ZERO, op: vk::BlendOp::ADD };
    /// Smaller of both, component by component.
    pub const MIN: Self = Self { src: vk::BlendFactor::ONE, dst: vk::BlendFactor::ONE, op: vk::BlendOp::MIN };
    /// Larger of both, component by component.
    pub const MAX: Self = Self { src: vk::BlendFactor::ONE, dst: vk::BlendFactor::ONE, op: vk::BlendOp::MAX };
}

/// Stencil test and update, the same for front and back faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Stencil {
    pub compare: vk::CompareOp,
    /// When stencil and depth tests pass.
    pub pass: vk::StencilOp,
    /// When the stencil test fails.
    pub fail: vk::StencilOp,
    /// When the stencil test passes and the depth test fails.
    pub depth_fail: vk::StencilOp,
    pub read_mask: u32,
    pub write_mask: u32,
    pub reference: u32,
}

/// Fixed state of a raster pipeline. Viewport and scissor are dynamic, and the depth bias if [`Self::depth_bias`] is set.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct RasterState {
    /// Formats of the colour targets in the order of their locations; `UNDEFINED` for an unused one.
    pub color_formats: Vec<vk::Format>,
    pub depth_format: Option<vk::Format>,
    pub stencil_format: Option<vk::Format>,
    pub topology: vk::PrimitiveTopology,
    pub cull: vk::CullModeFlags,
    pub front_face: vk::FrontFace,
    /// `None`: no depth test.
    pub depth_compare: Option<vk::CompareOp>,
    pub depth_write: bool,
    /// `vkCmdSetDepthBias` is called before each draw.
    pub depth_bias: bool,
    /// Clamp depth instead of clipping; ignored on devices without it.
    pub depth_clamp: bool,
    pub stencil: Option<Stencil>,
    /// One for each colour target, or fewer: the rest replaces.
    pub blend: Vec<Option<Blend>>,
    /// Views drawn at once (multiview); 0: one.
    pub view_mask: u32,
}

impl Default for RasterState {
    /// Triangles, counter-clockwise front faces (as seen in the image), no culling, no tests, no targets.
    fn default() -> Self {
        Self {
            color_formats: Vec::new(),
            depth_format: None,
            stencil_format: None,
            topology: vk::PrimitiveTopology::TRIANGLE_LIST,
            cull: vk::CullModeFlags::NONE,
            front_face: vk::FrontFace::COUNTER_CLOCKWISE,
            depth_compare: None,
            depth_write: false,
            depth_bias: false,
            depth_clamp: false,
            stencil: None,
            blend: Vec::new(),
            view_mask: 0,
        }
    }
}

/// Everything that tells one pipeline from another. A shader is its address: it is a constant of the program.
#[derive(PartialEq, Eq, Hash)]
struct Key {
    shader: usize,
    spec: Vec<u32>,
    state: Option<RasterState>,
}

#[derive(Clone, Copy, Default)]
struct Layout {
    set: vk::DescriptorSetLayout,
    pipeline: vk::PipelineLayout,
    push_stages: vk::ShaderStageFlags,
}

/// All pipelines and layouts of a device.
#[derive(Default)]
pub(crate) struct PipelineCache {
    driver_cache: Option<vk::PipelineCache>,
    layouts: HashMap<usize, Layout>,
    pipelines: HashMap<Key, Pipeline>,
}

impl PipelineCache {
    /// Not while anything is in use.
    pub fn destroy(&mut self, device: &ash::Device) {
        // SAFETY: the caller promises that nothing is in use.
        unsafe {
            for (_, pipeline) in self.pipelines.drain() {
                device.destroy_pipeline(pipeline.raw, None);
            }
            for (_, layout) in self.layouts.drain() {
                device.destroy_pipeline_layout(layout.pipeline, None);
                device.destroy_descriptor_set_layout(layout.set, None);
            }
            if let Some(cache) = self.driver_cache.take() {
                device.destroy_pipeline_cache(cache, None);
            }
        }
    }

    fn driver_cache(&mut self, context: &Context) -> Result<vk::PipelineCache> {
        if let Some(cache) = self.driver_cache {
            return Ok(cache);
        }
        // SAFETY: complete info, living device.
        let made = unsafe { context.device.create_pipeline_cache(&vk::PipelineCacheCreateInfo::default(), None) };
        let cache = context.check(made, || "vkCreatePipelineCache".into())?;
        self.driver_cache = Some(cache);
        Ok(cache)
    }

    fn layout(&mut self, context: &Context, shader: &'static Shader) -> Result<Layout> {
        let key = std::ptr::from_ref(shader) as usize;
        if let Some(layout) = self.layouts.get(&key) {
            return Ok(*layout);
        }
        let layout = make_layout(context, shader)?;
        self.layouts.insert(key, layout);
        Ok(layout)
    }
}

impl Gpu {
    /// The pipeline of a compute shader; `spec` has a value for each of [`Shader::spec`], in that order.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`, `Runtime`; the message has the shader's name.
    pub fn compute_pipeline(&self, shader: &'static Shader, spec: &[u32]) -> Result<Pipeline> {
        self.pipeline(shader, spec, None)
    }

    /// The pipeline of a vertex shader with or without a fragment shader, for `state`.
    ///
    /// # Errors
    /// As [`Self::compute_pipeline`].
    pub fn raster_pipeline(&self, shader: &'static Shader, spec: &[u32], state: &RasterState) -> Result<Pipeline> {
        self.pipeline(shader, spec, Some(state))
    }

    fn pipeline(&self, shader: &'static Shader, spec: &[u32], state: Option<&RasterState>) -> Result<Pipeline> {
        let context = &*self.0;
        let key = Key { shader: std::ptr::from_ref(shader) as usize, spec: spec.to_vec(), state: state.cloned() };
        let mut cache = lock(&context.pipelines);
        if let Some(pipeline) = cache.pipelines.get(&key) {
            return Ok(*pipeline);
        }
        context.alive()?;
        let pipeline = make(context, &mut cache, shader, spec, state)?;
        context.name(pipeline.raw, shader.name);
        cache.pipelines.insert(key, pipeline);
        Ok(pipeline)
    }
}

fn make(
    context: &Context,
    cache: &mut PipelineCache,
    shader: &'static Shader,
    spec: &[u32],
    state: Option<&RasterState>,
) -> Result<Pipeline> {
    if spec.len() != shader.spec.len() {
        return Err(Error::new(
            ErrorKind::Runtime,
            format!(
                "{} specialisation constants were given to shader `{}`, it has {}",
                spec.len(),
                shader.name,
                shader.spec.len()
            ),
        ));
    }
    check_stages(context, shader, state)?;
    let layout = cache.layout(context, shader)?;
    let driver_cache = cache.driver_cache(context)?;

    let entries: Vec<_> = shader
        .spec
        .iter()
        .map(|constant| constant.id)
        .chain([ENGINE_SPEC])
        .enumerate()
        .map(|(i, constant_id)| vk::SpecializationMapEntry { constant_id, offset: 4 * i as u32, size: 4 })
        .collect();
    let values = [spec, &[u32::from(context.caps.ordered_rays)]].concat();
    let specialization = vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(&values));
    let modules = Modules::new(context, shader)?;
    let stages: Vec<_> = shader
        .stages
        .iter()
        .zip(modules.list())
        .map(|(code, module)| {
            vk::PipelineShaderStageCreateInfo::default()
                .stage(stage_flag(code.stage))
                .module(*module)
                .name(c"main")
                .specialization_info(&specialization)
        })
        .collect();
    let (made, call) = match state {
        None => {
            let info = vk::ComputePipelineCreateInfo::default().stage(stages[0]).layout(layout.pipeline);
            // SAFETY: complete info with living modules and layout.
            let made = unsafe { context.device.create_compute_pipelines(driver_cache, &[info], None) };
            (made, "vkCreateComputePipelines")
        }
        Some(state) => (make_raster(context, driver_cache, layout, &stages, state), "vkCreateGraphicsPipelines"),
    };
    let raw = match made {
        Ok(pipelines) => pipelines[0],
        Err((pipelines, result)) => {
            for pipeline in pipelines {
                // SAFETY: made just now or null.
                unsafe { context.device.destroy_pipeline(pipeline, None) };
            }
            context.check(Err(result), || format!("{call} for shader `{}`", shader.name))?
        }
    };
    let bind_point = if state.is_some() { vk::PipelineBindPoint::GRAPHICS } else { vk::PipelineBindPoint::COMPUTE };
    Ok(Pipeline { raw, layout: layout.pipeline, set_layout: layout.set, bind_point, push_stages: layout.push_stages })
}

/// The wrong sort of shader, or more than the device can, is an error and not a crash in the driver.
fn check_stages(context: &Context, shader: &Shader, state: Option<&RasterState>) -> Result<()> {
    let fail = |what: String| Err(Error::new(ErrorKind::Runtime, format!("shader `{}` {what}", shader.name)));
    let has = |stage| shader.stages.iter().any(|code| code.stage == stage);
    if state.is_none() != has(Stage::Compute) || (state.is_some() && !has(Stage::Vertex)) {
        return fail(format!("is no {} shader", if state.is_some() { "raster" } else { "compute" }));
    }
    if shader.ray_query && !context.caps.ray_query {
        return fail(format!("traces by ray query, which is not on for {}", context.description.device));
    }
    let limits = &context.caps.limits;
    let threads = shader.workgroup.iter().map(|n| u64::from(*n)).product::<u64>();
    if has(Stage::Compute) && threads > u64::from(limits.work_group_invocations) {
        return fail(format!(
            "has workgroups of {threads} threads, {} allows {}",
            context.description.device, limits.work_group_invocations
        ));
    }
    if shader.push_size > limits.push_bytes {
        return fail(format!(
            "has {} bytes of push constants, {} allows {}",
            shader.push_size, context.description.device, limits.push_bytes
        ));
    }
    if let Some(state) = state {
        let targets = state.color_formats.len() as u32;
        if targets > limits.color_attachments {
            return fail(format!(
                "draws to {targets} colour targets, {} allows {}",
                context.description.device, limits.color_attachments
            ));
        }
    }
    Ok(())
}

fn make_raster(
    context: &Context,
    driver_cache: vk::PipelineCache,
    layout: Layout,
    stages: &[vk::PipelineShaderStageCreateInfo<'_>],
    state: &RasterState,
) -> Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)> {
    let vertex = vk::PipelineVertexInputStateCreateInfo::default();
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(state.topology);
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default()
        .depth_clamp_enable(state.depth_clamp && context.caps.depth_clamp)
        .polygon_mode(vk::PolygonMode::FILL)
        .cull_mode(state.cull)
        .front_face(state.front_face)
        .depth_bias_enable(state.depth_bias)
        .line_width(1.0);
    let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let stencil = state.stencil.map(|s| vk::StencilOpState {
        fail_op: s.fail,
        pass_op: s.pass,
        depth_fail_op: s.depth_fail,
        compare_op: s.compare,
        compare_mask: s.read_mask,
        write_mask: s.write_mask,
        reference: s.reference,
    });
    let depth = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(state.depth_compare.is_some() || state.depth_write)
        .depth_write_enable(state.depth_write)
        .depth_compare_op(state.depth_compare.unwrap_or(vk::CompareOp::ALWAYS))
        .stencil_test_enable(stencil.is_some())
        .front(stencil.unwrap_or_default())
        .back(stencil.unwrap_or_default());
    let attachments: Vec<_> = (0..state.color_formats.len())
        .map(|i| {
            let base = vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
            match state.blend.get(i).copied().flatten() {
                None => base,
                Some(Blend { src, dst, op }) => base
                    .blend_enable(true)
                    .src_color_blend_factor(src)
                    .dst_color_blend_factor(dst)
                    .color_blend_op(op)
                    .src_alpha_blend_factor(alpha_factor(src))
                    .dst_alpha_blend_factor(alpha_factor(dst))
                    .alpha_blend_op(op),
            }
        })
        .collect();
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
    let mut dynamic = vec![vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    if state.depth_bias {
        dynamic.push(vk::DynamicState::DEPTH_BIAS);
    }
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
    let mut rendering = vk::PipelineRenderingCreateInfo::default()
        .view_mask(state.view_mask)
        .color_attachment_formats(&state.color_formats)
        .depth_attachment_format(state.depth_format.unwrap_or(vk::Format::UNDEFINED))
        .stencil_attachment_format(state.stencil_format.unwrap_or(vk::Format::UNDEFINED));
    let info = vk::GraphicsPipelineCreateInfo::default()
        .stages(stages)
        .vertex_input_state(&vertex)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout.pipeline)
        .push_next(&mut rendering);
    // SAFETY: complete info with living modules and layout.
    unsafe { context.device.create_graphics_pipelines(driver_cache, &[info], None) }
}

/// Colour factors have no meaning for alpha in some drivers' eyes; their alpha twins have the same values.
fn alpha_factor(factor: vk::BlendFactor) -> vk::BlendFactor {
    match factor {
        vk::BlendFactor::DST_COLOR => vk::BlendFactor::DST_ALPHA,
        vk::BlendFactor::SRC_COLOR => vk::BlendFactor::SRC_ALPHA,
        vk::BlendFactor::ONE_MINUS_DST_COLOR => vk::BlendFactor::ONE_MINUS_DST_ALPHA,
        vk::BlendFactor::ONE_MINUS_SRC_COLOR => vk::BlendFactor::ONE_MINUS_SRC_ALPHA,
        other => other,
    }
}

fn make_layout(context: &Context, shader: &Shader) -> Result<Layout> {
    let flags =
        |stages: &[Stage]| stages.iter().fold(vk::ShaderStageFlags::empty(), |flags, stage| flags | stage_flag(*stage));
    let bindings: Vec<_> = shader
        .bindings
        .iter()
        .map(|binding| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(binding.binding)
                .descriptor_type(descriptor_type(binding.kind))
                .descriptor_count(binding.count)
                .stage_flags(flags(binding.stages))
        })
        .collect();
    let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
    // SAFETY: complete info, living device.
    let set = context.check(unsafe { context.device.create_descriptor_set_layout(&info, None) }, || {
        format!("vkCreateDescriptorSetLayout for shader `{}`", shader.name)
    })?;
    let push_stages = if shader.push_size > 0 {
        shader.stages.iter().fold(vk::ShaderStageFlags::empty(), |all, code| all | stage_flag(code.stage))
    } else {
        vk::ShaderStageFlags::empty()
    };
    let ranges = [vk::PushConstantRange { stage_flags: push_stages, offset: 0, size: shader.push_size }];
    let sets = [set];
    let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
    if shader.push_size > 0 {
        info = info.push_constant_ranges(&ranges);
    }
    // SAFETY: complete info, living device and set layout.
    let made = unsafe { context.device.create_pipeline_layout(&info, None) };
    match context.check(made, || format!("vkCreatePipelineLayout for shader `{}`", shader.name)) {
        Ok(pipeline) => Ok(Layout { set, pipeline, push_stages }),
        Err(error) => {
            // SAFETY: made just now, used by nothing.
            unsafe { context.device.destroy_descriptor_set_layout(set, None) };
            Err(error)
        }
    }
}

fn stage_flag(stage: Stage) -> vk::ShaderStageFlags {
    match stage {
        Stage::Compute => vk::ShaderStageFlags::COMPUTE,
        Stage::Vertex => vk::ShaderStageFlags::VERTEX,
        Stage::Fragment => vk::ShaderStageFlags::FRAGMENT,
    }
}

fn descriptor_type(kind: BindingKind) -> vk::DescriptorType {
    match kind {
        BindingKind::Sampled(_) => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
        BindingKind::Storage(_) => vk::DescriptorType::STORAGE_IMAGE,
        BindingKind::Buffer => vk::DescriptorType::STORAGE_BUFFER,
        BindingKind::Uniform { .. } => vk::DescriptorType::UNIFORM_BUFFER,
        BindingKind::AccelerationStructure => vk::DescriptorType::ACCELERATION_STRUCTURE_KHR,
    }
}
