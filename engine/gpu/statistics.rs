//! Pipeline statistics queries: how often shaders were started.

use std::fmt;

use ash::vk;

use super::{Commands, Gpu, queries::Queries};
use crate::Result;

/// How often the shaders of a pass were started, as the driver counts. Whether lanes that only help a neighbour (helper
/// invocations) count, the driver decides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Started {
    pub fragments: u64,
    pub compute: u64,
}

/// A pool of queries. Where [`super::Caps::pipeline_statistics`] is off it does nothing and reads back `None`.
pub struct Statistics(Queries);

impl fmt::Debug for Statistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Statistics({})", self.0.count)
    }
}

impl Statistics {
    /// Room for `count` passes.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn new(gpu: &Gpu, count: u32) -> Result<Self> {
        let what = vk::QueryPipelineStatisticFlags::FRAGMENT_SHADER_INVOCATIONS
            | vk::QueryPipelineStatisticFlags::COMPUTE_SHADER_INVOCATIONS;
        let info =
            vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::PIPELINE_STATISTICS).pipeline_statistics(what);
        let info = gpu.caps().pipeline_statistics.then_some(info);
        Ok(Self(Queries::new(gpu, count, info, "statistics of passes")?))
    }

    pub fn count(&self) -> u32 {
        self.0.count
    }

    /// Records the reset of all queries; before the first of each submission, outside of rendering.
    pub fn reset(&self, commands: &mut Commands) {
        self.0.reset(commands);
    }

    /// Starts counting into query `index`; indices beyond the count do nothing. One at a time, outside of rendering.
    pub fn begin(&self, commands: &mut Commands, index: u32) {
        if let Some(pool) = self.0.with(index) {
            let flags = vk::QueryControlFlags::empty();
            // SAFETY: in recording; the query was reset, and the owner has no other open.
            unsafe { self.0.context.device.cmd_begin_query(commands.raw(), pool, index, flags) };
        }
    }

    /// Stops counting into query `index`.
    pub fn end(&self, commands: &mut Commands, index: u32) {
        if let Some(pool) = self.0.with(index) {
            // SAFETY: in recording; pairs with `begin`.
            unsafe { self.0.context.device.cmd_end_query(commands.raw(), pool, index) };
        }
    }

    /// The first `count` results, `None` where nothing was counted. Call after the submission was waited for.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub fn read(&self, count: u32) -> Result<Vec<Option<Started>>> {
        // In the order of the flags' bits: fragments, compute; then availability.
        let Some(raw) = self.0.read::<3>(count)? else { return Ok(vec![None; count.min(self.0.count) as usize]) };
        let started = |[fragments, compute, ready]: [u64; 3]| (ready != 0).then_some(Started { fragments, compute });
        Ok(raw.into_iter().map(started).collect())
    }
}
