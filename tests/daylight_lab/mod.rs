//! Bakes without a baking: made-up images, so that tests and benchmarks of the run time need no paths. And what tests of bakes share: a whole
//! bake in memory, and a program that renders frames.
#![allow(dead_code)]

use half::f16;
use lucerna::{
    Result,
    gpu::Gpu,
    graph::{Graph, Runner},
    image::Layers,
    scene::{Pose, Scene, View},
    technique::{Ready, Shot},
    techniques::daylight::{
        Baked, Baking, Calendar, Day, Daylight, Kind, Light, Lit, PictureSettings, Plan, Sources, Stored, Transport,
        Weather, finish,
        layer::Layer,
        lightmap::Corners,
        parts,
        probes::Brick,
        units::{self, Tile},
    },
};

/// Images for the light of the sky.
pub const SKY_IMAGES: u32 = 3;

/// A number from 0 to 1 that looks random.
fn hashed(seed: u32) -> f32 {
    let mut x = seed.wrapping_mul(0x9E37_79B9) ^ 0x85EB_CA6B;
    x = (x ^ x >> 16).wrapping_mul(0x7FEB_352D);
    x = (x ^ x >> 15).wrapping_mul(0x846C_A68B);
    ((x ^ x >> 16) >> 8) as f32 / 16_777_216.0
}

/// One wide image of positive values, the rest narrow. Coefficients are smooth in the dimension.
fn layer(texels: u32, dimensions: u32, images: u32, seed: u32) -> Layer {
    let (wide, narrow) = (images.min(1), images.saturating_sub(1));
    let stride = Layer::stride(wide, narrow) as usize;
    let mut words = Vec::with_capacity(texels as usize * stride);
    for texel in 0..texels {
        let mut bytes = Vec::with_capacity(4 * stride);
        let value = |i: u32| hashed(seed ^ (texel * 4096 + i));
        for channel in 0..3 * wide {
            bytes.extend_from_slice(&f16::from_f32(0.4 + 0.6 * value(channel)).to_le_bytes());
        }
        for i in 0..3 * narrow {
            bytes.push((127.0 * (2.0 * value(3 + i) - 1.0)) as i8 as u8);
        }
        bytes.resize(4 * stride, 0);
        words.extend(bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])));
    }
    let along = |image: u32, t: u32| {
        let x = (t as f32 + 0.5) / dimensions as f32;
        let day = (std::f32::consts::PI * x).sin();
        match image {
            0 => 0.02 + 0.3 * day,
            image => 0.1 / 127.0 / images as f32 * day * (x * 7.0 * image as f32).cos(),
        }
    };
    let table = (0..images).flat_map(|image| (0..dimensions).map(move |t| along(image, t))).collect();
    Layer {
        dimensions,
        wide,
        narrow,
        table,
        words,
        blocks: None,
        worst: 0.0,
        worst_dimension: 0,
        hidden: 0,
        noise: 0.0,
    }
}

/// The day of [`stored`]: polar day, so that the sun shines over midnight, too.
pub fn polar_day() -> Calendar {
    Calendar {
        date: "2026-06-21".into(),
        zone: "Europe/Oslo".into(),
        latitude: 78.2,
        longitude: 15.6,
        ..Calendar::default()
    }
}

pub fn day(calendar: &Calendar) -> Day {
    Day::new(&calendar.date, &calendar.zone, calendar.latitude, calendar.longitude).unwrap()
}

/// A bake of a view with `images` images for the light of the sun in each tile; all pixels are on a surface.
pub fn stored(scene: &Scene, view: &View, calendar: Calendar, interval: f64, offset: f64, images: u32) -> Stored {
    let day = day(&calendar);
    let steps = day.steps(interval, offset).unwrap();
    let lit = steps.iter().filter(|seconds| day.sun(**seconds).elevation > -0.2665);
    let times: Vec<Lit> =
        lit.map(|&seconds| Lit { seconds, sun: day.sun(seconds).direction(calendar.north) }).collect();
    let plan = Plan {
        scene: "lab".into(),
        parts: parts(scene),
        receivers: Kind::View {
            camera: "eye".into(),
            view_from_world: view.view_from_world.to_cols_array(),
            clip_from_view: view.clip_from_view.to_cols_array(),
        },
        extent: view.extent,
        probes: None,
        lamps: Vec::new(),
        calendar,
        steps: steps.len() as u32,
        times,
        weather: Weather::default(),
        settings: Baking { interval, offset, tile: 16, ..Baking::default() },
    };
    let [columns, rows] = plan.tiles();
    let [dimensions, patches, _] = plan.dimensions().map(|count| count as u32);
    let tiles = (0..columns * rows).map(|index| {
        let [_, _, columns, rows] = plan.tile(index);
        let texels = columns * rows;
        let bits = |word: u32| if 32 * word + 32 <= texels { u32::MAX } else { (1 << (texels % 32)) - 1 };
        Tile {
            sun: layer(texels, dimensions, images, 2 * index + 1),
            sky: layer(texels, patches, SKY_IMAGES, 2 * index),
            lamps: layer(texels, 0, 0, 0),
            mask: (0..texels.div_ceil(32)).map(bits).collect(),
            light: vec![[1.0, 0.0]; dimensions as usize],
        }
    });
    let tiles = tiles.collect();
    Stored { plan, tiles, probes: Vec::new(), corners: Corners::default() }
}

/// The light of all tiles before filter and compression.
pub fn lights(gpu: &Gpu, scene: &Scene, plan: &Plan, sources: Sources) -> Vec<Light> {
    let mut transport = Transport::new(gpu, scene, plan, sources).unwrap();
    (0..plan.tile_count()).map(|tile| transport.tile(plan, tile).unwrap()).collect()
}

/// A bake, filtered and compressed as a file has it.
pub fn baked(gpu: &Gpu, scene: &Scene, plan: Plan, sources: Sources) -> Stored {
    baked_with(gpu, scene, plan, sources, |_| (), |_| ())
}

/// The same with changes of the light of tiles and of bricks before they are compressed.
pub fn baked_with(
    gpu: &Gpu,
    scene: &Scene,
    plan: Plan,
    sources: Sources,
    of_tile: impl Fn(&mut Light),
    of_brick: impl Fn(&mut Light),
) -> Stored {
    let skies = units::skies(&plan).unwrap();
    let mut transport = Transport::new(gpu, scene, &plan, sources).unwrap();
    let mut gathered = Vec::new();
    for tile in 0..plan.tile_count() {
        let mut light = transport.tile(&plan, tile).unwrap();
        of_tile(&mut light);
        gathered.push(units::gathered(&plan, &light, &skies).unwrap());
    }
    let tiles = finish::tiles(&plan, &gathered, |_| Ok(())).unwrap();
    let mut probes = Vec::new();
    for index in 0..plan.brick_count() {
        let mut brick = transport.brick(&plan, index).unwrap();
        of_brick(&mut brick.light);
        probes.push(Brick::compress(&plan, brick, &skies).unwrap());
    }
    Stored { plan, tiles, probes, corners: Corners::default() }
}

/// A program that renders frames.
pub struct Studio {
    scene: Scene,
    view: View,
    ready: Ready<Daylight>,
    runner: Runner,
}

impl Studio {
    pub fn new(gpu: &Gpu, scene: Scene, view: View, baked: &Baked) -> Self {
        Self::with(gpu, scene, view, baked, &PictureSettings::default())
    }

    pub fn with(gpu: &Gpu, scene: Scene, view: View, baked: &Baked, settings: &PictureSettings) -> Self {
        let ready = Ready::new(gpu, &scene, settings, Some(baked), &mut |_, _| true).unwrap();
        Self { scene, view, ready, runner: Runner::new(gpu) }
    }

    /// The layers and the numbers of a frame.
    pub fn frame(&mut self, frame: u32, settings: &PictureSettings) -> Result<(Layers, Vec<(&'static str, f64)>)> {
        let mut graph = Graph::new("daylight");
        graph.frame = frame;
        let pose = Pose::rest(&self.scene);
        let picture = self.ready.frame(&mut graph, (&self.scene, &pose), &self.view, Shot::default(), settings)?;
        let reading = picture.read(&mut graph, true, false);
        let result = self.runner.run(&graph)?;
        Ok((reading.layers(&result), reading.numbers(&result)))
    }

    pub fn irradiance(&mut self, settings: &PictureSettings) -> Vec<[f32; 3]> {
        self.frame(0, settings).unwrap().0.layer("irradiance").unwrap().rgb_pixels().unwrap()
    }
}
