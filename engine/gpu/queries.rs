//! Pools of queries: what timestamps and statistics have in common.

use std::sync::Arc;

use ash::vk;

use super::{Commands, Gpu, device::Context};
use crate::Result;

/// A pool, or none where the device cannot answer such queries: then nothing is recorded, and nothing read.
pub struct Queries {
    pub context: Arc<Context>,
    pool: vk::QueryPool,
    pub count: u32,
}

impl Drop for Queries {
    fn drop(&mut self) {
        if !self.context.abandoned() {
            // SAFETY: the owner waits for submissions that use it (or keeps it with them). A null handle is allowed.
            unsafe { self.context.device.destroy_query_pool(self.pool, None) };
        }
    }
}

impl Queries {
    /// Room for `count` queries; `info` is `None` where the device lacks them. `what`: for errors.
    pub fn new(gpu: &Gpu, count: u32, info: Option<vk::QueryPoolCreateInfo<'_>>, what: &str) -> Result<Self> {
        let context = Arc::clone(&gpu.0);
        context.alive()?;
        let pool = match info.filter(|_| count > 0) {
            // SAFETY: complete info, living device with the feature on.
            Some(info) => context
                .check(unsafe { context.device.create_query_pool(&info.query_count(count), None) }, || {
                    format!("vkCreateQueryPool for {count} {what}")
                })?,
            None => vk::QueryPool::null(),
        };
        Ok(Self { context, pool, count })
    }

    /// The pool, if there is one and `index` is in it.
    pub fn with(&self, index: u32) -> Option<vk::QueryPool> {
        (self.pool != vk::QueryPool::null() && index < self.count).then_some(self.pool)
    }

    /// Records the reset of all queries; before the first of each submission, outside of rendering.
    pub fn reset(&self, commands: &mut Commands) {
        if let Some(pool) = self.with(0) {
            // SAFETY: in recording, outside of rendering.
            unsafe { self.context.device.cmd_reset_query_pool(commands.raw(), pool, 0, self.count) };
        }
    }

    /// The first `count` results of N words each, the last of which is not 0 where there is a result; `None` without a pool.
    pub fn read<const N: usize>(&self, count: u32) -> Result<Option<Vec<[u64; N]>>> {
        let count = count.min(self.count);
        let Some(pool) = self.with(0).filter(|_| count > 0) else { return Ok(None) };
        self.context.alive()?;
        let mut raw = vec![[0_u64; N]; count as usize];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
        // SAFETY: the slice has as many words for each query as its kind and the flags ask for, which the owner promises.
        let result = unsafe { self.context.device.get_query_pool_results(pool, 0, &mut raw, flags) };
        match result {
            Ok(()) | Err(vk::Result::NOT_READY) => Ok(Some(raw)),
            Err(other) => self.context.check(Err(other), || "vkGetQueryPoolResults".into()),
        }
    }
}
