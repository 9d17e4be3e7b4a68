//! Computes the units of a job that are not there yet.

use std::{
    collections::{HashSet, VecDeque},
    time::{Duration, Instant},
};

use super::{Payload, Shard, State, Store, UnitId};
use crate::{Error, ErrorKind, Result, Stop};

/// Number of past units from which the time of the next unit is predicted.
const REMEMBERED: usize = 8;
/// Interval between checks for units of other shards.
const PAUSE: Duration = Duration::from_millis(500);

/// Limits of a run.
#[derive(Clone, Debug)]
pub struct Options {
    /// The units to compute.
    pub shard: Shard,
    /// No unit is started that would end later than this time after `begun`, as predicted from the times of earlier units. A unit that stops
    /// at this time with an error of the kind `Interrupted` is dropped.
    pub time_limit: Option<Duration>,
    pub begun: Instant,
    /// Request to stop. The unit in progress is kept if it completes, and dropped if it stops.
    pub stop: Stop,
    /// How long the run waits for units of other shards, when no other unit can be computed.
    pub wait: Duration,
}

impl Default for Options {
    /// All of the work, without a limit.
    fn default() -> Self {
        let (stop, begun) = (Stop::default(), Instant::now());
        Self { shard: Shard::default(), time_limit: None, begun, stop, wait: Duration::ZERO }
    }
}

/// Progress of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Finished units of the shard, and all its units.
    pub units: [u64; 2],
    /// Work of these units, as in [`super::Stage::costs`].
    pub cost: [u64; 2],
    /// Work that was finished before this run.
    pub before: u64,
    /// Bytes that this run has computed.
    pub bytes: u64,
    /// Seconds of this run.
    pub seconds: f64,
}

impl Progress {
    /// Work per second of this run.
    pub fn rate(&self) -> f64 {
        self.cost[0].saturating_sub(self.before) as f64 / self.seconds.max(1e-9)
    }

    /// Remaining seconds at this rate; `None` before the first unit.
    pub fn seconds_left(&self) -> Option<f64> {
        let left = self.cost[1].saturating_sub(self.cost[0]) as f64;
        (self.cost[0] > self.before || left == 0.0).then(|| left / self.rate().max(1e-9))
    }
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// All units of the shard are finished.
    Done,
    /// A stop was requested.
    Stopped,
    /// The next unit would have exceeded the time limit.
    TimeLimit,
    /// The remaining units depend on these units of other shards.
    Waits(Vec<UnitId>),
}

/// The result of a run.
#[derive(Clone, Debug)]
pub struct Outcome {
    pub end: End,
    pub progress: Progress,
    /// Units that this run has computed.
    pub computed: u64,
}

/// The dependencies of a unit. All exist, and their bytes are verified.
#[derive(Clone, Copy, Debug)]
pub struct Needed<'a> {
    store: &'a Store,
    units: &'a [UnitId],
}

impl Needed<'_> {
    /// In the order of [`super::Job::needs`].
    pub fn units(&self) -> &[UnitId] {
        self.units
    }

    /// Opens one of them, for some of its bytes or for all.
    ///
    /// # Errors
    /// `Runtime` if the job does not say that it is needed; `Input` if it has gone meanwhile.
    pub fn open(&self, unit: UnitId) -> Result<Payload> {
        match self.units.contains(&unit) {
            true => self.store.open_unit(unit),
            false => Err(Error::new(ErrorKind::Runtime, format!("does not need {}", self.store.job().name(unit)))),
        }
    }
}

/// Computes the units of a shard that are not there, in order, and keeps each as soon as it is done. `unit` gets the units that one needs;
/// it must give the same bytes whenever it is called. `told` hears how far it is: before the first
/// unit and after each.
///
/// Units that are there are gone through first. A damaged one is reported (a warning of the `log` crate) and computed anew.
///
/// # Errors
/// Whatever `unit` fails with; `Output` if a unit cannot be written.
pub fn run(
    store: &Store,
    options: &Options,
    mut unit: impl FnMut(UnitId, Needed<'_>) -> Result<Vec<u8>>,
    mut told: impl FnMut(&Progress),
) -> Result<Outcome> {
    let begun = Instant::now();
    let mut known = Known { store, whole: HashSet::new(), said: HashSet::new() };
    let mine = options.shard.units(store.job());
    let (mut progress, mut computed) = (Progress::default(), 0);
    progress.units[1] = mine.len() as u64;
    progress.cost[1] = mine.iter().map(|&unit| store.job().cost(unit)).sum();
    let mut left = VecDeque::new();
    for id in mine {
        if options.stop.requested() {
            return Ok(Outcome { end: End::Stopped, progress, computed });
        }
        match known.is_whole(id) {
            true => progress.add(store.job().cost(id)),
            false => left.push_back(id),
        }
    }
    progress.before = progress.cost[0];
    told(&progress);
    let mut times = VecDeque::new();
    // Units that were put off since the last one that was computed.
    let mut put_off = 0;
    let mut waits_since = None;
    let end = loop {
        if options.stop.requested() {
            break End::Stopped;
        }
        let Some(id) = left.pop_front() else { break End::Done };
        let needs = store.job().needs(id);
        if needs.iter().all(|&need| known.is_whole(need)) {
            let cost = store.job().cost(id);
            if !in_time(options, &times, cost) {
                break End::TimeLimit;
            }
            let started = Instant::now();
            let payload = match unit(id, Needed { store, units: &needs }) {
                // The request interrupted the device in the middle of the unit.
                Err(error) if options.stop.requested() && by_request(&error) => break End::Stopped,
                // The unit stopped by itself at the limit.
                Err(error) if error.kind() == ErrorKind::Interrupted && over(options) => break End::TimeLimit,
                result => result.map_err(|error| error.at(store.job().name(id)))?,
            };
            store.put(id, &payload)?;
            known.whole.insert(id);
            times.push_back(started.elapsed().as_secs_f64() / cost.max(1) as f64);
            if times.len() > REMEMBERED {
                times.pop_front();
            }
            progress.add(cost);
            progress.bytes += payload.len() as u64;
            progress.seconds = begun.elapsed().as_secs_f64();
            computed += 1;
            (put_off, waits_since) = (0, None);
            told(&progress);
            continue;
        }
        left.push_back(id);
        put_off += 1;
        if put_off < left.len() {
            continue;
        }
        // All remaining units depend on units of other shards.
        let since = *waits_since.get_or_insert_with(Instant::now);
        if since.elapsed() >= options.wait || over(options) {
            let mut wanted: Vec<UnitId> = left.iter().flat_map(|&id| store.job().needs(id)).collect();
            wanted.retain(|id| !known.whole.contains(id));
            wanted.sort();
            wanted.dedup();
            break End::Waits(wanted);
        }
        put_off = 0;
        std::thread::sleep(PAUSE.min(options.wait));
    };
    progress.seconds = begun.elapsed().as_secs_f64();
    Ok(Outcome { end, progress, computed })
}

/// Whether the time limit has passed.
fn over(options: &Options) -> bool {
    options.time_limit.is_some_and(|limit| options.begun.elapsed() >= limit)
}

fn by_request(error: &Error) -> bool {
    matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::DeviceLost)
}

/// Whether a unit of this cost would be done in time, as slow as the slowest of the last ones. The first is begun in any case, if there is
/// time at all.
fn in_time(options: &Options, times: &VecDeque<f64>, cost: u64) -> bool {
    let Some(limit) = options.time_limit else { return true };
    let left = limit.saturating_sub(options.begun.elapsed()).as_secs_f64();
    let slowest = times.iter().copied().fold(0.0, f64::max);
    left > slowest * cost as f64
}

impl Progress {
    fn add(&mut self, cost: u64) {
        self.units[0] += 1;
        self.cost[0] += cost;
    }
}

/// Units whose bytes were gone through.
struct Known<'a> {
    store: &'a Store,
    whole: HashSet<UnitId>,
    /// Those that were reported.
    said: HashSet<UnitId>,
}

impl Known<'_> {
    fn is_whole(&mut self, unit: UnitId) -> bool {
        if self.whole.contains(&unit) {
            return true;
        }
        match self.store.check(unit) {
            State::Whole(_) => drop(self.whole.insert(unit)),
            State::Missing => return false,
            State::Faulty(error) => {
                if self.said.insert(unit) {
                    log::warn!("{error}; it does not count and is made anew");
                }
                return false;
            }
        }
        true
    }
}
