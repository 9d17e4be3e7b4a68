//! Small work for a device, shared by the tests of `engine/gpu`.
#![allow(dead_code)]

pub mod fault;

use std::sync::OnceLock;

use ash::vk;
use lucerna::{
    Result,
    gpu::{
        Commands, DescriptorArena, Gpu, ImageDesc, OwnedBuffer, OwnedImage, Pipeline, RasterState, Region, SamplerDesc,
        Timestamps,
    },
    shader::{Access, Binding, BindingKind, Shader, Stage, StageCode, Texel},
};

/// A compute shader that writes each of 64 words plus one to another buffer.
pub fn successor() -> &'static Shader {
    let source = "#version 460
        layout(local_size_x = 64) in;
        layout(binding = 0) readonly buffer From { uint from[]; };
        layout(binding = 1) writeonly buffer To { uint to[]; };
        void main() { to[gl_GlobalInvocationID.x] = from[gl_GlobalInvocationID.x] + 1u; }";
    static SHADER: OnceLock<&Shader> = OnceLock::new();
    SHADER.get_or_init(|| compute("test.successor", source))
}

/// A compute shader of 64 threads a workgroup that reads a buffer at binding 0 and writes one at binding 1.
pub fn compute(name: &'static str, source: &str) -> &'static Shader {
    let compiler = shaderc::Compiler::new().unwrap();
    let mut options = shaderc::CompileOptions::new().unwrap();
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_3 as u32);
    let code = compiler.compile_into_spirv(source, shaderc::ShaderKind::Compute, name, "main", Some(&options)).unwrap();
    let spirv: &'static [u8] = code.as_binary_u8().to_vec().leak();
    let binding = |name, binding, access| Binding {
        name,
        binding,
        kind: BindingKind::Buffer,
        access,
        stages: &[Stage::Compute],
        count: 1,
        texel: Texel::None,
        format: 0,
    };
    Box::leak(Box::new(Shader {
        name,
        stages: Box::leak(Box::new([StageCode { stage: Stage::Compute, file: "", spirv }])),
        bindings: Box::leak(Box::new([binding("from", 0, Access::Read), binding("to", 1, Access::Write)])),
        push_size: 0,
        workgroup: [64, 1, 1],
        spec: &[],
        color_outputs: 0,
        ray_query: false,
        query: None,
    }))
}

/// A chain of buffers, each the successor of the one before, beginning with zeros: as many steps in each submission as
/// `submissions` says, with or without barriers in between. Returns the last buffer: 64 words.
pub fn successors(gpu: &Gpu, submissions: &[u32], barriers: bool) -> Result<Vec<u8>> {
    let steps: u32 = submissions.iter().sum();
    let buffers: Vec<OwnedBuffer> = (0..=steps)
        .map(|i| OwnedBuffer::with_contents(gpu, &format!("words {i}"), &[0; 256]))
        .collect::<Result<_>>()?;
    let pipeline = gpu.compute_pipeline(successor(), &[])?;
    let mut arena = DescriptorArena::new(gpu);
    let mut pairs = buffers.windows(2);
    let mut running = Vec::new();
    for count in submissions {
        let mut commands = gpu.commands("successors")?;
        for pair in pairs.by_ref().take(*count as usize) {
            let set = arena.allocate("test.successor", pipeline.set_layout)?;
            dispatch(&mut commands, "test.successor", pipeline, set, [&pair[0], &pair[1]], 1);
            if barriers {
                commands.everything_barrier();
            }
        }
        running.push(commands.submit()?);
    }
    for submission in running {
        submission.wait()?;
    }
    buffers[steps as usize].read()
}

/// Records a pass of `groups` workgroups that reads the first buffer and writes the second. The caller keeps everything
/// alive until it is done.
pub fn dispatch(
    commands: &mut Commands,
    name: &str,
    pipeline: Pipeline,
    set: vk::DescriptorSet,
    buffers: [&OwnedBuffer; 2],
    groups: u32,
) {
    let infos = buffers.map(|b| [vk::DescriptorBufferInfo::default().buffer(b.raw()).range(vk::WHOLE_SIZE)]);
    let writes: Vec<_> = infos
        .iter()
        .enumerate()
        .map(|(i, info)| {
            vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(i as u32)
                .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                .buffer_info(info)
        })
        .collect();
    commands.begin_pass(name);
    // SAFETY: in recording; the set is new; everything bound is kept by the caller.
    unsafe {
        let gpu = commands.gpu();
        let device = gpu.device();
        let raw = commands.raw();
        device.update_descriptor_sets(&writes, &[]);
        device.cmd_bind_pipeline(raw, pipeline.bind_point, pipeline.raw);
        device.cmd_bind_descriptor_sets(raw, pipeline.bind_point, pipeline.layout, 0, &[set], &[]);
        device.cmd_dispatch(raw, groups, 1, 1);
    }
    commands.end_pass();
}

/// Draws an image over a target of the same size, and returns the target.
pub fn show(gpu: &Gpu, width: u32, height: u32, rgba: &[u8]) -> Result<Vec<u8>> {
    let desc = ImageDesc::new(vk::Format::R8G8B8A8_UNORM, width, height);
    let image = OwnedImage::with_contents(gpu, "picture", desc, &[Region { mip: 0, layer: 0, bytes: rgba }])?;
    let target = OwnedImage::new(gpu, "target", desc.also(vk::ImageUsageFlags::COLOR_ATTACHMENT))?;
    let state = RasterState { color_formats: vec![desc.format], ..RasterState::default() };
    let pipeline = gpu.raster_pipeline(&lucerna::shaders::test::show::SHADER, &[], &state)?;
    let mut arena = DescriptorArena::new(gpu);
    let set = arena.allocate("test.show", pipeline.set_layout)?;
    let info = [vk::DescriptorImageInfo::default()
        .image_view(image.view(image.whole())?)
        .sampler(gpu.sampler(SamplerDesc::NEAREST)?)
        .image_layout(image.layout())];
    let write = vk::WriteDescriptorSet::default()
        .dst_set(set)
        .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
        .image_info(&info);
    let stamps = Timestamps::new(gpu, 2)?;
    let mut commands = gpu.commands("show")?;
    stamps.reset(&mut commands);
    commands.begin_pass("test.show");
    stamps.write(&mut commands, 0, vk::PipelineStageFlags2::TOP_OF_PIPE);
    let area = vk::Rect2D::default().extent(vk::Extent2D { width, height });
    let attachments = [vk::RenderingAttachmentInfo::default()
        .image_view(target.view(target.whole())?)
        .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)];
    let rendering = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&attachments);
    // The single flip: clip space points up, rows go down.
    let viewport = vk::Viewport {
        x: 0.0,
        y: height as f32,
        width: width as f32,
        height: -(height as f32),
        min_depth: 0.0,
        max_depth: 1.0,
    };
    let to_color = [vk::ImageMemoryBarrier2::default()
        .dst_stage_mask(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT)
        .dst_access_mask(vk::AccessFlags2::COLOR_ATTACHMENT_WRITE)
        .new_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
        .image(target.raw())
        .subresource_range(target.range())];
    // SAFETY: in recording; everything used is kept until the submission was waited for.
    unsafe {
        let device = gpu.device();
        let raw = commands.raw();
        device.update_descriptor_sets(&[write], &[]);
        device.cmd_pipeline_barrier2(raw, &vk::DependencyInfo::default().image_memory_barriers(&to_color));
        device.cmd_begin_rendering(raw, &rendering);
        device.cmd_bind_pipeline(raw, pipeline.bind_point, pipeline.raw);
        device.cmd_bind_descriptor_sets(raw, pipeline.bind_point, pipeline.layout, 0, &[set], &[]);
        device.cmd_set_viewport(raw, 0, &[viewport]);
        device.cmd_set_scissor(raw, 0, &[area]);
        device.cmd_draw(raw, 3, 1, 0, 0);
        device.cmd_end_rendering(raw);
    }
    stamps.write(&mut commands, 1, vk::PipelineStageFlags2::BOTTOM_OF_PIPE);
    commands.end_pass();
    commands.keep(image.clone());
    commands.keep(target.clone());
    commands.submit()?.wait()?;
    target.set_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
    stamps.read()?;
    target.read(0, 0)
}
