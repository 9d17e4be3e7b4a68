//! Timestamp queries.

use std::{fmt, sync::Arc};

use ash::vk;

use super::{Commands, Gpu, device::Context};
use crate::Result;

/// A pool of timestamps. On queues without timestamps it does nothing and reads back `None`.
pub struct Timestamps {
    context: Arc<Context>,
    pool: vk::QueryPool,
    count: u32,
}

impl fmt::Debug for Timestamps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Timestamps({})", self.count)
    }
}

impl Drop for Timestamps {
    fn drop(&mut self) {
        if !self.context.abandoned() {
            // SAFETY: the owner waits for submissions that use it (or keeps it with them).
            unsafe { self.context.device.destroy_query_pool(self.pool, None) };
        }
    }
}

impl Timestamps {
    /// Room for `count` timestamps.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn new(gpu: &Gpu, count: u32) -> Result<Self> {
        let context = Arc::clone(&gpu.0);
        context.alive()?;
        let mut pool = vk::QueryPool::null();
        if context.caps.timestamp_period.is_some() && count > 0 {
            let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(count);
            // SAFETY: complete info, living device.
            pool = context.check(unsafe { context.device.create_query_pool(&info, None) }, || {
                format!("vkCreateQueryPool for {count} timestamps")
            })?;
        }
        Ok(Self { context, pool, count })
    }

    pub fn count(&self) -> u32 {
        self.count
    }

    /// Records the reset of all timestamps; before the first write of each submission.
    pub fn reset(&self, commands: &mut Commands) {
        if self.pool != vk::QueryPool::null() {
            // SAFETY: in recording, outside of rendering.
            unsafe { self.context.device.cmd_reset_query_pool(commands.raw(), self.pool, 0, self.count) };
        }
    }

    /// Records timestamp `index`, taken when everything before it has passed `stage`. Indices beyond the count do nothing.
    pub fn write(&self, commands: &mut Commands, index: u32, stage: vk::PipelineStageFlags2) {
        if self.pool != vk::QueryPool::null() && index < self.count {
            // SAFETY: in recording; the index is inside the pool.
            unsafe { self.context.device.cmd_write_timestamp2(commands.raw(), stage, self.pool, index) };
        }
    }

    /// Each timestamp in milliseconds after the first one written, `None` where none was written. Call after the submission
    /// was waited for.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub fn read(&self) -> Result<Vec<Option<f64>>> {
        let (Some(period), true) = (self.context.caps.timestamp_period, self.pool != vk::QueryPool::null()) else {
            return Ok(vec![None; self.count as usize]);
        };
        self.context.alive()?;
        let mut raw = vec![[0_u64; 2]; self.count as usize];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
        // SAFETY: the slice has two words for each query, as the flags ask for.
        let result = unsafe { self.context.device.get_query_pool_results(self.pool, 0, &mut raw, flags) };
        match result {
            Ok(()) | Err(vk::Result::NOT_READY) => {}
            Err(other) => self.context.check(Err(other), || "vkGetQueryPoolResults".into())?,
        }
        let mask = self.context.caps.timestamp_mask;
        let first = raw.iter().find(|[_, available]| *available != 0).map_or(0, |[ticks, _]| ticks & mask);
        Ok(raw
            .iter()
            .map(|[ticks, available]| {
                // Wraps like the counter does.
                (*available != 0).then(|| ((ticks & mask).wrapping_sub(first) & mask) as f64 * period * 1e-6)
            })
            .collect())
    }
}
