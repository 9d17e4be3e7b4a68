//! Computes the units of a job that are not there yet.

use std::{
    collections::{HashSet, VecDeque},
    time::{Duration, Instant},
};

use super::{Payload, Shard, State, Store, UnitId};
use crate::{Error, ErrorKind, Result, Stop};

/// Units whose times foretell that of the next one.
const REMEMBERED: usize = 8;
/// Between two looks for units of other shards.
const PAUSE: Duration = Duration::from_millis(500);

/// How much of a job is to be done.
#[derive(Clone, Debug)]
pub struct Options {
    /// Which units.
    pub shard: Shard,
    /// No unit is begun that would not be done so long after `begun`, by the times of the units before it.
    pub time_limit: Option<Duration>,
    pub begun: Instant,
    /// Asks to stop. A unit that ends nevertheless is kept, one that fails by being asked is dropped.
    pub stop: Stop,
    /// So long units of other shards are waited for, if nothing else is to be done.
    pub wait: Duration,
}

impl Default for Options {
    /// All of the work, without a limit.
    fn default() -> Self {
        let (stop, begun) = (Stop::default(), Instant::now());
        Self { shard: Shard::default(), time_limit: None, begun, stop, wait: Duration::ZERO }
    }
}

/// How far a run is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Units of the shard that are done, and all of them.
    pub units: [u64; 2],
    /// Their costs.
    pub cost: [u64; 2],
    /// Costs that were done before this run.
    pub before: u64,
    /// Bytes that this run has computed.
    pub bytes: u64,
    /// Seconds of this run.
    pub seconds: f64,
}

impl Progress {
    /// Work a second, of this run alone.
    pub fn rate(&self) -> f64 {
        self.cost[0].saturating_sub(self.before) as f64 / self.seconds.max(1e-9)
    }

    /// Seconds that are left at this rate; `None` before anything is done.
    pub fn seconds_left(&self) -> Option<f64> {
        let left = self.cost[1].saturating_sub(self.cost[0]) as f64;
        (self.cost[0] > self.before || left == 0.0).then(|| left / self.rate().max(1e-9))
    }
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// All units of the shard are there.
    Done,
    /// It was asked to stop.
    Stopped,
    /// The next unit would not have been done in time.
    TimeLimit,
    /// The rest needs these units of other shards.
    Waits(Vec<UnitId>),
}

/// What a run has done.
#[derive(Clone, Debug)]
pub struct Outcome {
    pub end: End,
    pub progress: Progress,
    /// Units that this run has computed.
    pub computed: u64,
}

/// The units that one needs; all are there, and their bytes were gone through.
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
                // A device that was left in the middle of its work serves nobody any more.
                Err(error) if options.stop.requested() && by_request(&error) => break End::Stopped,
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
        // All that is left needs units of others.
        let since = *waits_since.get_or_insert_with(Instant::now);
        let over = options.time_limit.is_some_and(|limit| options.begun.elapsed() >= limit);
        if since.elapsed() >= options.wait || over {
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
