//! Records builds of acceleration structures.

use ash::vk;

use super::{
    super::{
        accel::{BottomBuild, bottom_scratch},
        handles::{Accel, Buffer},
        pass::{Imported, Origin, Owner, Work},
        vocab::Resource,
    },
    bind::mismatch,
    pool::Memory,
    record::Recorder,
};
use crate::{
    Result,
    gpu::{BottomInput, OwnedAccel},
};

impl Recorder<'_> {
    /// The structures of a handle.
    pub fn owned_accel(&self, accel: Accel) -> Result<&OwnedAccel> {
        match self.graph.buffers.get(accel.index as usize).map(|b| &b.origin) {
            Some(Origin::Imported(Imported { owner: Owner::Accel(owned), .. })) => Ok(owned),
            _ => Err(mismatch("acceleration structure")),
        }
    }

    fn address(&self, buffer: Buffer) -> Result<vk::DeviceAddress> {
        let physical = self.plan.physical_of(Resource::Buffer(buffer.index));
        let address = match physical.and_then(|p| self.memory.get(p)) {
            Some(Memory::Buffer(owned)) => owned.address(),
            _ => None,
        };
        Ok(address.ok_or_else(|| mismatch(self.graph.short_buffer_name(buffer)))? + buffer.offset)
    }

    pub fn build_bottoms(&mut self, accel: Accel, builds: &[BottomBuild], scratch: Buffer) -> Result<()> {
        let owned = self.owned_accel(accel)?.clone();
        let layout = owned.layout();
        let mut scratch = self.address(scratch)?.next_multiple_of(layout.scratch_alignment);
        let mut inputs = Vec::with_capacity(builds.len());
        for build in builds {
            inputs.push(BottomInput {
                bottom: build.bottom,
                vertices: self.address(build.positions)? + 12 * u64::from(build.first_vertex),
                indices: self.address(build.indices)? + 4 * u64::from(build.first_index),
                refit: build.refit,
                scratch,
            });
            scratch += bottom_scratch(layout, build);
        }
        owned.record_bottoms(&mut self.commands, &inputs);
        Ok(())
    }

    pub fn build_top(&mut self, accel: Accel, instances: Buffer, count: u32, scratch: Buffer) -> Result<()> {
        let owned = self.owned_accel(accel)?.clone();
        let scratch = self.address(scratch)?.next_multiple_of(owned.layout().scratch_alignment);
        let instances = self.address(instances)?;
        owned.record_top(&mut self.commands, instances, count, scratch);
        Ok(())
    }
}

/// After the frame was waited for: what was built for the first time stays for the next graph.
pub(super) fn remember_built(graph: &super::Graph) {
    for pass in &graph.passes {
        if let Work::BuildTop { accel, .. } = &pass.work
            && let Some(entry) = graph.buffers.get(accel.index as usize)
            && let Origin::Imported(Imported { owner: Owner::Accel(owned), .. }) = &entry.origin
        {
            owned.set_built();
        }
    }
}
