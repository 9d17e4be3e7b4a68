//! Descriptor sets that live as long as a frame.

use std::{fmt, sync::Arc};

use ash::vk;

use super::{Gpu, device::Context};
use crate::Result;

/// Allocates descriptor sets from pools that grow; all are given back together.
pub struct DescriptorArena {
    context: Arc<Context>,
    pools: Vec<vk::DescriptorPool>,
    /// The pool in use; those before it are full.
    current: usize,
}

impl fmt::Debug for DescriptorArena {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "DescriptorArena({} pools)", self.pools.len())
    }
}

impl Drop for DescriptorArena {
    fn drop(&mut self) {
        if !self.context.abandoned() {
            for pool in &self.pools {
                // SAFETY: the owner keeps the arena until the submissions that use its sets are done.
                unsafe { self.context.device.destroy_descriptor_pool(*pool, None) };
            }
        }
    }
}

const SETS: u32 = 128;

impl DescriptorArena {
    /// An empty arena; pools are made when needed.
    pub fn new(gpu: &Gpu) -> Self {
        Self { context: Arc::clone(&gpu.0), pools: Vec::new(), current: 0 }
    }

    /// A set of `layout` with undefined contents.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; the message has `name`, the pass.
    pub fn allocate(&mut self, name: &str, layout: vk::DescriptorSetLayout) -> Result<vk::DescriptorSet> {
        self.context.alive()?;
        let layouts = [layout];
        let mut fresh = false;
        loop {
            if self.current == self.pools.len() {
                let pool = self.new_pool(name)?;
                self.pools.push(pool);
                fresh = true;
            }
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(self.pools[self.current])
                .set_layouts(&layouts);
            // SAFETY: pool and layout are alive.
            match unsafe { self.context.device.allocate_descriptor_sets(&info) } {
                Ok(sets) => return Ok(sets[0]),
                Err(vk::Result::ERROR_OUT_OF_POOL_MEMORY | vk::Result::ERROR_FRAGMENTED_POOL) if !fresh => {
                    self.current += 1;
                }
                Err(result) => {
                    return self.context.check(Err(result), || format!("vkAllocateDescriptorSets for `{name}`"));
                }
            }
        }
    }

    /// Takes all sets back. Nothing submitted may still use them.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub fn reset(&mut self) -> Result<()> {
        self.context.alive()?;
        for pool in &self.pools {
            // SAFETY: no set is in use, which the caller promises.
            let reset =
                unsafe { self.context.device.reset_descriptor_pool(*pool, vk::DescriptorPoolResetFlags::empty()) };
            self.context.check(reset, || "vkResetDescriptorPool".into())?;
        }
        self.current = 0;
        Ok(())
    }

    fn new_pool(&self, name: &str) -> Result<vk::DescriptorPool> {
        let size = |ty, each: u32| vk::DescriptorPoolSize { ty, descriptor_count: SETS * each };
        let mut sizes = vec![
            size(vk::DescriptorType::COMBINED_IMAGE_SAMPLER, 16),
            size(vk::DescriptorType::STORAGE_IMAGE, 4),
            size(vk::DescriptorType::STORAGE_BUFFER, 12),
            size(vk::DescriptorType::UNIFORM_BUFFER, 4),
        ];
        if self.context.caps.ray_query {
            sizes.push(size(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR, 1));
        }
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(SETS).pool_sizes(&sizes);
        // SAFETY: complete info, living device.
        self.context.check(unsafe { self.context.device.create_descriptor_pool(&info, None) }, || {
            format!("vkCreateDescriptorPool for `{name}`")
        })
    }
}
