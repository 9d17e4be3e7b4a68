//! A long graph in parts, each a submission of its own: a system that takes a device for stuck counts by submissions, and so does
//! [`Submission::wait`].

use std::{any::Any, collections::VecDeque, sync::Arc};

use crate::{
    Result,
    gpu::{Commands, Gpu, Submission},
};

/// Rays of a part, about: tenths of a second on a GPU, some seconds on a CPU driver.
const MOST: u64 = 1 << 26;
/// What a pass counts for that says less of itself. Each of so many passes in a part has a mark of its own for messages.
const LEAST: u64 = MOST / 1024;

/// Parts that the device is given before it has done the first: it is never idle.
const AHEAD: usize = 2;

/// The parts of one graph.
pub(super) struct Parts<'a> {
    gpu: &'a Gpu,
    name: &'a str,
    /// What all parts use.
    held: Arc<dyn Any + Send + Sync>,
    /// Rays of the part in recording.
    rays: u64,
    recorded: Vec<Commands>,
}

impl<'a> Parts<'a> {
    /// None yet. `held` lives until the last is done.
    pub fn new(gpu: &'a Gpu, name: &'a str, held: Arc<dyn Any + Send + Sync>) -> Self {
        Self { gpu, name, held, rays: 0, recorded: Vec::new() }
    }

    /// Begins recording a part.
    pub fn begin(&self) -> Result<Commands> {
        let mut commands = self.gpu.commands(self.name)?;
        commands.keep(Arc::clone(&self.held));
        Ok(commands)
    }

    /// Counts a pass of `rays` rays; true if it begins a new part.
    pub fn is_full(&mut self, rays: u64) -> bool {
        let rays = rays.max(LEAST);
        let full = self.rays > 0 && self.rays.saturating_add(rays) > MOST;
        self.rays = if full { rays } else { self.rays.saturating_add(rays) };
        full
    }

    /// Keeps a part until all are recorded: where recording fails the device has done nothing.
    pub fn push(&mut self, commands: Commands) {
        self.recorded.push(commands);
    }

    /// Hands all parts to the device and waits for them in their order, so that the time that one may take is its own. At most
    /// [`AHEAD`] are in flight, so that little is left to be done when it is asked to stop. Gives how many the device was given, and
    /// whether all are done.
    pub fn run(self) -> (usize, Result<()>) {
        let stop = self.gpu.stop();
        let mut running = VecDeque::with_capacity(AHEAD);
        let mut given = 0;
        for commands in self.recorded {
            let ready = match running.len() {
                AHEAD => running.pop_front().map_or(Ok(()), Submission::wait),
                _ => Ok(()),
            };
            // Those before are waited for where they are dropped.
            match ready.and_then(|()| stop.map_or(Ok(()), crate::Stop::check)).and_then(|()| commands.submit()) {
                Ok(submission) => running.push_back(submission),
                Err(error) => return (given, Err(error)),
            }
            given += 1;
        }
        (given, running.into_iter().try_for_each(Submission::wait))
    }
}
