//! A long graph in parts, each a submission of its own: a system that takes a device for stuck counts by submissions, and so does
//! [`Submission::wait`].

use std::{any::Any, sync::Arc};

use crate::{
    Result,
    gpu::{Commands, Gpu, Submission},
};

/// Rays of a part, about: tenths of a second on a GPU, some seconds on a CPU driver.
const MOST: u64 = 1 << 26;
/// What a pass counts for that says less of itself. Each of so many passes in a part has a mark of its own for messages.
const LEAST: u64 = MOST / 1024;

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

    /// Hands all parts to the device and waits for them in their order, so that the time that one may take is its own. Gives how many
    /// the device was given, and whether all are done.
    pub fn run(self) -> (usize, Result<()>) {
        let mut running = Vec::with_capacity(self.recorded.len());
        for commands in self.recorded {
            match commands.submit() {
                Ok(submission) => running.push(submission),
                // Those before are waited for where they are dropped.
                Err(error) => return (running.len(), Err(error)),
            }
        }
        (running.len(), running.into_iter().try_for_each(Submission::wait))
    }
}
