//! Files of vectors: `.fiv`.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | `lucfiv\r\n` |
//! | 4 | version, 3; version 2 can be read too and has rotations about +Y |
//! | 4 | bytes of the header |
//! | … | header: JSON, the [`Plan`] with the `range` of samples in this file |
//! | … | the vectors of these samples: nine 32-bit floats each, x.rgb, y.rgb, z.rgb, W/m² |
//! | 8 | checksum of all bytes before |
//!
//! Numbers are little-endian. A file may contain a part of the samples. [`merge`] joins parts.

use std::{ops::Range, path::Path};

use serde::{Deserialize, Serialize};

use super::{hash::Hash, limits::MOST_SAMPLES, plan::Plan};
use crate::{Error, Result, image, shaders::consts::FIV_FLOATS};

const MAGIC: &[u8; 8] = b"lucfiv\r\n";
const VERSION: u32 = 3;
/// The oldest version that can be read.
const OLDEST: u32 = 2;
/// Largest size of a file that is read, bytes.
const MOST_BYTES: u64 = 8 << 30;
/// Largest header that is read, bytes.
const MOST_HEADER: usize = 16 << 20;
const FLOATS: u64 = FIV_FLOATS as u64;

/// The vectors of a plan, or of a range of its samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    pub plan: Plan,
    /// The samples that are present.
    pub range: Range<u64>,
    /// Nine floats for each sample.
    pub fivs: Vec<f32>,
}

#[derive(Serialize, Deserialize)]
struct Header {
    range: [u64; 2],
    #[serde(flatten)]
    plan: Plan,
}

impl Stored {
    /// An empty range that begins at sample `first`.
    pub fn empty(plan: Plan, first: u64) -> Self {
        Self { plan, range: first..first, fivs: Vec::new() }
    }

    /// Whether all samples of the plan are present.
    pub fn is_complete(&self) -> bool {
        self.range == (0..self.plan.samples())
    }

    /// Appends the vectors of the samples that follow.
    pub fn push(&mut self, fivs: &[f32]) {
        self.fivs.extend_from_slice(fivs);
        self.range.end = self.range.start + self.fivs.len() as u64 / FLOATS;
    }

    /// The bytes of a file. Equal vectors give equal bytes.
    ///
    /// # Errors
    /// `Runtime` if the header cannot be written.
    pub fn encode(&self) -> Result<Vec<u8>> {
        let header = Header { range: [self.range.start, self.range.end], plan: self.plan.clone() };
        let header = serde_json::to_vec(&header).map_err(|error| {
            Error::new(crate::ErrorKind::Runtime, "the header of the vectors cannot be written").caused_by(error)
        })?;
        let mut out = Vec::with_capacity(24 + header.len() + 4 * self.fivs.len());
        out.extend_from_slice(MAGIC);
        out.extend_from_slice(&VERSION.to_le_bytes());
        out.extend_from_slice(&(header.len() as u32).to_le_bytes());
        out.extend_from_slice(&header);
        self.fivs.iter().for_each(|f| out.extend_from_slice(&f.to_le_bytes()));
        out.extend_from_slice(&checksum(&out).to_le_bytes());
        Ok(out)
    }

    /// # Errors
    /// `Input`, saying what is wrong.
    pub fn decode(bytes: &[u8]) -> Result<Self> {
        let again = "Compute it again with `fiv precompute`";
        let damaged = |what: String| Error::input(what).help(again);
        let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        if !bytes.starts_with(MAGIC) {
            return Err(Error::input("is not a file of irradiance vectors").help("`fiv precompute` writes such files"));
        }
        let (Some(version), Some(length)) = (word(8), word(12)) else {
            return Err(damaged(format!("is cut off after {} bytes", bytes.len())));
        };
        if !(OLDEST..=VERSION).contains(&version) {
            return Err(damaged(format!("has version {version}; versions {OLDEST} to {VERSION} can be read")));
        }
        let length = length as usize;
        let header = bytes.get(16..16 + length.min(MOST_HEADER)).filter(|h| h.len() == length);
        let Some(header) = header else {
            return Err(damaged(format!(
                "is cut off: it has {} bytes, and its header alone has {length}",
                bytes.len()
            )));
        };
        let Header { range: [first, last], plan } = serde_json::from_slice(header)
            .map_err(|error| damaged("has a header that cannot be read".into()).caused_by(error))?;
        plan.validate().map_err(|error| damaged(format!("has an impossible plan: {error}")))?;
        let positive = |x: f32| x.is_finite() && x > 0.0;
        if let Some(kind) = plan.occluders.iter().find(|k| {
            !(positive(k.radius) && positive(k.shells.nearest) && positive(k.shells.farthest))
                || k.shells.farthest <= k.shells.nearest
        }) {
            return Err(damaged(format!("has an impossible plan: radii of occluder `{}`", kind.name)));
        }
        if let Some(kind) = plan.occluders.iter().find(|k| !k.spacing.fit(&plan.grid)) {
            let what = format!("has an impossible plan: the spacing of the samples around occluder `{}`", kind.name);
            return Err(damaged(what));
        }
        let samples = plan.samples();
        if samples > MOST_SAMPLES {
            let what = format!("has an impossible plan: {samples} samples; at most {MOST_SAMPLES} are allowed");
            return Err(damaged(what));
        }
        if first > last || last > samples {
            return Err(damaged(format!("has an impossible plan: samples {first} to {last} of {samples}")));
        }
        let body = 16 + length;
        let whole = body as u64 + 4 * FLOATS * (last - first) + 8;
        if bytes.len() as u64 != whole {
            let more = if (bytes.len() as u64) < whole { "is cut off" } else { "has something after its end" };
            return Err(damaged(format!("{more}: it has {} bytes, and its header says {whole}", bytes.len())));
        }
        let (front, end) = bytes.split_at(bytes.len() - 8);
        if checksum(front).to_le_bytes() != *end {
            return Err(damaged("is damaged: its checksum is wrong".into()));
        }
        let fivs = front[body..].chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        Ok(Self { plan, range: first..last, fivs })
    }

    /// # Errors
    /// `Input` with the file, if it cannot be read or is not a valid file of vectors.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = image::read_file_checked(path, MOST_BYTES)?;
        Self::decode(&bytes).map_err(|error| error.in_file(path))
    }

    /// Writes the file atomically.
    ///
    /// # Errors
    /// `Output` if it cannot be written.
    pub fn write(&self, path: impl AsRef<Path>, overwrite: bool) -> Result<()> {
        image::write_atomic(path.as_ref(), &self.encode()?, overwrite)
    }
}

fn checksum(bytes: &[u8]) -> u64 {
    let mut hash = Hash::new();
    hash.bytes(bytes);
    hash.finish()
}

/// Joins parts of one plan, in any order.
///
/// # Errors
/// `Input` if the parts belong to different plans, or if samples are missing or occur twice.
pub fn merge(mut parts: Vec<Stored>) -> Result<Stored> {
    parts.sort_by_key(|part| (part.range.start, part.range.end));
    let Some(first) = parts.first() else { return Err(Error::input("there are no parts")) };
    let mut whole = Stored::empty(first.plan.clone(), 0);
    for part in parts {
        if let Some(difference) = whole.plan.difference(&part.plan) {
            return Err(Error::input(format!("the parts belong to different plans: {difference}")));
        }
        let end = whole.range.end;
        if part.range.start != end {
            let what = if part.range.start > end { "are missing" } else { "occur twice" };
            let (low, high) = (part.range.start.min(end), part.range.start.max(end));
            return Err(Error::input(format!("samples {low} to {high} {what}")));
        }
        whole.push(&part.fivs);
    }
    if !whole.is_complete() {
        let (end, all) = (whole.range.end, whole.plan.samples());
        return Err(Error::input(format!("samples {end} to {all} are missing")));
    }
    Ok(whole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::techniques::fiv::{
        Settings,
        occluder_rotation::Axis,
        plan::Kind,
        samples::{Grid, Shells},
    };

    fn stored() -> Stored {
        let kind = |name: &str| Kind {
            name: name.into(),
            hash: "00ff".into(),
            radius: 0.1,
            shells: Shells { nearest: 0.012345678, farthest: 1.6 },
            triangles: 12,
            surface: 0,
            spacing: Default::default(),
        };
        let plan = Plan {
            grid: Grid::of(3, 2, 2),
            occluders: vec![kind("queen"), kind("tree")],
            ..Plan::new("grove", 77, &[], &Settings::default())
        };
        let mut out = Stored::empty(plan, 0);
        out.push(&(0..24 * 9).map(|i| i as f32 * 0.37 - 3.0).collect::<Vec<_>>());
        out
    }

    #[test]
    fn what_is_written_is_read() {
        let whole = stored();
        assert!(whole.is_complete() && whole.range == (0..24));
        let bytes = whole.encode().unwrap();
        assert_eq!(Stored::decode(&bytes).unwrap(), whole);
        assert_eq!(whole.encode().unwrap(), bytes);
    }

    #[test]
    fn the_axis_of_turns_is_kept_and_older_files_have_y() {
        let mut whole = stored();
        whole.plan.turn_axis = Axis::try_from("1,0.5,0".to_owned()).unwrap();
        assert_eq!(Stored::decode(&whole.encode().unwrap()).unwrap(), whole);
        // With one rotation sample the axis has no effect.
        assert_eq!(whole.plan.difference(&stored().plan), None);
        let [x, y] = ["x", "y"].map(|axis| Plan {
            turns: 3,
            turn_axis: Axis::try_from(axis.to_owned()).unwrap(),
            ..stored().plan
        });
        assert!(x.difference(&y).unwrap().contains("3 turns about y"));
        // As version 2 wrote it, without an axis.
        let now = stored().encode().unwrap();
        let length = u32::from_le_bytes([now[12], now[13], now[14], now[15]]) as usize;
        let header = std::str::from_utf8(&now[16..16 + length]).unwrap().replacen("\"turn_axis\":\"y\",", "", 1);
        assert!(header.len() < length);
        let mut old = [&now[..8], &2u32.to_le_bytes(), &(header.len() as u32).to_le_bytes()].concat();
        old.extend_from_slice(header.as_bytes());
        old.extend_from_slice(&now[16 + length..now.len() - 8]);
        old.extend_from_slice(&checksum(&old).to_le_bytes());
        assert_eq!(Stored::decode(&old).unwrap(), stored());
    }

    #[test]
    fn damage_of_any_kind_is_refused_with_a_reason() {
        let bytes = stored().encode().unwrap();
        let refused = |bytes: &[u8], part: &str| {
            let error = Stored::decode(bytes).unwrap_err();
            assert!(error.exit_code() == 3 && error.to_string().contains(part), "{error} without {part:?}");
        };
        for length in 0..bytes.len() {
            refused(&bytes[..length], if length < 8 { "not a file of irradiance" } else { "cut off" });
        }
        refused(&[&bytes[..], &[0]].concat(), "after its end");
        refused(b"{}", "not a file of irradiance vectors");
        // Every byte counts.
        for at in (0..bytes.len()).step_by(3) {
            let mut wrong = bytes.clone();
            wrong[at] ^= 4;
            assert_eq!(Stored::decode(&wrong).unwrap_err().exit_code(), 3, "byte {at}");
        }
        let mut other = bytes.clone();
        other[8] = 9;
        refused(&other, "version 9");
        let mut last = bytes.clone();
        *last.last_mut().unwrap() ^= 1;
        refused(&last, "checksum");
        let mut huge = stored();
        huge.plan.grid.azimuths = 100_000;
        refused(&huge.encode().unwrap(), "azimuths");
        let mut none = stored();
        none.plan.split = 0;
        refused(&none.encode().unwrap(), "split");
        let mut beyond = stored();
        beyond.range = 20..44;
        refused(&beyond.encode().unwrap(), "20 to 44 of 24");
        let mut bent = stored();
        bent.plan.occluders[1].spacing.polar = vec![0.5; 3];
        refused(&bent.encode().unwrap(), "the spacing of the samples around occluder `tree`");
        let mut many = stored();
        many.plan.occluders[0].surface = u32::MAX;
        refused(&many.encode().unwrap(), "at most 134217728 are allowed");
    }

    #[test]
    fn plans_that_differ_in_how_samples_lie_say_so() {
        let (plain, mut bent) = (stored().plan, stored().plan);
        bent.occluders[1].spacing.polar = vec![0.0, 0.2, 1.0];
        let what = plain.difference(&bent).unwrap();
        assert!(what.contains("`tree`") && what.contains("fiv.adaptive") && !what.contains("instead"), "{what}");
        let mut covered = stored().plan;
        covered.occluders[0].surface = 7;
        let what = plain.difference(&covered).unwrap();
        assert!(what.contains("7 samples on") && what.contains("0 samples on"), "{what}");
    }

    #[test]
    fn parts_join_to_the_same_bytes() {
        let whole = stored();
        let part = |first: u64, last: u64| {
            let mut part = Stored::empty(whole.plan.clone(), first);
            part.push(&whole.fivs[9 * first as usize..9 * last as usize]);
            part
        };
        let joined = merge(vec![part(13, 24), part(0, 5), part(5, 13)]).unwrap();
        assert_eq!(joined.encode().unwrap(), whole.encode().unwrap());
        for (parts, text) in [
            (vec![part(0, 5), part(6, 24)], "samples 5 to 6 are missing"),
            (vec![part(0, 5), part(5, 20)], "samples 20 to 24 are missing"),
            (vec![part(0, 8), part(5, 24)], "samples 5 to 8 occur twice"),
            (vec![part(3, 24)], "samples 0 to 3 are missing"),
            (vec![], "no parts"),
        ] {
            let error = merge(parts).unwrap_err();
            assert!(error.to_string().contains(text), "{error}");
        }
        let mut other = part(5, 24);
        other.plan.occluders[1].hash = "11".into();
        let error = merge(vec![part(0, 5), other]).unwrap_err();
        assert!(error.to_string().contains("different plans") && error.to_string().contains("tree"), "{error}");
    }
}
