//! Parts of a job for several machines.

use std::str::FromStr;

use super::{Job, UnitId};
use crate::{Error, Result};

/// Shards of a job at most.
pub const MOST_SHARDS: u64 = 1_000_000;

/// One of several parts of the work: `2/5` is the second of five.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: u64,
    count: u64,
}

impl Default for Shard {
    /// All of the work.
    fn default() -> Self {
        Self { index: 0, count: 1 }
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index + 1, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (index, count) = text.split_once('/')?;
            Self::of(number(index)?.checked_sub(1)?, number(count)?)
        };
        parse().ok_or_else(|| {
            format!(
                "expected I/N with 1 <= I <= N <= {MOST_SHARDS}, for example 2/5; or `auto` in an array job, or auto/N"
            )
        })
    }
}

impl Shard {
    /// Number `index`, from 0, of `count`.
    pub fn of(index: u64, count: u64) -> Option<Self> {
        (index < count && count <= MOST_SHARDS).then_some(Self { index, count })
    }

    /// From 0.
    pub fn index(self) -> u64 {
        self.index
    }

    pub fn count(self) -> u64 {
        self.count
    }

    /// The shard that a scheduler says by the variables of an array job: Slurm (`SLURM_ARRAY_TASK_ID`, `_MIN`, `_COUNT`, `_STEP`), Grid
    /// Engine (`SGE_TASK_ID`, `_FIRST`, `_LAST`, `_STEPSIZE`) or Kubernetes (`JOB_COMPLETION_INDEX`, with `JOB_COMPLETIONS` from the
    /// job's text, for Kubernetes does not say how many there are). `count`: of how many, where the variables do not say it or say
    /// it otherwise, as for a part of an array that is run again.
    ///
    /// # Errors
    /// `Usage` if no variable says it, or if one is no number or does not fit.
    pub fn auto(variable: impl Fn(&str) -> Option<String>, count: Option<u64>) -> Result<Self> {
        // Grid Engine sets `undefined` where a job is no array.
        let set = |name: &str| variable(name).filter(|text| !text.is_empty() && text != "undefined");
        let read = |name: &str| -> Result<Option<u64>> {
            let Some(text) = set(name) else { return Ok(None) };
            let what = || Error::usage(format!("`{}` is no number from 0 on", text.escape_debug())).at(name);
            number(&text).map(Some).ok_or_else(what)
        };
        let (index, said, place) = if let Some(id) = read("SLURM_ARRAY_TASK_ID")? {
            let first = read("SLURM_ARRAY_TASK_MIN")?.unwrap_or(0);
            let step = read("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1).max(1);
            (id.checked_sub(first).map(|i| i / step), read("SLURM_ARRAY_TASK_COUNT")?, "SLURM_ARRAY_TASK_ID")
        } else if let Some(id) = read("SGE_TASK_ID")? {
            let first = read("SGE_TASK_FIRST")?.unwrap_or(1);
            let step = read("SGE_TASK_STEPSIZE")?.unwrap_or(1).max(1);
            let said = read("SGE_TASK_LAST")?.and_then(|last| Some(last.checked_sub(first)? / step + 1));
            (id.checked_sub(first).map(|i| i / step), said, "SGE_TASK_ID")
        } else if let Some(index) = read("JOB_COMPLETION_INDEX")? {
            (Some(index), read("JOB_COMPLETIONS")?, "JOB_COMPLETION_INDEX")
        } else {
            let what = "none of SLURM_ARRAY_TASK_ID, SGE_TASK_ID and JOB_COMPLETION_INDEX is set";
            return Err(Error::usage(what).at("--shard auto").help("Run it in an array job, or give --shard I/N"));
        };
        let Some(count) = count.or(said) else {
            let help = "Give --shard auto/N, or set JOB_COMPLETIONS to the number of tasks";
            return Err(Error::usage("nothing says of how many tasks this is one").at(place).help(help));
        };
        // A part of an array that is run again has the numbers of the whole array.
        let index = match set("SLURM_ARRAY_TASK_ID").and_then(|id| number(&id)).filter(|_| said != Some(count)) {
            Some(id) => Some(id),
            None => index,
        };
        index.and_then(|index| Self::of(index, count)).ok_or_else(|| {
            let shown = index.map_or("a task before the first one".into(), |i| format!("task {i}, counted from 0,"));
            let what = format!("{shown} of {count}, at most {MOST_SHARDS} are allowed");
            Error::usage(what).at(place).help("Number the tasks of the array without gaps")
        })
    }

    /// The items of a shard, of `count` equal items in a fixed order: consecutive ones, so that neighbours which share data stay together.
    pub fn range(self, count: u64) -> std::ops::Range<u64> {
        let bound = |index: u64| (u128::from(count) * u128::from(index) / u128::from(self.count)) as u64;
        bound(self.index)..bound(self.index + 1)
    }

    /// The units of a shard: consecutive units of each stage, so that all shards have nearly the same work. The assignment depends only on the
    /// job and the number of shards, and does not change the bytes of a unit.
    pub fn units(self, job: &Job) -> Vec<UnitId> {
        let mut out = Vec::new();
        for (stage, units) in job.stages().iter().enumerate() {
            let total: u128 = units.costs.iter().map(|&cost| u128::from(cost)).sum();
            let mut before = 0u128;
            for (index, &cost) in units.costs.iter().enumerate() {
                // A unit belongs to the shard that its middle falls into.
                let owner = (2 * before + u128::from(cost)) * u128::from(self.count) / (2 * total);
                before += u128::from(cost);
                if owner == u128::from(self.index) {
                    out.push(UnitId { stage: stage as u32, index: index as u32 });
                }
            }
        }
        out
    }
}

/// Digits alone: no sign, no space.
fn number(text: &str) -> Option<u64> {
    text.bytes().all(|b| b.is_ascii_digit()).then(|| text.parse().ok())?
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::{Key, Stage};

    #[test]
    fn ranges_hold_each_item_once_and_differ_by_one() {
        for (items, count) in [(0, 3), (2, 5), (10, 3), (7, 7), (u64::MAX, 1_000_000)] {
            let ranges: Vec<_> = (0..count).map(|index| Shard { index, count }.range(items)).collect();
            assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start));
            assert_eq!((ranges[0].start, ranges[ranges.len() - 1].end), (0, items));
            assert!(ranges.iter().all(|r| (items / count..=items / count + 1).contains(&(r.end - r.start))));
        }
    }

    #[test]
    fn shards_count_from_one() {
        assert_eq!("2/5".parse::<Shard>().unwrap(), Shard { index: 1, count: 5 });
        assert_eq!("2/5".parse::<Shard>().unwrap().to_string(), "2/5");
        for bad in ["0/5", "6/5", "1", "a/b", "-1/2", "+1/2", "1/0", "/", "1/9999999", " 1/2", "1/2/3", "auto"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }

    #[test]
    fn every_unit_has_one_shard_and_all_have_like_work() {
        let costs: Vec<u64> = (0..97).map(|i| 1 + i * 7 % 13).collect();
        let most = *costs.iter().max().unwrap();
        let stages = vec![Stage::new("a", costs), Stage::new("b", vec![u64::MAX >> 8; 3]), Stage::new("empty", vec![])];
        let job = Job::new(Key::new("test", 1), stages).unwrap();
        for count in [1, 2, 3, 5, 17, 200] {
            let mut all: Vec<_> = (0..count).flat_map(|i| Shard::of(i, count).unwrap().units(&job)).collect();
            let work = |i| {
                Shard::of(i, count)
                    .unwrap()
                    .units(&job)
                    .iter()
                    .filter(|u| u.stage == 0)
                    .map(|&u| job.cost(u))
                    .sum::<u64>()
            };
            let even = job.stages()[0].costs.iter().sum::<u64>() / count;
            assert!((0..count).all(|i| work(i).abs_diff(even) <= most + 1), "{count}");
            all.sort();
            assert!(all.iter().copied().eq(job.units()), "{count}");
        }
    }

    fn auto(set: &[(&str, &str)], count: Option<u64>) -> Result<String, String> {
        let find = |name: &str| set.iter().find(|(n, _)| *n == name).map(|(_, text)| (*text).to_owned());
        Shard::auto(find, count).map(|shard| shard.to_string()).map_err(|error| {
            assert_eq!(error.exit_code(), 2);
            error.to_string()
        })
    }

    #[test]
    fn schedulers_say_which_shard_it_is() {
        let slurm = |id, min, count, step| {
            [
                ("SLURM_ARRAY_TASK_ID", id),
                ("SLURM_ARRAY_TASK_MIN", min),
                ("SLURM_ARRAY_TASK_COUNT", count),
                ("SLURM_ARRAY_TASK_STEP", step),
            ]
        };
        assert_eq!(auto(&slurm("0", "0", "4", "1"), None).unwrap(), "1/4");
        assert_eq!(auto(&slurm("4", "1", "4", "1"), None).unwrap(), "4/4");
        assert_eq!(auto(&slurm("9", "1", "5", "2"), None).unwrap(), "5/5");
        // One task of an array of eight, run again.
        assert_eq!(auto(&slurm("3", "3", "1", "1"), Some(8)).unwrap(), "4/8");
        assert!(auto(&slurm("9", "1", "4", "1"), None).unwrap_err().contains("without gaps"));
        assert!(auto(&slurm("0", "1", "4", "1"), None).unwrap_err().contains("before the first"));
        assert!(auto(&slurm("x", "1", "4", "1"), None).unwrap_err().contains("SLURM_ARRAY_TASK_ID: `x` is no number"));
        let grid = [("SGE_TASK_ID", "7"), ("SGE_TASK_FIRST", "1"), ("SGE_TASK_LAST", "8"), ("SGE_TASK_STEPSIZE", "2")];
        assert_eq!(auto(&grid, None).unwrap(), "4/4");
        assert!(auto(&[("SGE_TASK_ID", "undefined")], None).unwrap_err().contains("--shard I/N"));
        let index = [("JOB_COMPLETION_INDEX", "2"), ("JOB_COMPLETIONS", "3")];
        assert_eq!(auto(&index, None).unwrap(), "3/3");
        assert_eq!(auto(&index[..1], Some(9)).unwrap(), "3/9");
        assert!(auto(&index[..1], None).unwrap_err().contains("auto/N"));
        assert!(auto(&index[..1], Some(2)).is_err() && auto(&index[..1], Some(0)).is_err());
    }
}
