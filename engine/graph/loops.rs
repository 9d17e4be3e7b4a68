//! Some CPU drivers end loops early (Mesa lavapipe before 23: after 65,535 iterations over all loops of a group of invocations), without a
//! message. A pass that counts its iterations finds out.

use super::{Graph, Runner};
use crate::{
    Result,
    gpu::{DeviceKind, Gpu},
    shaders::gpu::loops,
};

/// More than the known limit, and still under a millisecond.
const ASKED: u32 = 70_000;

/// Number of iterations that all loops of one group of invocations may take together on this device; `None`: any number. Measured at the
/// first call. Only CPU drivers are asked: no GPU is known to have such a limit.
///
/// # Errors
/// `OutOfMemory`, `DeviceLost`.
pub fn loop_limit(gpu: &Gpu) -> Result<Option<u32>> {
    if gpu.caps().kind != DeviceKind::Cpu {
        return Ok(None);
    }
    if let Some(known) = gpu.known_loop_limit().get() {
        return Ok(*known);
    }
    let mut graph = Graph::new("gpu.loops");
    let turns = graph.buffer_from("gpu.loops", &[ASKED, 0]);
    graph.compute(loops::Args { turns }, 1);
    let read = graph.read_buffer(turns);
    let done = Runner::new(gpu).run(&graph)?.buffer::<u32>(read)[1];
    let limit = (done < ASKED).then_some(done);
    Ok(*gpu.known_loop_limit().get_or_init(|| limit))
}
