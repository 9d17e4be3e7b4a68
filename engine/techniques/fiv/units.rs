//! The vectors as a job of [`crate::bake`]. A unit is a range of samples. Its bytes are their vectors, nine 32-bit floats per sample, low byte
//! first.

use std::ops::Range;

use serde_json::Value;

use super::{Plan, Stored};
use crate::{
    Error, ErrorKind, Result,
    bake::{Job, Key, Stage, State, Store, UnitId},
    shaders::consts::FIV_FLOATS,
};

/// The name of such jobs.
pub const KIND: &str = "fiv";
/// Increased whenever the computation of vectors changes.
const VERSION: u32 = 1;
/// Samples of a unit, which the device computes in one submission. It takes seconds on a CPU driver.
const SAMPLES: u64 = 4096;
/// About the maximum of units. Larger jobs have more samples per unit.
const UNITS: u64 = 4096;
/// Bytes of a sample.
const BYTES: u64 = 4 * FIV_FLOATS as u64;

/// The job that computes a plan's vectors on a device. Its key contains the whole plan, so that jobs with equal keys give the same file.
///
/// # Errors
/// `Runtime` if the plan cannot be text.
pub fn job(plan: &Plan, device: &str) -> Result<Job> {
    let text = |error| Error::new(ErrorKind::Runtime, "the plan of the vectors cannot be text").caused_by(error);
    let about = serde_json::to_value(plan).map_err(text)?;
    let mut key = Key::new(KIND, VERSION).text("device", device);
    for (name, value) in about.as_object().into_iter().flatten() {
        match value {
            Value::Array(occluders) if name == "occluders" => {
                for (number, (value, kind)) in occluders.iter().zip(&plan.occluders).enumerate() {
                    let text = format!("{} ({})", kind.name, kind.hash);
                    key = key.part(&format!("occluders[{number}]"), value.to_string().as_bytes(), &text);
                }
            }
            Value::String(text) => key = key.text(name, text),
            value => key = key.text(name, &value.to_string()),
        }
    }
    let samples = plan.samples();
    let each = SAMPLES * samples.div_ceil(SAMPLES * UNITS).max(1);
    let costs = (0..samples.div_ceil(each)).map(|unit| each.min(samples - unit * each)).collect();
    Ok(Job::new(key, vec![Stage::new("vectors", costs)])?.about(about))
}

/// The samples of each unit.
fn ranges(job: &Job) -> impl Iterator<Item = (UnitId, Range<u64>)> + '_ {
    let mut end = 0u64;
    job.units().zip(job.costs()).map(move |(unit, cost)| {
        let start = end;
        end += cost;
        (unit, start..end)
    })
}

/// The samples of a unit.
pub fn range(job: &Job, unit: UnitId) -> Range<u64> {
    let start: u64 = job.costs().take(unit.index as usize).sum();
    start..start + job.cost(unit)
}

/// A unit's bytes.
pub fn bytes(fivs: &[f32]) -> Vec<u8> {
    fivs.iter().flat_map(|float| float.to_le_bytes()).collect()
}

/// All vectors of a job whose units are all there.
///
/// # Errors
/// `Input`, naming the file, if the folder is of another kind of job, or if a unit is missing or damaged; `OutOfMemory`.
pub fn join(store: &Store) -> Result<Stored> {
    let job = store.job();
    let wrong = |what: String| Error::input(what).in_file(store.folder());
    if job.key().kind() != KIND {
        return Err(wrong(format!("is a job of kind `{}`, vectors are made of `{KIND}`", job.key().kind())));
    }
    let plan: Plan = serde_json::from_value(job.about.clone())
        .map_err(|error| wrong("has a plan that cannot be read".into()).caused_by(error))?;
    let sum = job.costs().fold(0u64, u64::saturating_add);
    if plan.validate().is_err() || plan.fits(None).is_err() || plan.samples() != sum {
        return Err(wrong("has an impossible plan".into()));
    }
    let mut stored = Stored::empty(plan, 0);
    for (unit, range) in ranges(job) {
        let payload = store.open_unit(unit)?;
        payload.verify()?;
        let wanted = BYTES * (range.end - range.start);
        if payload.len() != wanted {
            let what = format!("has {} bytes, {wanted} are needed", payload.len());
            return Err(Error::input(what).in_file(store.path(unit)).help("Remove the file, and it is made anew"));
        }
        let floats = |bytes: &[u8]| {
            bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect::<Vec<_>>()
        };
        stored.push(&floats(&payload.bytes()?));
    }
    Ok(stored)
}

/// Copies the units that a partial file contains completely and that are missing in the store. Returns their number.
///
/// # Errors
/// `Output` if the partial file belongs to another plan (the message names the difference), or if a unit cannot be written.
pub fn take(store: &Store, plan: &Plan, part: &Stored) -> Result<u64> {
    if let Some(difference) = plan.difference(&part.plan) {
        return Err(Error::new(ErrorKind::Output, format!("is of other work: {difference}")));
    }
    let mut taken = 0;
    for (unit, range) in ranges(store.job()) {
        let inside = part.range.start <= range.start && range.end <= part.range.end;
        if inside && !matches!(store.look(unit), State::Whole(_)) {
            let at = |sample: u64| ((sample - part.range.start) * u64::from(FIV_FLOATS)) as usize;
            store.put(unit, &bytes(&part.fivs[at(range.start)..at(range.end)]))?;
            taken += 1;
        }
    }
    Ok(taken)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        bake::{self, Options, Shard},
        techniques::fiv::{
            Settings,
            plan::Kind,
            samples::{Grid, Shells},
        },
    };

    fn plan() -> Plan {
        let kind = |name: &str, surface| Kind {
            name: name.into(),
            hash: "00ff".into(),
            radius: 0.1,
            shells: Shells { nearest: 0.012345678, farthest: 1.6 },
            triangles: 12,
            surface,
            spacing: Default::default(),
        };
        let occluders = vec![kind("queen", 1000), kind("tree", 7)];
        Plan { grid: Grid::of(32, 17, 20), occluders, ..Plan::new("grove", 77, &[], &Settings::default()) }
    }

    fn floats(range: Range<u64>) -> Vec<f32> {
        (range.start * 9..range.end * 9).map(|i| i as f32 * 0.37 - 3.0).collect()
    }

    fn whole() -> Stored {
        let mut out = Stored::empty(plan(), 0);
        out.push(&floats(0..plan().samples()));
        out
    }

    fn shard(store: &Store, index: u64, count: u64) {
        let options = Options { shard: Shard::of(index, count).unwrap(), ..Options::default() };
        let job = store.job();
        bake::run(store, &options, |unit, _| Ok(bytes(&floats(range(job, unit)))), |_| {}).unwrap();
    }

    #[test]
    fn units_are_all_samples_and_none_twice() {
        for azimuths in [3, 32, 1024] {
            let plan = Plan { grid: Grid::of(azimuths, 200, 300), ..plan() };
            let job = job(&plan, "cpu").unwrap();
            let mut end = 0;
            for (unit, range) in ranges(&job) {
                assert_eq!((range.start, range.clone()), (end, super::range(&job, unit)));
                end = range.end;
            }
            assert_eq!(end, plan.samples());
            assert!(job.costs().count() as u64 <= UNITS);
        }
        let none = Plan { occluders: Vec::new(), ..plan() };
        assert_eq!(job(&none, "cpu").unwrap().costs().count(), 0);
    }

    #[test]
    fn units_of_any_shards_join_to_the_bytes_of_one_run() {
        for count in [1, 2, 5] {
            let folder = tempfile::tempdir().unwrap();
            let store = Store::create(folder.path(), job(&plan(), "cpu").unwrap()).unwrap();
            let error = join(&store).unwrap_err().to_string();
            assert!(error.contains("vectors-000000.unit: cannot be read"), "{error}");
            (0..count).rev().for_each(|index| shard(&store, index, count));
            assert!(join(&Store::open(folder.path()).unwrap()).unwrap().encode().unwrap() == whole().encode().unwrap());
        }
    }

    #[test]
    fn parts_of_files_are_taken_and_those_of_other_work_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::create(folder.path(), job(&plan(), "cpu").unwrap()).unwrap();
        let mut part = Stored::empty(plan(), 5000);
        part.push(&floats(5000..20_000));
        // Samples 8192 to 16384 are those of whole units.
        assert_eq!(take(&store, &plan(), &part).unwrap(), 2);
        assert_eq!(take(&store, &plan(), &part).unwrap(), 0);
        assert_eq!(store.survey(true).unwrap().whole.iter().map(|unit| unit.index).collect::<Vec<_>>(), [2, 3]);
        shard(&store, 0, 1);
        assert!(join(&store).unwrap() == whole());
        part.plan.occluders[1].hash = "11".into();
        let error = take(&store, &plan(), &part).unwrap_err().to_string();
        assert!(error.contains("other work: occluder `tree`"), "{error}");
    }

    #[test]
    fn what_the_plan_says_is_in_the_key() {
        let ours = job(&plan(), "cpu").unwrap();
        let differs = |change: &dyn Fn(&mut Plan), part: &str| {
            let mut other = plan();
            change(&mut other);
            let said = ours.key().difference(job(&other, "cpu").unwrap().key()).unwrap();
            assert!(said.contains(part), "{said}");
        };
        differs(&|plan| plan.split = 7, "`split` is `7`");
        differs(&|plan| plan.environment_hash = "9".into(), "`environment_hash`");
        differs(
            &|plan| plan.occluders[1].spacing.polar = vec![0.0, 0.5],
            "`occluders[1]` (`tree (00ff)`) has other contents",
        );
        differs(&|plan| plan.occluders[0].radius = 0.2, "`occluders[0]`");
        let said = ours.key().difference(job(&plan(), "gpu").unwrap().key()).unwrap();
        assert_eq!(said, "`device` is `gpu` instead of `cpu`");
    }

    #[test]
    fn units_of_a_wrong_length_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::create(folder.path(), job(&plan(), "cpu").unwrap()).unwrap();
        shard(&store, 0, 1);
        store.put(UnitId { stage: 0, index: 1 }, b"1234").unwrap();
        let error = join(&store).unwrap_err().to_string();
        assert!(error.contains("vectors-000001.unit: has 4 bytes"), "{error}");
        let other = Store::create(&folder.path().join("other"), Job::new(Key::new("prt", 1), vec![]).unwrap()).unwrap();
        assert!(join(&other).unwrap_err().to_string().contains("kind `prt`"));
    }
}
