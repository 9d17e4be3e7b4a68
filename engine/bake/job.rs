//! Jobs: units in stages, and the file that describes a job.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Digest, Key};
use crate::{Error, ErrorKind, Result, image};

/// Units of a job at most.
pub const MOST_UNITS: u64 = 1_000_000;
/// Stages of a job at most.
pub const MOST_STAGES: usize = 64;
/// Numbers in lists of needs at most.
const MOST_LISTED: usize = 10_000_000;
/// Bytes of a description that is read at most.
const MOST_BYTES: u64 = 256 << 20;
/// The name of the description in a job's folder.
pub const MANIFEST: &str = "job.json";
/// The version of folders that this code writes and reads.
pub const VERSION: u32 = 1;

/// A unit of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct UnitId {
    /// From 0.
    pub stage: u32,
    /// In its stage, from 0.
    pub index: u32,
}

/// Which units of an earlier stage a unit needs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Which {
    /// All of them.
    All,
    /// The one with the same number.
    Same,
    /// A list for each unit.
    Listed(Vec<Vec<u32>>),
}

/// Units of an earlier stage that those of a stage need.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Need {
    /// From 0.
    pub stage: u32,
    pub units: Which,
}

/// Units that are alike.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// Part of the names of files: 1 to 40 of `a` to `z`, `0` to `9` and `_`.
    pub name: String,
    /// Work of each unit in this stage's measure (samples, rays); at least 1.
    pub costs: Vec<u64>,
    #[serde(default)]
    pub needs: Vec<Need>,
}

impl Stage {
    /// A stage whose units do not depend on other units.
    pub fn new(name: &str, costs: Vec<u64>) -> Self {
        Self { name: name.to_owned(), costs, needs: Vec::new() }
    }

    /// Adds a dependency of the stage's units on units of an earlier stage.
    #[must_use]
    pub fn needs(mut self, stage: u32, units: Which) -> Self {
        self.needs.push(Need { stage, units });
        self
    }
}

/// A computation divided into units: the key of its inputs, and the dependencies between units.
///
/// Units may depend on units of earlier stages only, so that an order always exists. The number of units is fixed when the job begins. If the
/// results of units decide how further work is divided, this work is a second job, and its key has those results as a part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Job {
    version: u32,
    key: Key,
    stages: Vec<Stage>,
    /// Data that joining the units needs in addition to the units.
    #[serde(default)]
    pub about: Value,
}

impl Job {
    /// The division into units becomes the part `units` of the key.
    ///
    /// # Errors
    /// `Runtime`, naming the stage, if there are too many units, or if a unit depends on a stage that is not earlier.
    pub fn new(key: Key, stages: Vec<Stage>) -> Result<Self> {
        let cut = serde_json::to_vec(&stages)
            .map_err(|error| Error::new(ErrorKind::Runtime, "has no text").caused_by(error))?;
        let text: Vec<_> = stages.iter().map(|stage| format!("{} {}", stage.costs.len(), stage.name)).collect();
        let job = Self { version: VERSION, key: key.part("units", &cut, &text.join(", ")), stages, about: Value::Null };
        job.validate()?;
        Ok(job)
    }

    /// Adds the data that joining needs in addition to the units.
    #[must_use]
    pub fn about(mut self, about: Value) -> Self {
        self.about = about;
        self
    }

    fn validate(&self) -> Result<()> {
        let wrong = |what: String| Error::new(ErrorKind::Runtime, what);
        if self.stages.len() > MOST_STAGES {
            return Err(wrong(format!("{} stages, at most {MOST_STAGES} are allowed", self.stages.len())).at("stages"));
        }
        let units: u64 = self.stages.iter().map(|stage| stage.costs.len() as u64).sum();
        if units > MOST_UNITS {
            return Err(wrong(format!("{units} units, at most {MOST_UNITS} are allowed")).at("stages"));
        }
        let cost = self.costs().try_fold(0u64, |sum, cost| sum.checked_add(cost).filter(|_| cost > 0));
        if cost.is_none() {
            return Err(wrong("a unit's cost is 0, or all costs together are over 2^64".into()).at("stages"));
        }
        for (number, stage) in self.stages.iter().enumerate() {
            self.validate_stage(number, stage).map_err(|what| wrong(what).at(format!("stages[{number}]")))?;
        }
        Ok(())
    }

    fn validate_stage(&self, number: usize, stage: &Stage) -> Result<(), String> {
        let name = &stage.name;
        let good = |b: u8| matches!(b, b'a'..=b'z' | b'0'..=b'9' | b'_');
        if name.is_empty() || name.len() > 40 || !name.bytes().all(good) {
            return Err(format!("the name `{}` is not 1 to 40 of a to z, 0 to 9 and _", name.escape_debug()));
        }
        if self.stages[..number].iter().any(|earlier| earlier.name == *name) {
            return Err(format!("the name `{name}` is there twice"));
        }
        let mut listed = 0;
        for need in &stage.needs {
            let Some(earlier) = self.stages[..number].get(need.stage as usize) else {
                return Err(format!("needs stage {}, which does not come before it", need.stage));
            };
            let (ours, theirs) = (stage.costs.len(), earlier.costs.len());
            match &need.units {
                Which::Same if ours != theirs => {
                    return Err(format!("{ours} units need the same ones of `{}`, which has {theirs}", earlier.name));
                }
                Which::Listed(lists) => {
                    listed += lists.iter().map(Vec::len).sum::<usize>();
                    if lists.len() != ours || lists.iter().flatten().any(|&unit| unit as usize >= theirs) {
                        return Err(format!("the lists of dependencies do not fit {ours} and {theirs} units"));
                    }
                    if listed > MOST_LISTED {
                        return Err(format!("lists {listed} needs, at most {MOST_LISTED} are allowed"));
                    }
                }
                Which::Same | Which::All => {}
            }
        }
        Ok(())
    }

    /// The inputs that decide the bytes.
    pub fn key(&self) -> &Key {
        &self.key
    }

    pub fn stages(&self) -> &[Stage] {
        &self.stages
    }

    /// All units, stage by stage. Each unit comes after its dependencies.
    pub fn units(&self) -> impl Iterator<Item = UnitId> + '_ {
        let of = |(stage, s): (usize, &Stage)| {
            (0..s.costs.len() as u32).map(move |index| UnitId { stage: stage as u32, index })
        };
        self.stages.iter().enumerate().flat_map(of)
    }

    /// The costs of [`Self::units`].
    pub fn costs(&self) -> impl Iterator<Item = u64> + '_ {
        self.stages.iter().flat_map(|stage| stage.costs.iter().copied())
    }

    /// Work of a unit; 0 if the unit does not exist.
    pub fn cost(&self, unit: UnitId) -> u64 {
        self.stages.get(unit.stage as usize).and_then(|s| s.costs.get(unit.index as usize)).copied().unwrap_or(0)
    }

    /// The dependencies of a unit.
    pub fn needs(&self, unit: UnitId) -> Vec<UnitId> {
        let mut out = Vec::new();
        for need in self.stages.get(unit.stage as usize).map_or(&[][..], |stage| &stage.needs) {
            let id = |index: u32| UnitId { stage: need.stage, index };
            match &need.units {
                Which::All => {
                    let count = self.stages.get(need.stage as usize).map_or(0, |stage| stage.costs.len() as u32);
                    out.extend((0..count).map(id));
                }
                Which::Same => out.push(id(unit.index)),
                Which::Listed(lists) => {
                    out.extend(lists.get(unit.index as usize).into_iter().flatten().copied().map(id))
                }
            }
        }
        out
    }

    /// How messages name a unit: `vectors 12`.
    pub fn name(&self, unit: UnitId) -> String {
        let stage = self.stages.get(unit.stage as usize).map_or("?", |stage| stage.name.as_str());
        format!("{stage} {}", unit.index)
    }

    /// The name of a unit's file: `vectors-000012.unit`.
    pub fn file_name(&self, unit: UnitId) -> String {
        let stage = self.stages.get(unit.stage as usize).map_or("?", |stage| stage.name.as_str());
        format!("{stage}-{:06}.unit", unit.index)
    }

    /// The unit whose file has this name.
    pub fn of_file(&self, name: &str) -> Option<UnitId> {
        let (stage, index) = name.strip_suffix(".unit")?.rsplit_once('-')?;
        let stage = self.stages.iter().position(|s| s.name == stage)? as u32;
        let unit = UnitId { stage, index: index.parse().ok()? };
        (self.cost(unit) > 0 && self.file_name(unit) == name).then_some(unit)
    }

    /// Units in few words: `vectors 3-7, 12; sums 0`.
    pub fn list(&self, units: &[UnitId]) -> String {
        let mut out = String::new();
        let mut runs: Vec<(UnitId, u32)> = Vec::new();
        for unit in units {
            match runs.last_mut() {
                Some((first, last)) if first.stage == unit.stage && *last + 1 == unit.index => *last = unit.index,
                _ => runs.push((*unit, unit.index)),
            }
        }
        for (number, (first, last)) in runs.iter().enumerate() {
            let same = number > 0 && runs[number - 1].0.stage == first.stage;
            match (number, same) {
                (0, _) => out += &self.name(*first),
                (_, true) => out += &format!(", {}", first.index),
                (_, false) => out += &format!("; {}", self.name(*first)),
            }
            if last > &first.index {
                out += &format!("-{last}");
            }
        }
        out
    }

    /// The text of [`MANIFEST`]: JSON with a digest of the job's text, so that damage shows.
    ///
    /// # Errors
    /// `Runtime` if it cannot be text.
    pub fn encode(&self) -> Result<Vec<u8>> {
        let text = serde_json::to_string(self)
            .map_err(|error| Error::new(ErrorKind::Runtime, "the job has no text").caused_by(error))?;
        Ok(format!("{FRONT}{}{MIDDLE}{text}{END}", Digest::of(text.as_bytes())).into_bytes())
    }

    /// # Errors
    /// `Input` if the text is damaged, is no job, or has another version.
    pub fn decode(bytes: &[u8]) -> Result<Self> {
        let damaged = || Error::input("is damaged, or is no description of a job");
        let text = std::str::from_utf8(bytes).map_err(|error| damaged().caused_by(error))?;
        let inner = text.strip_prefix(FRONT).and_then(|text| text.strip_suffix(END)).ok_or_else(damaged)?;
        let (digest, job) = inner.split_once(MIDDLE).ok_or_else(damaged)?;
        if Digest::parse(digest) != Some(Digest::of(job.as_bytes())) {
            return Err(damaged());
        }
        // The version comes first, because the text of another version may not parse.
        let version = serde_json::from_str::<Versioned>(job).map_err(|error| damaged().caused_by(error))?.version;
        if version != VERSION {
            return Err(Error::input(format!("has version {version}, version {VERSION} can be read")));
        }
        let job: Self = serde_json::from_str(job).map_err(|error| damaged().caused_by(error))?;
        job.validate().map_err(|error| error.of_kind(ErrorKind::Input))?;
        Ok(job)
    }

    /// Reads the description in a job's folder.
    ///
    /// # Errors
    /// `Input`, naming the file.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(MANIFEST);
        let bytes = image::read_file_checked(&path, MOST_BYTES)?;
        Self::decode(&bytes).map_err(|error| error.in_file(&path))
    }
}

const FRONT: &str = "{\"digest\": \"";
const MIDDLE: &str = "\",\n\"job\": ";
const END: &str = "}\n";

#[derive(Deserialize)]
struct Versioned {
    version: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) fn job() -> Job {
        let stages = vec![
            Stage::new("a", vec![5, 1, 2]),
            Stage::new("b_2", vec![1; 3]).needs(0, Which::Same),
            Stage::new("c", vec![1; 2]).needs(1, Which::All).needs(0, Which::Listed(vec![vec![2], vec![0, 1]])),
        ];
        Job::new(Key::new("test", 1), stages).unwrap().about(serde_json::json!({ "radius": 0.1f32 }))
    }

    fn id(stage: u32, index: u32) -> UnitId {
        UnitId { stage, index }
    }

    #[test]
    fn units_come_after_those_that_they_need() {
        let job = job();
        let all: Vec<_> = job.units().collect();
        assert_eq!((all.len(), all[0], all[7]), (8, id(0, 0), id(2, 1)));
        assert!(all.iter().all(|unit| job.needs(*unit).iter().all(|need| need < unit)));
        assert_eq!(job.needs(id(1, 2)), [id(0, 2)]);
        assert_eq!(job.needs(id(2, 1)), [id(1, 0), id(1, 1), id(1, 2), id(0, 0), id(0, 1)]);
        assert_eq!((job.cost(id(0, 0)), job.cost(id(0, 3)), job.cost(id(9, 0))), (5, 0, 0));
        assert_eq!(job.list(&all[1..]), "a 1-2; b_2 0-2; c 0-1");
        assert_eq!(job.list(&[id(0, 0), id(0, 2)]), "a 0, 2");
    }

    #[test]
    fn names_of_files_lead_back_to_units_and_no_others_do() {
        let job = job();
        for unit in job.units() {
            assert_eq!(job.of_file(&job.file_name(unit)), Some(unit));
        }
        assert_eq!(job.file_name(id(1, 2)), "b_2-000002.unit");
        for other in
            ["a-000003.unit", "a-00001.unit", "a-+00001.unit", "d-000000.unit", "a-000001.unit.bak", "a.unit", "-.unit"]
        {
            assert_eq!(job.of_file(other), None, "{other}");
        }
    }

    #[test]
    fn descriptions_are_read_back_and_damage_is_seen() {
        let job = job();
        let bytes = job.encode().unwrap();
        assert_eq!(Job::decode(&bytes).unwrap(), job);
        assert!(serde_json::from_slice::<Value>(&bytes).is_ok());
        for at in 0..bytes.len() {
            let mut wrong = bytes.clone();
            wrong[at] ^= 1;
            assert_eq!(Job::decode(&wrong).unwrap_err().exit_code(), 3, "byte {at}");
            assert_eq!(Job::decode(&bytes[..at]).unwrap_err().exit_code(), 3, "cut at {at}");
        }
    }

    fn sealed(job: &str) -> String {
        Job::decode(format!("{FRONT}{}{MIDDLE}{job}{END}", Digest::of(job.as_bytes())).as_bytes())
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn hostile_descriptions_are_refused() {
        assert!(sealed("{\"version\":7,\"more\":1}").contains("version 7, version 1 can be read"));
        let text = |stages: &str| format!("{{\"version\":1,\"key\":{{\"parts\":[]}},\"stages\":[{stages}]}}");
        for (stages, part) in [
            (r#"{"name":"../x","costs":[1]}"#, "1 to 40 of a to z"),
            (r#"{"name":"x\u001b","costs":[1]}"#, "1 to 40 of a to z"),
            (r#"{"name":"x","costs":[0]}"#, "cost is 0"),
            (r#"{"name":"x","costs":[18446744073709551615,1]}"#, "over 2^64"),
            (r#"{"name":"x","costs":[1]},{"name":"x","costs":[1]}"#, "twice"),
            (r#"{"name":"x","costs":[1],"needs":[{"stage":0,"units":"all"}]}"#, "does not come before"),
            (
                r#"{"name":"x","costs":[1]},{"name":"y","costs":[1,1],"needs":[{"stage":0,"units":"same"}]}"#,
                "2 units need",
            ),
            (
                r#"{"name":"x","costs":[1]},{"name":"y","costs":[1],"needs":[{"stage":0,"units":{"listed":[[1]]}}]}"#,
                "do not fit",
            ),
            (r#"{"name":"x","costs":[1],"more":1}"#, "unknown field"),
        ] {
            let said = sealed(&text(stages));
            assert!(said.contains(part), "{said}");
        }
        let many = text(&vec![r#"{"name":"x","costs":[1]}"#; 65].join(","));
        assert!(sealed(&many).contains("65 stages"));
    }

    #[test]
    fn how_work_is_cut_is_part_of_the_key() {
        let of = |costs: Vec<u64>| Job::new(Key::new("test", 1), vec![Stage::new("a", costs)]).unwrap();
        let said = of(vec![1, 1]).key().difference(of(vec![1, 1, 1]).key()).unwrap();
        assert_eq!(said, "`units` is `3 a` instead of `2 a`");
        assert!(of(vec![1, 2]).key().difference(of(vec![2, 1]).key()).unwrap().contains("other contents"));
    }
}
