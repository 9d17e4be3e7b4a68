//! Files of baked daylight: `.day`.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | `lucday\r\n` |
//! | 4 | version, 3 |
//! | 4 | bytes of the header |
//! | … | header: JSON, the [`Plan`] and the bytes of each tile |
//! | … | the tiles, one after the other ([`Tile::encode`]) |
//! | … | the bricks of probes, one after the other ([`Brick::encode`]) |
//! | … | for lightmaps: the corners of all triangles, six numbers of 16 bits each, in sixteenths of a texel |
//! | … | for lightmaps whose backs have texels: for each such back the number of its triangle, 32 bits, and its corners |
//! | 32 | BLAKE3 digest of all bytes before |
//!
//! Numbers are little-endian.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{
    Plan,
    columns::DARK,
    finish,
    lightmap::Corners,
    probes::{self, Brick},
    units,
    units::Tile,
};
use crate::{
    Error, Result,
    bake::{Digest, Store, container::Container},
    image,
};

const FILE: Container =
    Container { magic: *b"lucday\r\n", version: 3, name: "a file of baked daylight", command: "daylight bake" };
/// Largest size of a file that is read, bytes.
const MOST_BYTES: u64 = 8 << 30;

/// A whole bake.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    pub plan: Plan,
    /// Row after row.
    pub tiles: Vec<Tile>,
    /// The bricks of probes; empty if the plan has no probes.
    pub probes: Vec<Brick>,
    /// The lightmap's place of each triangle; empty for other bakes.
    pub corners: Corners,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    plan: Plan,
    /// Bytes of each tile.
    tiles: Vec<u64>,
    /// Bytes of each brick of probes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    probes: Vec<u64>,
    /// Number of triangles with corners.
    triangles: u64,
    /// Number of triangles whose backs have corners; `None`: backs show the light of the fronts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    backs: Option<u64>,
}

/// What a bake holds and what it is within.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Bytes of all frames as 16-bit floats, without the dark ones.
    pub raw_bytes: u64,
    /// Bytes of the images and coefficients.
    pub bytes: u64,
    /// Images of 16-bit floats, of signed bytes, in BC6H, and in BC5 with BC4, of all tiles.
    pub kinds: [u64; 4],
    /// Bytes of the places of triangles in the lightmap.
    pub places_bytes: u64,
    /// Mean number of images of a tile for the light of the sun.
    pub images: f64,
    /// The most images of a tile for the light of the sun.
    pub most_images: u32,
    /// The largest error of a step of the day in a tile (root mean square), relative to its mean, beside the noise.
    pub worst_tile: f64,
    /// Share of the steps of all tiles whose noise hides errors as large as the tolerance.
    pub hidden: f64,
    /// The largest difference from the baked light with its noise of a step of the day over all texels, relative to its mean, and its number.
    pub worst_frame: f64,
    pub worst_frame_number: usize,
    /// The largest difference of all but a thousandth of steps and tiles.
    pub p999: f64,
    /// The largest error of a sky that the bake guarantees.
    pub worst_sky: f64,
    /// Median over tiles of the noise of the whole day, relative to its light.
    pub noise: f64,
}

impl Stored {
    /// Joins the units of a job that are all there: filter and compression. `corners`: of the job's lightmap; `told` hears the number of
    /// finished tiles, and an error of it ends the work.
    ///
    /// # Errors
    /// `Input`, naming the file, if the folder is of another kind of job, or if a unit is missing or damaged; `OutOfMemory`; the errors of
    /// `told`.
    pub fn join(store: &Store, corners: Corners, told: impl FnMut(usize) -> Result<()>) -> Result<Self> {
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
        if job.units().count() as u64 != u64::from(plan.tile_count()) + u64::from(plan.brick_count()) {
            return Err(wrong("has another number of units than its plan has tiles and bricks of probes".into()));
        }
        let gathered = units::read(store, &plan)?;
        let tiles = finish::tiles(&plan, &gathered, told)?;
        let probes = units::read_bricks(store, &plan)?;
        Ok(Self { plan, tiles, probes, corners })
    }

    /// The bytes of a file. Equal bakes give equal bytes.
    ///
    /// # Errors
    /// `Runtime` if the header cannot be written.
    pub fn encode(&self) -> Result<Vec<u8>> {
        let tiles: Vec<Vec<u8>> = self.tiles.iter().map(Tile::encode).collect();
        let probes: Vec<Vec<u8>> = self.probes.iter().map(Brick::encode).collect();
        let lengths = |list: &[Vec<u8>]| list.iter().map(|bytes| bytes.len() as u64).collect();
        let header = Header {
            plan: self.plan.clone(),
            tiles: lengths(&tiles),
            probes: lengths(&probes),
            triangles: self.corners.fronts.len() as u64,
            backs: self.corners.backs.as_ref().map(|backs| backs.len() as u64),
        };
        let mut body: Vec<u8> = [tiles, probes].concat().concat();
        body.extend(self.corners.encode());
        FILE.encode(&header, &body)
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
        Ok((stored, Container::digest(&bytes)))
    }

    /// # Errors
    /// `Input`, saying what is wrong.
    pub fn decode(bytes: &[u8]) -> Result<Self> {
        let damaged = |what: String| FILE.damaged(what);
        let (header, mut rest) = FILE.decode(bytes, |header: &Header| {
            let plan = &header.plan;
            plan.validate().map_err(|error| damaged(format!("has an impossible plan: {error}")))?;
            let [columns, rows] = plan.tiles().map(u64::from);
            if header.tiles.len() as u64 != columns * rows {
                let what = format!("has {} tiles; its plan has {columns}×{rows}", header.tiles.len());
                return Err(damaged(what));
            }
            let bricks = plan.brick_count();
            if header.probes.len() as u64 != u64::from(bricks) {
                let what = format!("has {} bricks of probes; its plan has {bricks}", header.probes.len());
                return Err(damaged(what));
            }
            let of_corners = Corners::bytes(header.triangles, header.backs);
            let mut lengths = header.tiles.iter().chain(&header.probes);
            Ok(lengths.try_fold(of_corners, |sum, length| sum.checked_add(*length)))
        })?;
        let Header { plan, tiles: lengths, probes: brick_lengths, triangles, backs } = header;
        let mut tiles = Vec::new();
        for (index, length) in lengths.iter().enumerate() {
            let (tile, after) = rest.split_at(*length as usize);
            let [_, _, columns, rows] = plan.tile(index as u32);
            let decoded = Tile::decode(tile, &plan, (columns * rows) as usize, Some([columns, rows]));
            tiles.push(decoded.map_err(|error| error.at(format!("tiles[{index}]")))?);
            rest = after;
        }
        let mut probes = Vec::new();
        for (index, length) in brick_lengths.iter().enumerate() {
            let (brick, after) = rest.split_at(*length as usize);
            let decoded = Brick::decode(brick, &plan, of_brick(&plan, index as u32));
            probes.push(decoded.map_err(|error| error.at(format!("probes[{index}]")))?);
            rest = after;
        }
        let corners = Corners::decode(rest, triangles, backs).map_err(damaged)?;
        plan.check_corners(&corners).map_err(|error| damaged(error.to_string()))?;
        Ok(Self { plan, tiles, probes, corners })
    }

    /// What the probes are within; `None` if there are none.
    pub fn probe_summary(&self) -> Option<probes::Summary> {
        self.plan.probes.as_ref().map(|grid| probes::summary(grid, &self.probes))
    }

    /// Whether images are in blocks.
    pub fn has_blocks(&self) -> bool {
        self.tiles.iter().flat_map(Tile::layers).any(|layer| layer.in_blocks() > 0)
    }

    /// The same light without blocks ([`Layer::without_blocks`](super::layer::Layer::without_blocks)).
    #[must_use]
    pub fn without_blocks(&self) -> Self {
        let mut out = self.clone();
        out.plan.settings.format = super::Texels::Plain;
        for tile in &mut out.tiles {
            for layer in [&mut tile.sun, &mut tile.sky, &mut tile.lamps] {
                *layer = layer.without_blocks();
            }
        }
        out
    }

    /// Images of 16-bit floats, of signed bytes, in BC6H, and in BC5 with BC4, of all tiles.
    pub fn kinds(&self) -> [u64; 4] {
        let mut kinds = [0; 4];
        for layer in self.tiles.iter().flat_map(Tile::layers) {
            let [hdr, pairs] = layer.blocks.as_ref().map_or([0, 0], |blocks| [blocks.hdr, blocks.pairs]);
            let of_layer = [layer.wide, layer.narrow, hdr, pairs];
            kinds.iter_mut().zip(of_layer).for_each(|(sum, count)| *sum += u64::from(count));
        }
        kinds
    }

    /// What the bake holds and what it is within.
    pub fn summary(&self) -> Summary {
        let texels: u64 = self.tiles.iter().map(|tile| u64::from(tile.there())).sum();
        let times = self.plan.times.len();
        let mut frames = vec![[0.0; 2]; times];
        let mut all = Vec::new();
        for tile in &self.tiles {
            let lines = 3.0 * f64::from(tile.there());
            let dark = dark(&tile.light);
            for (sums, [light, square]) in frames.iter_mut().zip(&tile.light) {
                sums[0] += light;
                sums[1] += square;
                all.push(if *light > dark { relative(*light, *square, lines) } else { 0.0 });
            }
        }
        let lines = 3.0 * texels as f64;
        let dark = dark(&frames);
        let of_frames = frames.iter().enumerate().filter(|(_, [light, _])| *light > dark);
        let of_frames = of_frames.map(|(number, [light, square])| (number, relative(*light, *square, lines)));
        let (worst_frame_number, worst_frame) =
            of_frames.fold((0, 0.0), |most, next| if next.1 > most.1 { next } else { most });
        all.sort_by(f64::total_cmp);
        let mut noises: Vec<f64> =
            self.tiles.iter().filter(|t| t.there() > 0).map(|tile| f64::from(tile.sun.noise)).collect();
        noises.sort_by(f64::total_cmp);
        let lit = self.tiles.iter().filter(|tile| tile.there() > 0);
        let hidden: u64 = lit.clone().map(|tile| u64::from(tile.sun.hidden)).sum();
        let images: u64 = lit.clone().map(|tile| u64::from(tile.sun.images())).sum();
        Summary {
            raw_bytes: 6 * texels * times as u64,
            bytes: self.tiles.iter().map(|tile| tile.layers().iter().map(|layer| layer.bytes()).sum::<u64>()).sum(),
            kinds: self.kinds(),
            places_bytes: self.corners.encode().len() as u64,
            images: images as f64 / lit.clone().count().max(1) as f64,
            most_images: self.tiles.iter().map(|tile| tile.sun.images()).max().unwrap_or(0),
            worst_tile: self.tiles.iter().map(|tile| f64::from(tile.sun.worst)).fold(0.0, f64::max),
            hidden: hidden as f64 / (lit.clone().count() * times).max(1) as f64,
            worst_frame,
            worst_frame_number,
            p999: all.get((all.len() * 999 / 1000).min(all.len().saturating_sub(1))).copied().unwrap_or(0.0),
            worst_sky: self.tiles.iter().map(|tile| f64::from(tile.sky.worst)).fold(0.0, f64::max),
            noise: noises.get(noises.len() / 2).copied().unwrap_or(0.0),
        }
    }
}

/// Light of steps that have none ([`DARK`]).
fn dark(steps: &[[f64; 2]]) -> f64 {
    DARK * steps.iter().fold(0.0, |most, [light, _]| f64::max(most, *light))
}

fn relative(light: f64, square: f64, lines: f64) -> f64 {
    if light > 0.0 { (square / lines).sqrt() / (light / lines) } else { 0.0 }
}

/// Number of probes of a brick.
fn of_brick(plan: &Plan, index: u32) -> usize {
    plan.probes.as_ref().map_or(0, |grid| grid.brick(index).len())
}
