//! Images in blocks: the tolerance after decoding, signs, bytes of files, and the textures of the device.

use std::sync::Arc;

use crate::{
    daylight_lab::{Studio, baked, lights},
    daylight_light::{eye, plan, stage},
    tracer_lab::Stage,
};
use glam::vec3;
use lucerna::{
    gpu::testing::with_gpu,
    techniques::daylight::{
        Baked, Baking, Group, Interpolation, PictureSettings, Plan, Sampling, Sources, Stored, Texels,
        blocks::{Blocks, Layout},
        columns::{Columns, Measured},
        finish,
        layer::{Aim, Layer},
        lightmap::Corners,
        units,
    },
};

/// Columns of the light, and the side of a tile.
const TIMES: usize = 48;
const SIDE: u32 = 24;

/// A tile with a hole, and light of several vectors: positive, with a soft edge that moves, and a hundred-thousandth as bright at dusk.
fn tile() -> (Layout, Vec<f32>) {
    let there = |x: u32, y: u32| !(9..14).contains(&x) || !(3..17).contains(&y);
    let mut mask = vec![0u32; (SIDE * SIDE).div_ceil(32) as usize];
    let mut rows = Vec::new();
    for texel in 0..SIDE * SIDE {
        let [x, y] = [texel % SIDE, texel / SIDE];
        if !there(x, y) {
            continue;
        }
        mask[texel as usize / 32] |= 1 << (texel % 32);
        let [u, v] = [x, y].map(|at| at as f32 / SIDE as f32);
        for channel in 0..3 {
            for t in 0..TIMES {
                let day = (t as f32 + 0.5) / TIMES as f32;
                let sun = (std::f32::consts::PI * day).sin().powi(4).max(1e-5);
                // A shadow that moves over the tile.
                let edge = 1.0 / (1.0 + (-12.0 * (u - day + 0.2 * v)).exp());
                let colour = 1.0 + 0.3 * channel as f32 * (v - 0.5);
                rows.push(sun * colour * (0.3 + edge + 0.2 * (5.0 * u * day).cos()));
            }
        }
    }
    (Layout::new(&mask, [SIDE; 2]), rows)
}

/// The largest error of a column (root mean square), relative to its mean, as the layer decodes it.
fn worst(layer: &Layer, rows: &[f32]) -> f64 {
    let texels = rows.len() / TIMES / 3;
    (0..TIMES)
        .map(|t| {
            let coefficients = layer.mix([(t, [1.0; 3])].into_iter());
            let (mut square, mut mean) = (0.0, 0.0);
            for texel in 0..texels {
                for (channel, found) in layer.decode(texel, &coefficients).into_iter().enumerate() {
                    let truth = f64::from(rows[(3 * texel + channel) * TIMES + t]);
                    square += (f64::from(found) - truth).powi(2);
                    mean += truth;
                }
            }
            let lines = 3.0 * texels as f64;
            (square / lines).sqrt() / (mean / lines)
        })
        .fold(0.0, f64::max)
}

fn light(rows: &[f32]) -> Measured<'_> {
    Measured { dimensions: TIMES, rows, noise: &[] }
}

#[test]
fn every_time_that_is_decoded_from_blocks_is_within_the_tolerance() {
    let (layout, rows) = tile();
    for tolerance in [0.3, 0.1, 0.05, 0.02, 0.005] {
        let aim = Aim { tolerance, most: TIMES };
        let plain = Layer::compress(light(&rows), Columns::Dimensions, aim).unwrap();
        for texels in [Texels::Bc5, Texels::Bc6h, Texels::Blocks] {
            let layer = Layer::in_these(light(&rows), Columns::Dimensions, aim, (texels, &layout)).unwrap();
            let found = worst(&layer, &rows);
            let blocks = layer.blocks.clone().unwrap();
            eprintln!(
                "{tolerance}, {texels:?}: {found:.4}, {} bytes of {}, {} + {} plain, {} BC6H, {} BC5 and BC4",
                layer.bytes(),
                plain.bytes(),
                layer.wide,
                layer.narrow,
                blocks.hdr,
                blocks.pairs
            );
            assert!(found <= 1.001 * tolerance, "{tolerance}, {texels:?}: {found}");
            assert!((found - f64::from(layer.worst)).abs() < 1e-3, "{found} {}", layer.worst);
            assert!(layer.bytes() <= plain.bytes());
            layer.validate(rows.len() / TIMES / 3, TIMES).unwrap();
            // Without blocks it is the same light up to the rounding of sums.
            let read = layer.without_blocks();
            assert!(read.blocks.is_none() && read.images() == layer.images());
            for t in [0, 7, 24] {
                let [a, b] = [&layer, &read].map(|layer| layer.mix([(t, [1.0, 0.5, 2.0])].into_iter()));
                for texel in [0, 17, 300] {
                    let [a, b] = [layer.decode(texel, &a), read.decode(texel, &b)];
                    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-5 * a.abs().max(1e-6)), "{a:?} {b:?}");
                }
            }
        }
    }
    // At the tolerance of the project's target, blocks hold the images.
    let aim = Aim { tolerance: 0.05, most: TIMES };
    let plain = Layer::compress(light(&rows), Columns::Dimensions, aim).unwrap();
    let layer = Layer::in_these(light(&rows), Columns::Dimensions, aim, (Texels::Blocks, &layout)).unwrap();
    assert!(layer.in_blocks() > 0 && layer.bytes() < plain.bytes());
    // Images of principal components have both signs.
    let blocks = layer.blocks.as_ref().unwrap();
    let values = (0..blocks.images()).flat_map(|image| (0..blocks.texels()).map(move |texel| (image, texel)));
    let values: Vec<f32> = values.flat_map(|(image, texel)| blocks.value(texel, image)).map(|v| v.to_f32()).collect();
    assert!(values.iter().any(|v| *v < -0.1) && values.iter().any(|v| *v > 0.1));
}

#[test]
fn light_that_blocks_cannot_hold_stays_plain() {
    // Noise from texel to texel.
    let (layout, mut rows) = tile();
    let mut state = 1u32;
    for row in rows.chunks_exact_mut(TIMES) {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let value = (state >> 8) as f32 / (1 << 24) as f32;
        row.iter_mut().for_each(|light| *light *= value);
    }
    let aim = Aim { tolerance: 0.003, most: TIMES };
    let layer = Layer::in_these(light(&rows), Columns::Dimensions, aim, (Texels::Bc6h, &layout)).unwrap();
    assert!(worst(&layer, &rows) <= 1.001 * 0.003);
    assert_eq!(layer.blocks, Some(Blocks::default()));
    let plain = Layer::compress(light(&rows), Columns::Dimensions, aim).unwrap();
    assert_eq!(Layer { blocks: None, ..layer }, plain);
}

fn of_format(format: Texels) -> Baking {
    Baking { samples: 16, bounces: 3, tolerance: 0.05, tile: 18, noise_floor: false, format, ..Baking::default() }
}

#[test]
fn a_bake_in_blocks_comes_back_from_its_file_and_lights_pictures_as_one_without() {
    with_gpu(|gpu| {
        let mut stage = Stage { scene: stage() };
        stage.point(vec3(0.5, 1.5, 0.8), vec3(3.0, 2.0, 1.0));
        let (scene, eye) = (stage.scene, eye());
        let group = Group { name: "all".into(), lights: vec![0], materials: Vec::new() };
        let of = |format| Plan { lamps: vec![group.clone()], ..plan(&scene, &eye, of_format(format)) };
        let source = || Sources::View(Box::new(eye));
        let plain = baked(gpu, &scene, of(Texels::Plain), source());
        let skies = units::skies(&plain.plan).unwrap();
        let gathered: Vec<_> = lights(gpu, &scene, &plain.plan, source())
            .iter()
            .map(|light| units::gathered(&plain.plan, light, &skies).unwrap())
            .collect();
        for format in [Texels::Bc5, Texels::Bc6h, Texels::Blocks] {
            let plan = of(format);
            let tiles = finish::tiles(&plan, &gathered, |_| Ok(())).unwrap();
            let stored = Stored { plan, tiles, probes: Vec::new(), corners: Corners::default() };
            let (ours, theirs) = (stored.summary(), plain.summary());
            eprintln!(
                "{format:?}: {} bytes of {}, {:?}, worst {}",
                ours.bytes, theirs.bytes, ours.kinds, ours.worst_tile
            );
            assert!(stored.has_blocks() && ours.bytes < theirs.bytes && ours.worst_tile <= 0.0501, "{ours:?}");
            let bytes = stored.encode().unwrap();
            assert!(Stored::decode(&bytes).unwrap() == stored);
            for length in (0..bytes.len()).step_by(997) {
                assert!(Stored::decode(&bytes[..length]).is_err());
            }
            // Textures of the device against the processor's decoder.
            let read = stored.without_blocks();
            assert!(!read.has_blocks());
            let picture = |stored: Stored, settings: &PictureSettings| {
                let baked = Baked { stored: Arc::new(stored), frames: None, stream: None, file: None, digest: None };
                Studio::with(gpu, scene.clone(), eye, &baked, settings).irradiance(settings)
            };
            let mut settings = PictureSettings::default();
            settings.daylight.time = "10:20".into();
            settings.daylight.lamps = "on".into();
            for interpolation in [Interpolation::Linear, Interpolation::LogLinear] {
                settings.daylight.interpolation = interpolation;
                // Lavapipe rounds what it reads from BC4 and BC5 to 8 bits, so there decoded blocks are the default.
                for (sampling, share) in [(Sampling::Decoded, 1e-3), (Sampling::Textures, 1.0 / 64.0)] {
                    settings.daylight.blocks = sampling;
                    if sampling == Sampling::Textures && !gpu.caps().compressed_bc {
                        continue;
                    }
                    let [a, b] = [stored.clone(), read.clone()].map(|stored| picture(stored, &settings));
                    let mean = b.iter().flatten().sum::<f32>() / (3 * b.len()) as f32;
                    assert!(mean > 0.0);
                    let apart = |(a, b): (&f32, &f32)| f64::from(a - b).powi(2);
                    let square: f64 = a.iter().flatten().zip(b.iter().flatten()).map(apart).sum();
                    let error = (square / (3 * b.len()) as f64).sqrt() / f64::from(mean);
                    eprintln!("{format:?}, {interpolation:?}, {sampling:?}: {error:.5} of the mean");
                    for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                        let most = share * (b.abs() + mean);
                        assert!((a - b).abs() <= most, "{interpolation:?}, {sampling:?}: {a} {b}, mean {mean}");
                    }
                }
            }
        }
    });
}
