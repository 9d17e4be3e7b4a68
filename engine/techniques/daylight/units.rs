//! Bakes as jobs of [`crate::bake`]. A unit is a tile with all times of the day; its bytes are its gathered light ([`Gathered`]). When all units
//! are there, they become the compressed [`Tile`]s of a file ([`super::finish`]).

use super::{
    Plan, Sky, Texels, Transport, Weather,
    blocks::{Blocks, Coding, Layout},
    columns::{Columns, Measured},
    gathered::Gathered,
    layer::{Aim, Layer, rounded},
    light::Light,
    probes::Brick,
};
use crate::{
    Error, ErrorKind, Result,
    bake::{Job, Key, Stage, Store, UnitId},
    shaders::consts::SKY_PATCHES,
};

/// The name of such jobs.
pub const KIND: &str = "daylight";
/// Increased whenever the computation changes.
const VERSION: u32 = 12;
/// Largest number that a list in a unit may have.
const MOST_WORDS: u64 = 1 << 32;

/// The compressed light of a tile.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// Light of the sun: a dimension is a lit time of the day.
    pub sun: Layer,
    /// Light of the sky: a dimension is a patch of the sky.
    pub sky: Layer,
    /// Light of lamps: a dimension is a group of lamps.
    pub lamps: Layer,
    /// A bit for each texel, row after row: whether it is on a surface. Images have no other texels.
    pub mask: Vec<u32>,
    /// Sums of irradiance of all texels and colours for each time, by the baked light and of its squared error after compression.
    pub light: Vec<[f64; 2]>,
}

/// The job that computes a plan on a device. Its key contains the whole plan. `texels`: number of texels on surfaces of each tile, for
/// predictions of time; `None`: all.
///
/// # Errors
/// `Runtime` if the plan cannot be text.
pub fn job(plan: &Plan, device: &str, texels: Option<&[u64]>) -> Result<Job> {
    let text = |error| Error::new(ErrorKind::Runtime, "the plan of the bake cannot be text").caused_by(error);
    let about = serde_json::to_value(plan).map_err(text)?;
    let key = Key::new(KIND, VERSION).text("device", device).plan(&plan.parts, &about);
    let [columns, rows] = plan.tiles();
    let cost = |tile: u32| {
        let [_, _, columns, rows] = plan.tile(tile).map(u64::from);
        let texels = texels.map_or(columns * rows, |texels| texels.get(tile as usize).copied().unwrap_or(0));
        (texels * u64::from(plan.settings.samples)).max(1)
    };
    let probes = |brick: u32| plan.probes.as_ref().map_or(0, |grid| grid.brick(brick).len() as u64);
    let of_brick = |brick: u32| (probes(brick) * u64::from(plan.settings.probe_samples)).max(1);
    let costs = (0..columns * rows).map(cost).chain((0..plan.brick_count()).map(of_brick)).collect();
    Ok(Job::new(key, vec![Stage::new("tiles", costs)])?.about(about))
}

/// Turbidities of the clearest and of the haziest air, whose skies a bake guarantees beside those of its own weather.
const HAZES: [f64; 2] = [1.0, 10.0];

/// The skies that a bake guarantees: clear, overcast, and of the clearest and the haziest air, at up to 24 of its times, and an even sky. One row of all
/// patches for each.
///
/// # Errors
/// `Input` if the plan has impossible weather.
pub fn skies(plan: &Plan) -> Result<Vec<f32>> {
    let patches = SKY_PATCHES as usize;
    let mut rows = vec![1.0; patches];
    let step = plan.times.len().div_ceil(24).max(1);
    let suns: Vec<[f64; 3]> = plan.times.iter().step_by(step).map(|time| time.sun.map(f64::from)).collect();
    let mut add = |sky: Sky| {
        rows.extend(sky.patches().iter().map(|[r, g, b]| 0.2126 * r + 0.7152 * g + 0.0722 * b));
    };
    for sun in &suns {
        let sky = Sky::new(plan.weather, *sun).map_err(Error::input)?;
        for overcast in [0.0, 1.0] {
            add(sky.with_overcast(overcast).map_err(Error::input)?);
        }
        for turbidity in HAZES {
            let weather = Weather::new(turbidity, plan.weather.ground_albedo(), 0.0).map_err(Error::input)?;
            add(Sky::new(weather, *sun).map_err(Error::input)?);
        }
    }
    Ok(rows)
}

/// The bytes of a unit: the light of a tile with its noise, or a brick of probes.
///
/// # Errors
/// As [`Transport::tile`] and [`Gathered::new`].
pub fn unit(plan: &Plan, transport: &mut Transport, index: u32, skies: &[f32]) -> Result<Vec<u8>> {
    match index.checked_sub(plan.tile_count()) {
        Some(brick) => Ok(Brick::compress(plan, transport.brick(plan, brick)?, skies)?.encode()),
        None => Ok(gathered(plan, &transport.tile(plan, index)?, skies)?.encode()),
    }
}

/// The light of a tile with its noise.
///
/// # Errors
/// As [`Gathered::new`].
pub fn gathered(plan: &Plan, light: &Light, skies: &[f32]) -> Result<Gathered> {
    Gathered::new(plan, light, kinds(skies))
}

/// The columns of the three kinds of light that are within the tolerance.
pub(super) fn kinds(skies: &[f32]) -> [Columns<'_>; 3] {
    [Columns::Dimensions, Columns::Mixtures(skies), Columns::Dimensions]
}

/// Reads all tiles of a job, in order.
///
/// # Errors
/// `Input`, naming the file, if one is missing or damaged.
pub fn read(store: &Store, plan: &Plan) -> Result<Vec<Gathered>> {
    let tile = |index: u32| {
        let [_, _, columns, rows] = plan.tile(index);
        let texels = columns as usize * rows as usize;
        opened(store, index, |bytes| Gathered::decode(bytes, texels, plan.dimensions()))
    };
    (0..plan.tile_count()).map(tile).collect()
}

/// Reads all bricks of probes of a job, in order.
///
/// # Errors
/// `Input`, naming the file, if one is missing or damaged.
pub fn read_bricks(store: &Store, plan: &Plan) -> Result<Vec<Brick>> {
    let probes = |brick: u32| plan.probes.as_ref().map_or(0, |grid| grid.brick(brick).len());
    let brick =
        |brick: u32| opened(store, plan.tile_count() + brick, |bytes| Brick::decode(bytes, plan, probes(brick)));
    (0..plan.brick_count()).map(brick).collect()
}

fn opened<T>(store: &Store, index: u32, decode: impl Fn(&[u8]) -> Result<T>) -> Result<T> {
    let unit = UnitId { stage: 0, index };
    let payload = store.open_unit(unit)?;
    payload.verify()?;
    let again = |error: Error| error.in_file(store.path(unit)).help("Remove the file, and it is made anew");
    decode(&payload.bytes()?).map_err(again)
}

/// Compresses light as it was gathered, without a filter and without blocks.
///
/// # Errors
/// As [`Layer::compress`].
pub fn compress(plan: &Plan, light: &Light, skies: &[f32]) -> Result<Tile> {
    let measured = light.measured(plan.dimensions()).map(|light| match plan.settings.noise_floor {
        true => light,
        false => Measured { noise: &[], ..light },
    });
    let columns = kinds(skies);
    let sun = layer(plan, measured[0], columns[0], None)?;
    let (sky, lamps) = (layer(plan, measured[1], columns[1], None)?, layer(plan, measured[2], columns[2], None)?);
    let errors = errors(&sun, measured[0]);
    Ok(Tile { sun, sky, lamps, mask: light.mask.clone(), light: errors })
}

/// One kind of light of a tile, compressed within the tolerance of a plan. `layout`: the blocks of the tile; `None`: none are allowed.
///
/// # Errors
/// As [`Layer::compress`].
pub fn layer(plan: &Plan, light: Measured<'_>, columns: Columns<'_>, layout: Option<&Layout>) -> Result<Layer> {
    let most = match plan.settings.images {
        0 => light.dimensions,
        images => light.dimensions.min(images as usize),
    };
    let aim = Aim { tolerance: plan.settings.tolerance, most };
    match layout {
        None => Layer::compress(light, columns, aim),
        Some(layout) => Layer::in_these(light, columns, aim, (plan.settings.format, layout)),
    }
}

/// For each column the sum of its light and the sum of its squared errors as decoded.
pub fn errors(layer: &Layer, light: Measured<'_>) -> Vec<[f64; 2]> {
    let Measured { dimensions, rows, .. } = light;
    let texels = rows.len() / (3 * dimensions).max(1);
    (0..dimensions)
        .map(|t| {
            let coefficients = layer.mix([(t, [1.0; 3])].into_iter());
            let mut sums = [0.0, 0.0];
            for texel in 0..texels {
                for (channel, decoded) in layer.decode(texel, &coefficients).into_iter().enumerate() {
                    let truth = f64::from(rows[(3 * texel + channel) * dimensions + t]);
                    sums[0] += truth;
                    sums[1] += (f64::from(decoded) - truth).powi(2);
                }
            }
            sums
        })
        .collect()
}

impl Tile {
    /// Light of the sun, of the sky, of lamps.
    pub fn layers(&self) -> [&Layer; 3] {
        [&self.sun, &self.sky, &self.lamps]
    }

    /// Number of texels that are on a surface.
    pub fn there(&self) -> u32 {
        self.mask.iter().map(|word| word.count_ones()).sum()
    }

    /// The bytes of a unit: numbers with their low byte first.
    pub fn encode(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.extend_from_slice(&(self.mask.len() as u32).to_le_bytes());
        self.mask.iter().for_each(|word| out.extend_from_slice(&word.to_le_bytes()));
        out.extend_from_slice(&(self.light.len() as u32).to_le_bytes());
        self.light.iter().flatten().for_each(|value| out.extend_from_slice(&value.to_le_bytes()));
        for layer in self.layers() {
            for number in [layer.dimensions, layer.wide, layer.narrow, layer.worst_dimension, layer.hidden] {
                out.extend_from_slice(&number.to_le_bytes());
            }
            for number in [layer.worst, layer.noise] {
                out.extend_from_slice(&number.to_le_bytes());
            }
            if let Some(blocks) = &layer.blocks {
                [blocks.hdr, blocks.pairs].iter().for_each(|count| out.extend_from_slice(&count.to_le_bytes()));
            }
            out.extend_from_slice(&(layer.words.len() as u64).to_le_bytes());
            layer.table.iter().for_each(|value| out.extend_from_slice(&rounded(*value).to_le_bytes()[1..]));
            layer.words.iter().for_each(|word| out.extend_from_slice(&word.to_le_bytes()));
            out.extend_from_slice(layer.blocks.as_ref().map_or(&[], |blocks| &blocks.bytes));
        }
        out
    }

    /// Reads the bytes of a unit for a tile of `texels` texels. `extent`: columns and rows of a tile that may have blocks.
    ///
    /// # Errors
    /// `Input` if they are not those of a tile of the plan.
    pub fn decode(bytes: &[u8], plan: &Plan, texels: usize, extent: Option<[u32; 2]>) -> Result<Self> {
        let mut rest = Rest(bytes);
        let words = rest.word()? as usize;
        if words != texels.div_ceil(32) {
            return Err(Error::input(format!("a mask of {words} words for {texels} texels")));
        }
        let mask = (0..words).map(|_| rest.word()).collect::<Result<Vec<_>>>()?;
        check_mask(&mask, texels)?;
        let there: u32 = mask.iter().map(|word| word.count_ones()).sum();
        let times = rest.word()? as usize;
        let [dimensions, patches, lamps] = plan.dimensions();
        if times != dimensions {
            return Err(Error::input(format!("a tile with {times} times, {dimensions} are needed")));
        }
        let light = (0..times).map(|_| Ok([rest.double()?, rest.double()?])).collect::<Result<Vec<_>>>()?;
        let layout = extent.filter(|_| plan.settings.format != Texels::Plain).map(|extent| Layout::new(&mask, extent));
        let layout = layout.as_ref();
        let sun = rest.layer(layout)?;
        let sky = rest.layer(layout)?;
        let groups = lamps;
        let lamps = rest.layer(layout)?;
        sun.validate(there as usize, dimensions).map_err(|error| error.at("light of the sun"))?;
        sky.validate(there as usize, patches).map_err(|error| error.at("light of the sky"))?;
        lamps.validate(there as usize, groups).map_err(|error| error.at("light of lamps"))?;
        match rest.0.is_empty() {
            true => Ok(Self { sun, sky, lamps, mask, light }),
            false => Err(Error::input("a tile with something after its end")),
        }
    }
}

/// Checks that a mask has no bits beyond its texels.
///
/// # Errors
/// `Input` if it has.
pub(super) fn check_mask(mask: &[u32], texels: usize) -> Result<()> {
    match mask.last().is_some_and(|word| !texels.is_multiple_of(32) && word >> (texels % 32) != 0) {
        true => Err(Error::input("a mask with bits beyond its texels")),
        false => Ok(()),
    }
}

/// Bytes that are read from the front.
pub(super) struct Rest<'a>(pub &'a [u8]);

impl<'a> Rest<'a> {
    pub fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        if self.0.len() < count {
            return Err(Error::input("a tile that is cut off"));
        }
        let (head, tail) = self.0.split_at(count);
        self.0 = tail;
        Ok(head)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut out = [0; N];
        out.copy_from_slice(self.take(N)?);
        Ok(out)
    }

    pub fn word(&mut self) -> Result<u32> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    pub fn float(&mut self) -> Result<f32> {
        Ok(f32::from_le_bytes(self.array()?))
    }

    fn double(&mut self) -> Result<f64> {
        Ok(f64::from_le_bytes(self.array()?))
    }

    fn length(&mut self) -> Result<usize> {
        let length = u64::from_le_bytes(self.array()?);
        match length.checked_mul(4).is_some_and(|bytes| bytes <= self.0.len() as u64) && length < MOST_WORDS {
            true => Ok(length as usize),
            false => Err(Error::input("a tile that is cut off")),
        }
    }

    /// `layout`: the blocks of the tile, if it may have any.
    fn layer(&mut self, layout: Option<&Layout>) -> Result<Layer> {
        let mut number = || self.word();
        let [dimensions, wide, narrow, worst_dimension, hidden] =
            [number()?, number()?, number()?, number()?, number()?];
        let [worst, noise] = [self.float()?, self.float()?];
        let [hdr, pairs] = if layout.is_some() { [self.word()?, self.word()?] } else { [0, 0] };
        let words = self.length()?;
        if [wide, narrow, hdr, pairs].iter().any(|count| *count > dimensions) {
            let what = format!("{wide}, {narrow}, {hdr} and {pairs} images of {dimensions} dimensions");
            return Err(Error::input(what));
        }
        let images = [wide, narrow, hdr, pairs].iter().map(|count| *count as usize).sum::<usize>();
        let table = self.take(images.saturating_mul(3 * dimensions as usize))?.chunks_exact(3);
        let table = table.map(|bytes| f32::from_le_bytes([0, bytes[0], bytes[1], bytes[2]])).collect();
        let words = (0..words).map(|_| self.word()).collect::<Result<_>>()?;
        let blocks = match layout {
            None => None,
            Some(layout) => {
                let of = |coding, count: u32| layout.bytes(coding).saturating_mul(count as usize);
                let bytes = self.take(of(Coding::Hdr, hdr).saturating_add(of(Coding::Pair, pairs)))?;
                Some(Blocks::read(hdr, pairs, bytes.to_vec(), layout)?)
            }
        };
        Ok(Layer { dimensions, wide, narrow, table, words, blocks, worst, worst_dimension, hidden, noise })
    }
}
