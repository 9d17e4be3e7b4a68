//! Records passes: one command, or as many dispatches as a loop over items needs, in one part or in several.

use super::{
    super::{
        over::{Limits, Over},
        pass::{Bound, Groups, Pass, Work},
    },
    labels,
    record::Recorder,
};
use crate::{
    Error, Result,
    gpu::{DeviceKind, Gpu, Statistics},
    graph::Graph,
};

/// Approximate maximum of rays per dispatch on a CPU driver, which takes about a second for them.
const MOST_RAYS: u64 = 1 << 22;
/// The same on a GPU, which takes tens of milliseconds for them.
const MOST_RAYS_GPU: u64 = 1 << 25;
/// Maximum of loop iterations per invocation on drivers that end long loops, which do so after 65,535. Two of the longest rays fit.
const TURNS_LIMITED: u64 = 62_000;

/// The limits of a dispatch on this device. `asked`: [`Runner::dispatch_rays`](super::Runner::dispatch_rays).
///
/// # Errors
/// As [`Gpu::loop_limit`].
pub(super) fn limits(gpu: &Gpu, graph: &Graph, asked: Option<u64>) -> Result<Limits> {
    let most = if gpu.caps().kind == DeviceKind::Cpu { MOST_RAYS } else { MOST_RAYS_GPU };
    let rays = asked.unwrap_or(most);
    let long = graph.passes.iter().any(|pass| matches!(pass.work, Work::Compute { over: Some(_), .. }));
    let limited = long && gpu.loop_limit()?.is_some();
    Ok(Limits { rays, turns: limited.then_some(TURNS_LIMITED) })
}

/// Rays of all passes of a graph.
pub(super) fn rays(graph: &Graph, limits: Limits) -> u64 {
    let of = |pass: &Pass| match &pass.work {
        Work::Compute { over: Some(over), .. } => over.pieces(limits).map(|piece| piece.rays).sum(),
        _ => pass.rays,
    };
    graph.passes.iter().map(of).fold(0, u64::saturating_add)
}

impl<'a> Recorder<'a> {
    /// Records pass `index`, and gives the part before it to the device if that is long enough. Returns the number of launches.
    pub fn pass(&mut self, index: usize, pass: &'a Pass, query: Option<(&Statistics, u32)>) -> Result<usize> {
        let over = match &pass.work {
            Work::Compute { over, .. } => *over,
            _ => None,
        };
        // A query begins and ends in one submission.
        let rays = match over.and_then(|over| over.pieces(self.limits).next()) {
            Some(piece) if query.is_none() => piece.rays,
            _ => pass.rays,
        };
        if self.parts.is_full(rays) {
            self.next_part(rays)?;
        }
        self.open = labels(&mut self.commands, self.open, &pass.scope);
        self.barriers(self.plan.barriers_before(index));
        self.commands.begin_pass(&pass.name);
        if let Some((statistics, query)) = query {
            statistics.begin(&mut self.commands, query);
        }
        // After an error the commands are thrown away.
        let launches = match (&pass.work, over) {
            (Work::Compute { bound, groups, .. }, Some(over)) => {
                self.dispatches(index, pass, (bound, groups), over, query.is_none())?
            }
            (work, _) => self.work(index, work).map(|()| work.launches()).map_err(|error| error.at(&pass.name))?,
        };
        if let Some((statistics, query)) = query {
            statistics.end(&mut self.commands, query);
        }
        self.commands.end_pass();
        Ok(launches)
    }

    /// Records the dispatches of a pass that loops over items. `cut`: they may be in several parts.
    fn dispatches(
        &mut self,
        index: usize,
        pass: &'a Pass,
        (bound, groups): (&Bound, &Groups),
        over: Over,
        cut: bool,
    ) -> Result<usize> {
        let named = |error: Error| error.at(&pass.name);
        let mut pipeline = self.prepare(index, bound).map_err(named)?;
        let mut push = bound.push.clone();
        let mut launches = 0;
        for piece in over.pieces(self.limits) {
            if launches > 0 {
                if cut && self.parts.is_full(piece.rays) {
                    self.commands.end_pass();
                    self.next_part(piece.rays)?;
                    self.open = labels(&mut self.commands, self.open, &pass.scope);
                    self.commands.begin_pass(&pass.name);
                    pipeline = self.prepare(index, bound).map_err(named)?;
                }
                self.between_dispatches();
            }
            over.set(&mut push, piece);
            self.push_bytes(&push, &pipeline);
            self.dispatch(groups).map_err(named)?;
            launches += 1;
        }
        Ok(launches)
    }

    /// Gives the part in recording to the device and begins the next, whose first command has `rays` rays.
    fn next_part(&mut self, rays: u64) -> Result<()> {
        self.open = labels(&mut self.commands, self.open, &[]);
        let next = self.parts.begin()?;
        let full = std::mem::replace(&mut self.commands, next);
        self.parts.submit(full, rays)
    }

    /// Records the end of a graph of `passes` passes.
    pub fn end(&mut self, passes: usize) {
        self.open = labels(&mut self.commands, self.open, &[]);
        self.barriers(self.plan.barriers_before(passes));
    }
}
