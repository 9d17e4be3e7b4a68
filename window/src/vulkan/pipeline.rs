//! The pipeline that draws egui's triangles.

use super::device::{Device, Owned};
use crate::error::{Error, vk_error};
use ash::vk;
use egui::epaint::Vertex;
use std::mem::offset_of;
use std::rc::Rc;

/// A pipeline with its layouts.
pub struct Pipeline {
    pub raw: Owned<vk::Pipeline>,
    pub layout: Owned<vk::PipelineLayout>,
    pub set_layout: Owned<vk::DescriptorSetLayout>,
}

/// The size of the push constants: two numbers that turn points into clip coordinates.
pub const PUSH_SIZE: u32 = 8;

impl Pipeline {
    pub fn new(device: &Rc<Device>, target: vk::Format) -> Result<Self, Error> {
        let set_layout = set_layout(device)?;
        let layout = layout(device, set_layout.raw)?;
        let raw = pipeline(device, layout.raw, target)?;
        Ok(Self { raw, layout, set_layout })
    }
}

fn set_layout(device: &Rc<Device>) -> Result<Owned<vk::DescriptorSetLayout>, Error> {
    let bindings = [vk::DescriptorSetLayoutBinding::default()
        .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
        .descriptor_count(1)
        .stage_flags(vk::ShaderStageFlags::FRAGMENT)];
    let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
    // SAFETY: `info` is complete.
    let raw = unsafe { device.raw.create_descriptor_set_layout(&info, None) }
        .map_err(|e| vk_error("vkCreateDescriptorSetLayout", e))?;
    // SAFETY: `Owned` calls this once, with the layout.
    Ok(Owned::new(device, raw, |device, layout| unsafe { device.destroy_descriptor_set_layout(layout, None) }))
}

fn layout(device: &Rc<Device>, set: vk::DescriptorSetLayout) -> Result<Owned<vk::PipelineLayout>, Error> {
    let sets = [set];
    let pushes = [vk::PushConstantRange { stage_flags: vk::ShaderStageFlags::VERTEX, offset: 0, size: PUSH_SIZE }];
    let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets).push_constant_ranges(&pushes);
    // SAFETY: the set layout exists.
    let raw =
        unsafe { device.raw.create_pipeline_layout(&info, None) }.map_err(|e| vk_error("vkCreatePipelineLayout", e))?;
    // SAFETY: `Owned` calls this once, with the layout.
    Ok(Owned::new(device, raw, |device, layout| unsafe { device.destroy_pipeline_layout(layout, None) }))
}

fn shader(device: &Rc<Device>, bytes: &[u8]) -> Result<Owned<vk::ShaderModule>, Error> {
    let words: Vec<u32> = bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let info = vk::ShaderModuleCreateInfo::default().code(&words);
    // SAFETY: the words are SPIR-V from the GLSL compiler.
    let raw =
        unsafe { device.raw.create_shader_module(&info, None) }.map_err(|e| vk_error("vkCreateShaderModule", e))?;
    // SAFETY: `Owned` calls this once, with the module.
    Ok(Owned::new(device, raw, |device, module| unsafe { device.destroy_shader_module(module, None) }))
}

/// Whether the format applies the sRGB curve to what is written.
fn encodes(format: vk::Format) -> bool {
    matches!(format, vk::Format::B8G8R8A8_SRGB | vk::Format::R8G8B8A8_SRGB)
}

fn pipeline(device: &Rc<Device>, layout: vk::PipelineLayout, target: vk::Format) -> Result<Owned<vk::Pipeline>, Error> {
    let vertex = shader(device, include_bytes!(concat!(env!("OUT_DIR"), "/paint.vert.spv")))?;
    let fragment = shader(device, include_bytes!(concat!(env!("OUT_DIR"), "/paint.frag.spv")))?;
    let constants = [vk::SpecializationMapEntry { constant_id: 0, offset: 0, size: size_of::<vk::Bool32>() }];
    let constant_bytes = vk::Bool32::from(encodes(target)).to_ne_bytes();
    let specialization = vk::SpecializationInfo::default().map_entries(&constants).data(&constant_bytes);
    let stages = [
        vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::VERTEX)
            .module(vertex.raw)
            .name(c"main"),
        vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::FRAGMENT)
            .module(fragment.raw)
            .specialization_info(&specialization)
            .name(c"main"),
    ];
    let bindings = [vk::VertexInputBindingDescription {
        binding: 0,
        stride: size_of::<Vertex>() as u32,
        input_rate: vk::VertexInputRate::VERTEX,
    }];
    let attribute = |location, format, offset: usize| vk::VertexInputAttributeDescription {
        location,
        binding: 0,
        format,
        offset: offset as u32,
    };
    let attributes = [
        attribute(0, vk::Format::R32G32_SFLOAT, offset_of!(Vertex, pos)),
        attribute(1, vk::Format::R32G32_SFLOAT, offset_of!(Vertex, uv)),
        attribute(2, vk::Format::R8G8B8A8_UNORM, offset_of!(Vertex, color)),
    ];
    let input = vk::PipelineVertexInputStateCreateInfo::default()
        .vertex_binding_descriptions(&bindings)
        .vertex_attribute_descriptions(&attributes);
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    // egui's colours are premultiplied by their alpha.
    let blends = [vk::PipelineColorBlendAttachmentState::default()
        .color_write_mask(vk::ColorComponentFlags::RGBA)
        .blend_enable(true)
        .src_color_blend_factor(vk::BlendFactor::ONE)
        .dst_color_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
        .color_blend_op(vk::BlendOp::ADD)
        .src_alpha_blend_factor(vk::BlendFactor::ONE)
        .dst_alpha_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
        .alpha_blend_op(vk::BlendOp::ADD)];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
    let dynamics = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamics);
    let formats = [target];
    let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
    let info = vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout)
        .push_next(&mut rendering);
    // SAFETY: everything that `info` points to lives until the end of this function.
    let raw = unsafe { device.raw.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None) }
        .map_err(|(_, e)| vk_error("vkCreateGraphicsPipelines", e))?
        .first()
        .copied()
        .ok_or(vk_error("vkCreateGraphicsPipelines", vk::Result::ERROR_UNKNOWN))?;
    // SAFETY: `Owned` calls this once, with the pipeline.
    Ok(Owned::new(device, raw, |device, pipeline| unsafe { device.destroy_pipeline(pipeline, None) }))
}
