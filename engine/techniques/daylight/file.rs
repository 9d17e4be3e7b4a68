//! Files of baked daylight: `.day`.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | `lucday\r\n` |
//! | 4 | version, 1 |
//! | 4 | bytes of the header |
//! | … | header: JSON, the [`Plan`] and the bytes of each tile |
//! | … | the tiles, one after the other ([`Tile::encode`]) |
//! | … | for lightmaps: the corners of all triangles, six numbers of 16 bits each, in sixteenths of a texel |
//! | 32 | BLAKE3 digest of all bytes before |
//!
//! Numbers are little-endian.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Plan, units, units::Tile};
use crate::{
    Error, ErrorKind, Result,
    bake::{Digest, Store},
    image,
};

const MAGIC: &[u8; 8] = b"lucday\r\n";
const VERSION: u32 = 1;
/// Bytes of the digest at the end.
const DIGEST: usize = 32;
/// Largest size of a file that is read, bytes.
const MOST_BYTES: u64 = 8 << 30;
/// Largest header that is read, bytes.
const MOST_HEADER: usize = 64 << 20;

/// A whole bake.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    pub plan: Plan,
    /// Row after row.
    pub tiles: Vec<Tile>,
    /// The lightmap's place of each triangle ([`Lightmap::corners`](super::lightmap::Lightmap::corners)); empty for other bakes.
    pub corners: Vec<[u16; 6]>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    plan: Plan,
    /// Bytes of each tile.
    tiles: Vec<u64>,
    /// Number of triangles with corners.
    triangles: u64,
}

/// What a bake holds and what it is within.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Bytes of all frames as 16-bit floats, without the dark ones.
    pub raw_bytes: u64,
    /// Bytes of the images and coefficients.
    pub bytes: u64,
    /// Mean number of images of a tile for the light of the sun.
    pub images: f64,
    /// The most images of a tile for the light of the sun.
    pub most_images: u32,
    /// The largest error of a step of the day in a tile (root mean square), relative to its mean.
    pub worst_tile: f64,
    /// The largest error of a step of the day over all texels, relative to its mean, and its number.
    pub worst_frame: f64,
    pub worst_frame_number: usize,
    /// The largest error of all but a thousandth of steps and tiles.
    pub p999: f64,
    /// The largest error of a sky that the bake guarantees.
    pub worst_sky: f64,
    /// Median over tiles of the noise of the step with the most noise, relative to its mean.
    pub noise: f64,
}

impl Stored {
    /// Joins the units of a job that are all there. `corners`: of the job's lightmap.
    ///
    /// # Errors
    /// `Input`, naming the file, if the folder is of another kind of job, or if a unit is missing or damaged; `OutOfMemory`.
    pub fn join(store: &Store, corners: Vec<[u16; 6]>) -> Result<Self> {
        let job = store.job();
        let wrong = |what: String| Error::input(what).in_file(store.folder());
        if job.key().kind() != units::KIND {
            return Err(wrong(format!(
                "is a job of kind `{}`, daylight is made of `{}`",
                job.key().kind(),
                units::KIND
            )));
        }
        let plan: Plan = serde_json::from_value(job.about.clone())
            .map_err(|error| wrong("has a plan that cannot be read".into()).caused_by(error))?;
        plan.validate().map_err(|error| wrong(format!("has an impossible plan: {error}")))?;
        plan.check_corners(&corners).map_err(|error| error.in_file(store.folder()))?;
        let [columns, rows] = plan.tiles();
        if job.units().count() as u64 != u64::from(columns) * u64::from(rows) {
            return Err(wrong("has another number of units than its plan has tiles".into()));
        }
        let mut tiles = Vec::new();
        for unit in job.units() {
            let payload = store.open_unit(unit)?;
            payload.verify()?;
            let texels = texels(&plan, unit.index);
            let tile = Tile::decode(&payload.bytes()?, &plan, texels);
            let again = |error: Error| error.in_file(store.path(unit)).help("Remove the file, and it is made anew");
            tiles.push(tile.map_err(again)?);
        }
        Ok(Self { plan, tiles, corners })
    }

    /// The bytes of a file. Equal bakes give equal bytes.
    ///
    /// # Errors
    /// `Runtime` if the header cannot be written.
    pub fn encode(&self) -> Result<Vec<u8>> {
        let tiles: Vec<Vec<u8>> = self.tiles.iter().map(Tile::encode).collect();
        let header = Header {
            plan: self.plan.clone(),
            tiles: tiles.iter().map(|tile| tile.len() as u64).collect(),
            triangles: self.corners.len() as u64,
        };
        let header = serde_json::to_vec(&header).map_err(|error| {
            Error::new(ErrorKind::Runtime, "the header of the bake cannot be written").caused_by(error)
        })?;
        let mut out = Vec::new();
        out.extend_from_slice(MAGIC);
        out.extend_from_slice(&VERSION.to_le_bytes());
        out.extend_from_slice(&(header.len() as u32).to_le_bytes());
        out.extend_from_slice(&header);
        tiles.iter().for_each(|tile| out.extend_from_slice(tile));
        self.corners.iter().flatten().for_each(|number| out.extend_from_slice(&number.to_le_bytes()));
        let digest = Digest::of(&out);
        out.extend_from_slice(&digest.0);
        Ok(out)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// `Input`, naming the file and saying what is wrong.
    pub fn read(path: &Path) -> Result<Self> {
        Ok(Self::read_with_digest(path)?.0)
    }

    /// Reads a file, and gives the digest at its end.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_with_digest(path: &Path) -> Result<(Self, Digest)> {
        let bytes = image::read_file_checked(path, MOST_BYTES)?;
        let stored = Self::decode(&bytes).map_err(|error| error.in_file(path))?;
        let mut digest = [0; DIGEST];
        digest.copy_from_slice(&bytes[bytes.len() - DIGEST..]);
        Ok((stored, Digest(digest)))
    }

    /// # Errors
    /// `Input`, saying what is wrong.
    pub fn decode(bytes: &[u8]) -> Result<Self> {
        let damaged = |what: String| Error::input(what).help("Bake it again with `daylight bake`");
        if !bytes.starts_with(MAGIC) {
            return Err(Error::input("is not a file of baked daylight").help("`daylight bake` writes such files"));
        }
        let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let (Some(version), Some(length)) = (word(8), word(12)) else {
            return Err(damaged(format!("is cut off after {} bytes", bytes.len())));
        };
        if version != VERSION {
            return Err(damaged(format!("has version {version}; version {VERSION} can be read")));
        }
        let length = length as usize;
        let header = bytes.get(16..16 + length.min(MOST_HEADER)).filter(|h| h.len() == length);
        let Some(header) = header else {
            let found = bytes.len();
            return Err(damaged(format!("is cut off: it has {found} bytes, and its header alone has {length}")));
        };
        let Header { plan, tiles: lengths, triangles } = serde_json::from_slice(header)
            .map_err(|error| damaged("has a header that cannot be read".into()).caused_by(error))?;
        plan.validate().map_err(|error| damaged(format!("has an impossible plan: {error}")))?;
        let [columns, rows] = plan.tiles().map(u64::from);
        if lengths.len() as u64 != columns * rows {
            let what = format!("has {} tiles; its plan has {columns}×{rows}", lengths.len());
            return Err(damaged(what));
        }
        let body = 16 + length;
        let sum = lengths.iter().try_fold(body as u64, |sum, length| sum.checked_add(*length));
        let of_corners = triangles.checked_mul(12);
        let sum = sum.and_then(|sum| sum.checked_add(of_corners?));
        let whole = sum.and_then(|sum| sum.checked_add(DIGEST as u64));
        if whole != Some(bytes.len() as u64) {
            let what = whole.map_or("too many bytes".into(), |whole| format!("{whole} bytes"));
            return Err(damaged(format!(
                "is cut off or has something after its end: {} bytes, by its header {what}",
                bytes.len()
            )));
        }
        let (covered, digest) = bytes.split_at(bytes.len() - DIGEST);
        if Digest::of(covered).0 != digest {
            return Err(damaged("is damaged: its digest does not fit".into()));
        }
        let mut rest = &covered[body..];
        let mut tiles = Vec::new();
        for (index, length) in lengths.iter().enumerate() {
            let (tile, after) = rest.split_at(*length as usize);
            let decoded = Tile::decode(tile, &plan, texels(&plan, index as u32));
            tiles.push(decoded.map_err(|error| error.at(format!("tiles[{index}]")))?);
            rest = after;
        }
        let corners: Vec<[u16; 6]> = rest
            .chunks_exact(12)
            .map(|bytes| std::array::from_fn(|i| u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]])))
            .collect();
        plan.check_corners(&corners).map_err(|error| damaged(error.to_string()))?;
        Ok(Self { plan, tiles, corners })
    }

    /// What the bake holds and what it is within.
    pub fn summary(&self) -> Summary {
        let texels: u64 = self.tiles.iter().map(|tile| u64::from(tile.there())).sum();
        let times = self.plan.times.len();
        let mut frames = vec![[0.0; 2]; times];
        let mut all = Vec::new();
        for tile in &self.tiles {
            let lines = 3.0 * f64::from(tile.there());
            for (sums, [light, square]) in frames.iter_mut().zip(&tile.light) {
                sums[0] += light;
                sums[1] += square;
                all.push(relative(*light, *square, lines));
            }
        }
        let lines = 3.0 * texels as f64;
        let of_frames = frames.iter().map(|[light, square]| relative(*light, *square, lines)).enumerate();
        let (worst_frame_number, worst_frame) =
            of_frames.fold((0, 0.0), |most, next| if next.1 > most.1 { next } else { most });
        all.sort_by(f64::total_cmp);
        let mut noises: Vec<f64> =
            self.tiles.iter().filter(|t| t.there() > 0).map(|tile| f64::from(tile.sun.noise)).collect();
        noises.sort_by(f64::total_cmp);
        let lit = self.tiles.iter().filter(|tile| tile.there() > 0);
        let images: u64 = lit.clone().map(|tile| u64::from(tile.sun.images())).sum();
        Summary {
            raw_bytes: 6 * texels * times as u64,
            bytes: self.tiles.iter().map(|tile| tile.sun.bytes() + tile.sky.bytes()).sum(),
            images: images as f64 / lit.clone().count().max(1) as f64,
            most_images: self.tiles.iter().map(|tile| tile.sun.images()).max().unwrap_or(0),
            worst_tile: self.tiles.iter().map(|tile| f64::from(tile.sun.worst)).fold(0.0, f64::max),
            worst_frame,
            worst_frame_number,
            p999: all.get((all.len() * 999 / 1000).min(all.len().saturating_sub(1))).copied().unwrap_or(0.0),
            worst_sky: self.tiles.iter().map(|tile| f64::from(tile.sky.worst)).fold(0.0, f64::max),
            noise: noises.get(noises.len() / 2).copied().unwrap_or(0.0),
        }
    }
}

fn relative(light: f64, square: f64, lines: f64) -> f64 {
    if light > 0.0 { (square / lines).sqrt() / (light / lines) } else { 0.0 }
}

/// Number of texels of a tile.
fn texels(plan: &Plan, index: u32) -> usize {
    let [_, _, columns, rows] = plan.tile(index);
    columns as usize * rows as usize
}
