//! Device memory: one way in (with a second try and an error that says how much was asked of how much), one way out.

use ash::vk;
use gpu_allocator::{
    AllocationError, MemoryLocation,
    vulkan::{Allocation, AllocationCreateDesc, AllocationScheme},
};

use super::{
    device::{Context, lock},
    fault::{MEMORY_HELP, bytes},
};
use crate::{Error, ErrorKind, Result};

/// What the memory is for; a dedicated allocation must name it.
#[derive(Clone, Copy)]
pub(crate) enum Owner {
    Buffer(vk::Buffer),
    Image(vk::Image),
}

impl Context {
    /// Memory for `owner`, not yet bound.
    ///
    /// # Errors
    /// `OutOfMemory` with the size asked for and what is in use, after a second try with a block of exactly that size.
    pub fn allocate(
        &self,
        name: &str,
        owner: Owner,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
    ) -> Result<Allocation> {
        self.alive()?;
        let linear = matches!(owner, Owner::Buffer(_));
        let dedicated = match owner {
            Owner::Buffer(buffer) => AllocationScheme::DedicatedBuffer(buffer),
            Owner::Image(image) => AllocationScheme::DedicatedImage(image),
        };
        let mut allocator = lock(&self.allocator);
        let mut ask = |allocation_scheme| {
            allocator.allocate(&AllocationCreateDesc { name, requirements, location, linear, allocation_scheme })
        };
        // Blocks are shared and large: where one finds no room, exactly what is needed may.
        let result = ask(AllocationScheme::GpuAllocatorManaged).or_else(|first| match kind(&first) {
            ErrorKind::OutOfMemory => ask(dedicated),
            _ => Err(first),
        });
        let report = allocator.generate_report();
        drop(allocator);
        result.map_err(|cause| {
            let what = format!(
                "no memory for `{name}`: {} asked for, {} of {} in use on {}",
                bytes(requirements.size),
                bytes(report.total_allocated_bytes),
                bytes(self.heap_bytes),
                self.description.device,
            );
            if lost(&cause) {
                return self.lost.set(format!("the device was lost in vkAllocateMemory for `{name}`"));
            }
            let kind = kind(&cause);
            let error = Error::new(kind, what).caused_by(cause);
            if kind == ErrorKind::OutOfMemory { error.help(MEMORY_HELP) } else { error }
        })
    }

    /// Gives memory back.
    pub fn free(&self, allocation: Allocation) {
        // The only error is an allocation of another allocator, which cannot be: `allocation` came from `allocate`.
        let _ = lock(&self.allocator).free(allocation);
    }
}

/// gpu-allocator has one variant for "out of device memory" and puts every other result into text: in the spelling of
/// `Debug` where memory is allocated, of `Display` where it is mapped.
fn kind(error: &AllocationError) -> ErrorKind {
    const MEMORY: [vk::Result; 3] = [
        vk::Result::ERROR_OUT_OF_HOST_MEMORY,
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
        vk::Result::ERROR_MEMORY_MAP_FAILED,
    ];
    let memory = match error {
        AllocationError::OutOfMemory => true,
        AllocationError::Internal(text) | AllocationError::FailedToMap(text) => {
            MEMORY.iter().any(|result| says(text, *result))
        }
        _ => false,
    };
    if memory { ErrorKind::OutOfMemory } else { ErrorKind::Runtime }
}

fn says(text: &str, result: vk::Result) -> bool {
    text.contains(&format!("{result:?}")) || text.contains(&result.to_string())
}

fn lost(error: &AllocationError) -> bool {
    matches!(error, AllocationError::Internal(text) | AllocationError::FailedToMap(text) if says(text, vk::Result::ERROR_DEVICE_LOST))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn host_memory_hidden_in_text_is_found() {
        let hidden = format!("Unexpected error: {:?}", vk::Result::ERROR_OUT_OF_HOST_MEMORY);
        assert_eq!(kind(&AllocationError::Internal(hidden)), ErrorKind::OutOfMemory);
        let mapped = vk::Result::ERROR_OUT_OF_HOST_MEMORY.to_string();
        assert_eq!(kind(&AllocationError::FailedToMap(mapped)), ErrorKind::OutOfMemory);
        assert_eq!(kind(&AllocationError::OutOfMemory), ErrorKind::OutOfMemory);
        assert_eq!(kind(&AllocationError::NoCompatibleMemoryTypeFound), ErrorKind::Runtime);
        assert!(lost(&AllocationError::Internal(format!("{:?}", vk::Result::ERROR_DEVICE_LOST))));
    }
}
