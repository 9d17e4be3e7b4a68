//! A long graph in parts, each a submission of its own: an operating system resets a GPU that works for seconds on one submission, and
//! [`Submission::wait`] gives up a submission that does not end. Measured times of parts decide the length of those that follow.

use std::{
    any::Any,
    collections::VecDeque,
    sync::Arc,
    time::{Duration, Instant},
};

use crate::{
    Result,
    gpu::{Commands, Gpu, Submission},
};

/// Passes of a part. Each has a mark of its own for messages.
const MOST_PASSES: u32 = 1024;
/// Parts that the device has at one time: it is never idle, and only these are left to be done when it is asked to stop.
const AHEAD: usize = 2;
/// The time that a part should take.
const AIM: Duration = Duration::from_millis(200);
/// A part has at most this many times the rays of a part whose time is known.
const GROWTH: u64 = 2;
/// Rays of the first part: milliseconds on a GPU, about a second on a CPU driver.
const START: u64 = 1 << 22;
/// Fewest rays of a part that is cut: each submission costs time.
const LEAST: u64 = 1 << 18;
/// Most rays of a part. Passes may trace far fewer rays than they state, for example where most pixels show the sky, and then say little about
/// the time of the passes that follow.
const MOST: u64 = 1 << 27;

/// The number of rays per part, for all graphs of a runner.
#[derive(Debug)]
pub(super) struct Pace {
    rays: u64,
}

impl Default for Pace {
    fn default() -> Self {
        Self { rays: START }
    }
}

impl Pace {
    #[cfg(test)]
    pub fn of(rays: u64) -> Self {
        Self { rays }
    }

    /// Takes account of a part of `rays` rays that ran for `time`. A part that ended with its graph has fewer rays than allowed, and shows only
    /// that a part may be too long. The time of a part with very few rays is that of other work. `late`: the part had ended before the host
    /// looked, so `time` is too long and shows only that a part may be longer.
    fn took(&mut self, rays: u64, time: Duration, late: bool) {
        if rays < self.rays / 16 {
            return;
        }
        let ideal = u128::from(rays) * AIM.as_nanos() / time.as_nanos().max(1);
        let ideal = u64::try_from(ideal).unwrap_or(u64::MAX);
        let (full, shorter) = (rays >= self.rays / 2, ideal < self.rays);
        let counts = if shorter { !late } else { full };
        if counts {
            self.rays = ideal.min(self.rays.saturating_mul(GROWTH)).clamp(LEAST, MOST);
        }
    }
}

/// A part that the device has.
struct Running {
    submission: Submission,
    submitted: Instant,
    rays: u64,
}

/// Who is told how much of a graph is done.
pub(super) struct Progress<'a> {
    done: u64,
    all: u64,
    told: &'a mut dyn FnMut(f64),
}

impl<'a> Progress<'a> {
    /// `all`: rays of the graph.
    pub fn new(all: u64, told: &'a mut dyn FnMut(f64)) -> Self {
        Self { done: 0, all, told }
    }

    fn ended(&mut self, rays: u64) {
        self.done = self.done.saturating_add(rays).min(self.all);
        if self.all > 0 {
            (self.told)(self.done as f64 / self.all as f64);
        }
    }
}

/// The parts of one graph.
pub(super) struct Parts<'a> {
    gpu: &'a Gpu,
    name: &'a str,
    /// The resources of all parts.
    held: Arc<dyn Any + Send + Sync>,
    pace: &'a mut Pace,
    told: Progress<'a>,
    /// Rays and passes of the part in recording.
    rays: u64,
    passes: u32,
    running: VecDeque<Running>,
    /// Number of parts that the device was given.
    given: usize,
    /// When the last part that was waited for had ended.
    ended: Option<Instant>,
    waited: Duration,
}

impl<'a> Parts<'a> {
    /// None yet. `held` lives until the last part has ended.
    pub fn new(
        gpu: &'a Gpu,
        name: &'a str,
        held: Arc<dyn Any + Send + Sync>,
        (pace, told): (&'a mut Pace, Progress<'a>),
    ) -> Self {
        let running = VecDeque::with_capacity(AHEAD);
        Self { gpu, name, held, pace, told, rays: 0, passes: 0, running, given: 0, ended: None, waited: Duration::ZERO }
    }

    /// Begins recording a part.
    pub fn begin(&self) -> Result<Commands> {
        let mut commands = self.gpu.commands(self.name)?;
        commands.keep(Arc::clone(&self.held));
        Ok(commands)
    }

    /// Whether the part is full before a pass, or a dispatch of a pass, of `rays` rays. If it is not, the rays are counted; if it is,
    /// [`Self::submit`] must follow.
    pub fn is_full(&mut self, rays: u64) -> bool {
        let all = self.rays.saturating_add(rays);
        let full = self.passes > 0 && (all > self.pace.rays || self.passes == MOST_PASSES);
        if !full {
            (self.rays, self.passes) = (all, self.passes + 1);
        }
        full
    }

    /// Gives the part to the device, and waits for an earlier one if it has enough. The next part begins with `rays` rays.
    ///
    /// # Errors
    /// `Interrupted`, `DeviceLost`, `OutOfMemory`.
    pub fn submit(&mut self, commands: Commands, rays: u64) -> Result<()> {
        if self.running.len() == AHEAD {
            self.wait()?;
        }
        self.gpu.stop().map_or(Ok(()), crate::Stop::check)?;
        let submission = commands.submit()?;
        self.running.push_back(Running { submission, submitted: Instant::now(), rays: self.rays });
        self.given += 1;
        (self.rays, self.passes) = (rays, 1);
        Ok(())
    }

    /// Waits for the oldest part.
    fn wait(&mut self) -> Result<()> {
        let Some(Running { submission, submitted, rays }) = self.running.pop_front() else { return Ok(()) };
        let begun = Instant::now();
        let done = submission.wait();
        let now = Instant::now();
        let blocked = now - begun;
        self.waited += blocked;
        done?;
        // It began when it was submitted, or when the part before it had ended.
        let from = self.ended.map_or(submitted, |ended| ended.max(submitted));
        self.pace.took(rays, now - from, blocked < (now - from) / 8);
        self.ended = Some(now);
        self.told.ended(rays);
        Ok(())
    }

    /// Number of parts that the device was given.
    pub fn given(&self) -> usize {
        self.given
    }

    /// Time spent waiting.
    pub fn waited(&self) -> Duration {
        self.waited
    }

    /// Submits the last part and waits for all.
    ///
    /// # Errors
    /// As [`Self::submit`].
    pub fn finish(&mut self, commands: Commands) -> Result<()> {
        self.submit(commands, 0)?;
        while !self.running.is_empty() {
            self.wait()?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_approach_the_time_that_they_should_take() {
        for rays_per_second in [1e6, 2e7, 1e8, 5e8] {
            let mut pace = Pace::default();
            for _ in 0..12 {
                let time = Duration::from_secs_f64(pace.rays as f64 / rays_per_second);
                pace.took(pace.rays, time, false);
            }
            let seconds = pace.rays as f64 / rays_per_second;
            let least = LEAST as f64 / rays_per_second;
            assert!((seconds - AIM.as_secs_f64().max(least)).abs() < 0.01, "{seconds} s at {rays_per_second} rays/s");
        }
    }

    #[test]
    fn short_graphs_do_not_change_the_pace_and_slow_ones_do() {
        let mut pace = Pace::default();
        pace.took(10, Duration::from_micros(1), false);
        assert_eq!(pace.rays, START);
        pace.took(1 << 20, Duration::from_millis(800), false);
        assert_eq!(pace.rays, LEAST);
        // The host looked late: the part was not as slow as that.
        pace.took(LEAST, Duration::from_secs(9), true);
        assert_eq!(pace.rays, LEAST);
        pace.took(LEAST, Duration::from_nanos(0), true);
        assert_eq!(pace.rays, GROWTH * LEAST);
    }

    #[test]
    fn passes_that_state_too_many_rays_do_not_make_the_next_part_endless() {
        let mut pace = Pace::default();
        for _ in 0..100 {
            pace.took(pace.rays, Duration::from_micros(10), false);
        }
        // A GPU of 2e8 rays a second, a slow one, then takes less than a watchdog's two seconds.
        assert!(pace.rays as f64 / 2e8 < 1.0, "{} rays", pace.rays);
        pace.took(pace.rays, Duration::from_millis(670), false);
        assert!(pace.rays as f64 / 2e8 < 0.25, "{} rays", pace.rays);
    }
}
