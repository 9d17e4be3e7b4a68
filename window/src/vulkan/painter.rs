//! Records egui's triangles and the uploads of its textures.

use super::device::{Buffer, Device};
use super::frame::Frame;
use super::pipeline::{PUSH_SIZE, Pipeline};
use super::texture::Texture;
use crate::error::Error;
use crate::textures::{Textures, Upload};
use ash::vk;
use egui::epaint::{Primitive, Vertex};
use egui::{ClippedPrimitive, Mesh, TextureId};
use std::collections::HashMap;
use std::rc::Rc;

/// Paints what egui gives out.
pub struct Painter {
    pipeline: Pipeline,
    textures: HashMap<TextureId, Texture>,
    device: Rc<Device>,
}

impl Painter {
    pub fn new(device: &Rc<Device>, target: vk::Format) -> Result<Self, Error> {
        Ok(Self { pipeline: Pipeline::new(device, target)?, textures: HashMap::new(), device: device.clone() })
    }

    /// Records the uploads of all textures that have changed. Call it outside of rendering.
    pub fn upload(&mut self, frame: &mut Frame, textures: &mut Textures) -> Result<(), Error> {
        // A texture that egui has freed was last used by an earlier frame. This frame finishes after that one.
        let gone = self.textures.extract_if(|id, _| textures.get(*id).is_none());
        frame.garbage.extend(gone.map(|(_, texture)| texture));
        let uploads = textures.take_uploads();
        let total: usize = uploads.iter().map(|u| u.size[0] * u.size[1] * size_of::<egui::Color32>()).sum();
        if total > 0 {
            Buffer::reserve(&mut frame.staging, &self.device, total, vk::BufferUsageFlags::TRANSFER_SRC)?;
        }
        let mut offset = 0;
        for upload in &uploads {
            offset = self.upload_one(frame, textures, upload, offset)?;
        }
        Ok(())
    }

    fn upload_one(
        &mut self,
        frame: &mut Frame,
        textures: &Textures,
        upload: &Upload,
        offset: usize,
    ) -> Result<usize, Error> {
        let Some((source, options)) = textures.get(upload.id) else { return Ok(offset) };
        let most = self.device.max_texture_side as usize;
        if source.size.iter().any(|side| *side == 0 || *side > most) || upload.size.contains(&0) {
            log::error!("A texture of {:?} pixels is not drawn: a side has 1 to {most} pixels.", source.size);
            frame.garbage.extend(self.textures.remove(&upload.id));
            return Ok(offset);
        }
        let fits = |t: &Texture| t.size == source.size && t.options == options;
        if !self.textures.get(&upload.id).is_some_and(fits) {
            let texture = Texture::new(&self.device, self.pipeline.set_layout.raw, source.size, options)?;
            frame.garbage.extend(self.textures.insert(upload.id, texture));
        }
        let (Some(texture), Some(staging)) = (self.textures.get(&upload.id), &mut frame.staging) else {
            return Ok(offset);
        };
        let [x, y] = upload.position;
        let mut end = offset;
        for row in source.pixels.chunks_exact(source.size[0]).skip(y).take(upload.size[1]) {
            end = staging.write(end, row.get(x..x + upload.size[0]).unwrap_or_default());
        }
        let staging = staging.raw.raw;
        let image = texture.image.raw;
        // Earlier frames may still read the texture. A whole upload needs no old contents.
        let old = if upload.size == source.size {
            vk::ImageLayout::UNDEFINED
        } else {
            vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL
        };
        let writable = vk::ImageMemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::FRAGMENT_SHADER | vk::PipelineStageFlags2::COPY)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::COPY)
            .dst_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .old_layout(old)
            .new_layout(vk::ImageLayout::TRANSFER_DST_OPTIMAL);
        frame.barrier(image, writable);
        let region = vk::BufferImageCopy::default()
            .buffer_offset(offset as u64)
            .image_subresource(vk::ImageSubresourceLayers {
                aspect_mask: vk::ImageAspectFlags::COLOR,
                mip_level: 0,
                base_array_layer: 0,
                layer_count: 1,
            })
            .image_offset(vk::Offset3D { x: x as i32, y: y as i32, z: 0 })
            .image_extent(vk::Extent3D { width: upload.size[0] as u32, height: upload.size[1] as u32, depth: 1 });
        // SAFETY: the commands are being recorded, outside of rendering. `Textures` keeps regions inside their image,
        // and `upload` has made room for all of them in the staging buffer.
        unsafe {
            self.device.raw.cmd_copy_buffer_to_image(
                frame.commands,
                staging,
                image,
                vk::ImageLayout::TRANSFER_DST_OPTIMAL,
                &[region],
            );
        }
        let readable = vk::ImageMemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COPY)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::FRAGMENT_SHADER)
            .dst_access_mask(vk::AccessFlags2::SHADER_SAMPLED_READ)
            .old_layout(vk::ImageLayout::TRANSFER_DST_OPTIMAL)
            .new_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
        frame.barrier(image, readable);
        Ok(end)
    }

    /// Copies the triangles to the device. Call it before [`draw`](Self::draw), outside of rendering.
    pub fn stage(&self, frame: &mut Frame, primitives: &[ClippedPrimitive]) -> Result<usize, Error> {
        let vertices: usize = meshes(primitives).map(|(_, mesh)| size_of_val(mesh.vertices.as_slice())).sum();
        let indices: usize = meshes(primitives).map(|(_, mesh)| size_of_val(mesh.indices.as_slice())).sum();
        let usage = vk::BufferUsageFlags::VERTEX_BUFFER | vk::BufferUsageFlags::INDEX_BUFFER;
        if vertices + indices > 0 {
            Buffer::reserve(&mut frame.mesh, &self.device, vertices + indices, usage)?;
        }
        if let Some(buffer) = &mut frame.mesh {
            let offset = meshes(primitives).fold(0, |offset, (_, mesh)| buffer.write(offset, &mesh.vertices));
            meshes(primitives).fold(offset, |offset, (_, mesh)| buffer.write(offset, &mesh.indices));
        }
        Ok(vertices)
    }

    /// Records the triangles. `vertices` is what [`stage`](Self::stage) has returned. Call it during rendering.
    pub fn draw(
        &self,
        frame: &Frame,
        primitives: &[ClippedPrimitive],
        vertices: usize,
        extent: vk::Extent2D,
        pixels_per_point: f32,
    ) {
        let Some(mesh_buffer) = &frame.mesh else { return };
        let raw = &self.device.raw;
        let (width, height) = (extent.width as f32, extent.height as f32);
        let mut push = [0; PUSH_SIZE as usize];
        push[..4].copy_from_slice(&(2.0 * pixels_per_point / width).to_ne_bytes());
        push[4..].copy_from_slice(&(2.0 * pixels_per_point / height).to_ne_bytes());
        let viewport = vk::Viewport { width, height, max_depth: 1.0, ..Default::default() };
        // SAFETY: the commands are being recorded, during rendering; the objects live until the frame has finished.
        unsafe {
            raw.cmd_bind_pipeline(frame.commands, vk::PipelineBindPoint::GRAPHICS, self.pipeline.raw.raw);
            raw.cmd_set_viewport(frame.commands, 0, &[viewport]);
            let layout = self.pipeline.layout.raw;
            raw.cmd_push_constants(frame.commands, layout, vk::ShaderStageFlags::VERTEX, 0, &push);
            raw.cmd_bind_vertex_buffers(frame.commands, 0, &[mesh_buffer.raw.raw], &[0]);
            let offset = vertices as u64;
            raw.cmd_bind_index_buffer(frame.commands, mesh_buffer.raw.raw, offset, vk::IndexType::UINT32);
        }
        let (mut first_vertex, mut first_index) = (0, 0);
        for (clip, mesh) in meshes(primitives) {
            let scissor = scissor(clip, pixels_per_point, extent);
            let texture = self.textures.get(&mesh.texture_id);
            if let (Some(scissor), Some(texture)) = (scissor, texture) {
                let count = mesh.indices.len() as u32;
                let layout = self.pipeline.layout.raw;
                // SAFETY: as above. The buffer holds these vertices and indices, and the scissor is inside the extent.
                unsafe {
                    raw.cmd_set_scissor(frame.commands, 0, &[scissor]);
                    let graphics = vk::PipelineBindPoint::GRAPHICS;
                    raw.cmd_bind_descriptor_sets(frame.commands, graphics, layout, 0, &[texture.set], &[]);
                    raw.cmd_draw_indexed(frame.commands, count, 1, first_index, first_vertex, 0);
                }
            }
            first_vertex += mesh.vertices.len() as i32;
            first_index += mesh.indices.len() as u32;
        }
    }
}

// The buffer takes the vertices as they lie in memory: no byte of them may be padding.
const _: () = assert!(size_of::<Vertex>() == 20);

fn meshes(primitives: &[ClippedPrimitive]) -> impl Iterator<Item = (egui::Rect, &Mesh)> {
    primitives.iter().filter_map(|p| match &p.primitive {
        Primitive::Mesh(mesh) => Some((p.clip_rect, mesh)),
        Primitive::Callback(_) => None,
    })
}

/// The pixels that a mesh may touch, or none.
fn scissor(clip: egui::Rect, pixels_per_point: f32, extent: vk::Extent2D) -> Option<vk::Rect2D> {
    // A conversion from a number that does not fit takes the nearest one that does.
    let pixel = |points: f32, most: u32| ((points * pixels_per_point).round() as u32).min(most);
    let (left, right) = (pixel(clip.min.x, extent.width), pixel(clip.max.x, extent.width));
    let (top, bottom) = (pixel(clip.min.y, extent.height), pixel(clip.max.y, extent.height));
    (left < right && top < bottom).then_some(vk::Rect2D {
        offset: vk::Offset2D { x: left as i32, y: top as i32 },
        extent: vk::Extent2D { width: right - left, height: bottom - top },
    })
}
