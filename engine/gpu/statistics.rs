//! Pipeline statistics queries: how often shaders were started.

use std::{fmt, sync::Arc};

use ash::vk;

use super::{Commands, Gpu, device::Context};
use crate::Result;

/// How often the shaders of a pass were started, as the driver counts. Whether lanes that only help a neighbour (helper
/// invocations) count, the driver decides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Started {
    pub fragments: u64,
    pub compute: u64,
}

/// A pool of queries. Where [`super::Caps::pipeline_statistics`] is off it does nothing and reads back `None`.
pub struct Statistics {
    context: Arc<Context>,
    pool: vk::QueryPool,
    count: u32,
}

impl fmt::Debug for Statistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Statistics({})", self.count)
    }
}

impl Drop for Statistics {
    fn drop(&mut self) {
        if !self.context.abandoned() {
            // SAFETY: the owner waits for submissions that use it (or keeps it with them).
            unsafe { self.context.device.destroy_query_pool(self.pool, None) };
        }
    }
}

impl Statistics {
    /// Room for `count` passes.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn new(gpu: &Gpu, count: u32) -> Result<Self> {
        let context = Arc::clone(&gpu.0);
        context.alive()?;
        let mut pool = vk::QueryPool::null();
        if context.caps.pipeline_statistics && count > 0 {
            let what = vk::QueryPipelineStatisticFlags::FRAGMENT_SHADER_INVOCATIONS
                | vk::QueryPipelineStatisticFlags::COMPUTE_SHADER_INVOCATIONS;
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::PIPELINE_STATISTICS)
                .query_count(count)
                .pipeline_statistics(what);
            // SAFETY: complete info, living device with the feature on.
            pool = context.check(unsafe { context.device.create_query_pool(&info, None) }, || {
                format!("vkCreateQueryPool for the statistics of {count} passes")
            })?;
        }
        Ok(Self { context, pool, count })
    }

    pub fn count(&self) -> u32 {
        self.count
    }

    /// Records the reset of all queries; before the first of each submission, outside of rendering.
    pub fn reset(&self, commands: &mut Commands) {
        if self.pool != vk::QueryPool::null() {
            // SAFETY: in recording, outside of rendering.
            unsafe { self.context.device.cmd_reset_query_pool(commands.raw(), self.pool, 0, self.count) };
        }
    }

    /// Starts counting into query `index`; indices beyond the count do nothing. One at a time, outside of rendering.
    pub fn begin(&self, commands: &mut Commands, index: u32) {
        if self.pool != vk::QueryPool::null() && index < self.count {
            // SAFETY: in recording; the query was reset, and the owner has no other open.
            unsafe {
                let flags = vk::QueryControlFlags::empty();
                self.context.device.cmd_begin_query(commands.raw(), self.pool, index, flags);
            }
        }
    }

    /// Stops counting into query `index`.
    pub fn end(&self, commands: &mut Commands, index: u32) {
        if self.pool != vk::QueryPool::null() && index < self.count {
            // SAFETY: in recording; pairs with `begin`.
            unsafe { self.context.device.cmd_end_query(commands.raw(), self.pool, index) };
        }
    }

    /// The first `count` results, `None` where nothing was counted. Call after the submission was waited for.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub fn read(&self, count: u32) -> Result<Vec<Option<Started>>> {
        let count = count.min(self.count);
        if self.pool == vk::QueryPool::null() || count == 0 {
            return Ok(vec![None; count as usize]);
        }
        self.context.alive()?;
        // In the order of the flags' bits: fragments, compute; then availability.
        let mut raw = vec![[0_u64; 3]; count as usize];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
        // SAFETY: the slice has three words for each query, as the flags ask for.
        let result = unsafe { self.context.device.get_query_pool_results(self.pool, 0, &mut raw, flags) };
        match result {
            Ok(()) | Err(vk::Result::NOT_READY) => {}
            Err(other) => self.context.check(Err(other), || "vkGetQueryPoolResults".into())?,
        }
        Ok(raw
            .iter()
            .map(|&[fragments, compute, ready]| (ready != 0).then_some(Started { fragments, compute }))
            .collect())
    }
}
