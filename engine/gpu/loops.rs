//! Some CPU drivers end loops early (Mesa lavapipe before 23: after 65 535 turns over all loops of a group of invocations),
//! without a message. Asked once, so that work can be cut accordingly.

use ash::vk;

use super::{BufferDesc, DescriptorArena, DeviceKind, Gpu, OwnedBuffer};
use crate::{
    Result,
    shader::{Access, Binding, BindingKind, Shader, Stage, StageCode, Texel},
};

/// More than the known limit, and still under a millisecond.
const ASKED: u32 = 70_000;

/// `shaders-glsl/gpu/loops.comp`. Its generated module names handles of the graph, which is built upon this module.
static SHADER: Shader = Shader {
    name: "gpu.loops",
    stages: &[StageCode {
        stage: Stage::Compute,
        file: "gpu.loops.comp.spv",
        spirv: include_bytes!(concat!(env!("OUT_DIR"), "/gpu.loops.comp.spv")),
    }],
    bindings: &[Binding {
        name: "turns",
        binding: 0,
        kind: BindingKind::Buffer,
        access: Access::ReadWrite,
        stages: &[Stage::Compute],
        count: 1,
        texel: Texel::None,
        format: 0,
    }],
    push_size: 0,
    workgroup: [1, 1, 1],
    spec: &[],
    color_outputs: 0,
    ray_query: false,
    query: None,
};

impl Gpu {
    /// Turns that all loops of one group of invocations may make together on this device; `None`: as many as they like.
    /// Measured at the first call. Only CPU drivers are asked: no GPU is known to have such a limit.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn loop_limit(&self) -> Result<Option<u32>> {
        if self.caps().kind != DeviceKind::Cpu {
            return Ok(None);
        }
        if let Some(known) = self.0.loop_limit.get() {
            return Ok(*known);
        }
        let done = self.count_turns()?;
        let limit = (done < ASKED).then_some(done);
        Ok(*self.0.loop_limit.get_or_init(|| limit))
    }

    fn count_turns(&self) -> Result<u32> {
        let turns = OwnedBuffer::with_contents(self, "gpu.loops", bytemuck::bytes_of(&[ASKED, 0]))?;
        let back = OwnedBuffer::new(self, "gpu.loops (readback)", BufferDesc::readback(8))?;
        let pipeline = self.compute_pipeline(&SHADER, &[])?;
        let mut arena = DescriptorArena::new(self);
        let set = arena.allocate(SHADER.name, pipeline.set_layout)?;
        let info = [vk::DescriptorBufferInfo::default().buffer(turns.raw()).range(vk::WHOLE_SIZE)];
        let write = vk::WriteDescriptorSet::default()
            .dst_set(set)
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .buffer_info(&info);
        let mut commands = self.commands(SHADER.name)?;
        commands.begin_pass(SHADER.name);
        // SAFETY: in recording; everything bound is kept until it is done.
        unsafe {
            let device = self.device();
            let raw = commands.raw();
            device.update_descriptor_sets(&[write], &[]);
            device.cmd_bind_pipeline(raw, pipeline.bind_point, pipeline.raw);
            device.cmd_bind_descriptor_sets(raw, pipeline.bind_point, pipeline.layout, 0, &[set], &[]);
            device.cmd_dispatch(raw, 1, 1, 1);
        }
        commands.everything_barrier();
        let region = vk::BufferCopy::default().size(8);
        // SAFETY: as above.
        unsafe { self.device().cmd_copy_buffer(commands.raw(), turns.raw(), back.raw(), &[region]) };
        commands.everything_barrier();
        commands.end_pass();
        commands.keep((turns, back.clone(), arena));
        commands.submit()?.wait()?;
        let bytes = back.mapped_bytes(4, 4)?;
        Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }
}
