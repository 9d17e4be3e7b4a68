//! Timestamp queries.

use std::fmt;

use ash::vk;

use super::{Commands, Gpu, queries::Queries};
use crate::Result;

/// A pool of timestamps. On queues without timestamps it does nothing and reads back `None`.
pub struct Timestamps(Queries);

impl fmt::Debug for Timestamps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Timestamps({})", self.0.count)
    }
}

impl Timestamps {
    /// Room for `count` timestamps.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn new(gpu: &Gpu, count: u32) -> Result<Self> {
        let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP);
        let info = gpu.caps().timestamp_period.map(|_| info);
        Ok(Self(Queries::new(gpu, count, info, "timestamps")?))
    }

    pub fn count(&self) -> u32 {
        self.0.count
    }

    /// Records the reset of all timestamps; before the first write of each submission.
    pub fn reset(&self, commands: &mut Commands) {
        self.0.reset(commands);
    }

    /// Records timestamp `index`, taken when everything before it has passed `stage`. Indices beyond the count do nothing.
    pub fn write(&self, commands: &mut Commands, index: u32, stage: vk::PipelineStageFlags2) {
        if let Some(pool) = self.0.with(index) {
            // SAFETY: in recording; the index is inside the pool.
            unsafe { self.0.context.device.cmd_write_timestamp2(commands.raw(), stage, pool, index) };
        }
    }

    /// Each timestamp in milliseconds after the first one written, `None` where none was written. Call after the submission
    /// was waited for.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub fn read(&self) -> Result<Vec<Option<f64>>> {
        let caps = &self.0.context.caps;
        // Ticks, and whether there are any.
        let (Some(period), Some(raw)) = (caps.timestamp_period, self.0.read::<2>(self.0.count)?) else {
            return Ok(vec![None; self.0.count as usize]);
        };
        let mask = caps.timestamp_mask;
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
