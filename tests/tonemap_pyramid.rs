//! How far `local = "pyramid"` is from the definition: averages, and the pictures they lead to. Both on the CPU, in 64 bits.
//!
//! `cargo test --test tonemap tonemap_pyramid -- --nocapture` prints the table for parts of photographs;
//! `cargo test --release --test tonemap tonemap_pyramid -- --ignored --nocapture` for whole ones.

use crate::common;
use std::path::Path;

use lucerna::{
    image,
    measure::{Options, Pair, Picture, flip},
    reference::tonemap::{self as twin, ashikhmin, pyramid},
    techniques::tonemap::{Local, Operator, Settings},
};

struct Photograph {
    width: u32,
    height: u32,
    pixels: Vec<[f32; 3]>,
}

/// The middle of a photograph, at most `most` pixels wide and high.
fn photograph(path: &Path, most: u32) -> Photograph {
    let layers = image::read(path, &Default::default()).unwrap();
    let all = layers.main().unwrap().rgb_pixels().unwrap();
    let (width, height) = (layers.width.min(most), layers.height.min(most));
    let (left, top) = ((layers.width - width) / 2, (layers.height - height) / 2);
    let at = |i: u32| all[((top + i / width) * layers.width + left + i % width) as usize];
    Photograph { width, height, pixels: (0..width * height).map(at).collect() }
}

/// Mean relative error of each radius' averages, the largest of them. Averages below 1e-4 of the mean count as that.
fn averages(photograph: &Photograph) -> f64 {
    let Photograph { width, height, ref pixels } = *photograph;
    let luminance = twin::plane::luminance(width as usize, height as usize, pixels);
    // In black places any light that a wider average brings is infinitely more.
    let black = 1e-4 * luminance.values.iter().sum::<f64>() / luminance.values.len() as f64;
    let error = |radius: usize| {
        let weights = ashikhmin::Search::weights(radius);
        let exact = luminance.averages(&weights);
        let found = pyramid::averages(&luminance, radius as f64 / 2.0, &weights);
        let errors = exact.values.iter().zip(&found.values).map(|(e, f)| (f - e).abs() / e.max(black));
        errors.sum::<f64>() / exact.values.len() as f64
    };
    [1, 2, 3, 5, 6, 7, 10, 14, 20].map(error).into_iter().fold(0.0, f64::max)
}

/// RMS % and mean % of luminance, and FLIP.
fn pictures(photograph: &Photograph, operator: Operator) -> [f64; 3] {
    let Photograph { width, height, ref pixels } = *photograph;
    let of = |local| {
        let settings = Settings { operator, local, ..Settings::paper() };
        twin::tonemap(width, height, pixels, &settings)
    };
    let (exact, found) = (of(Local::Literal), of(Local::Pyramid));
    let (mut squares, mut sum) = (0.0, 0.0);
    for (e, f) in exact.iter().zip(&found) {
        let [e, f] = [*e, *f].map(twin::plane::luminance_of);
        let error = (f - e) / e.max(1.0 / 65535.0);
        (squares, sum) = (squares + error * error, sum + error.abs());
    }
    let count = pixels.len() as f64;
    let [exact, found] = [exact, found].map(|p| Picture::new(width, height, p).unwrap());
    let flip = flip::flip(&Pair::new(&exact, &found).unwrap(), &Options::default()).unwrap().value;
    [100.0 * f64::sqrt(squares / count), 100.0 * sum / count, flip]
}

/// Averages, RMS %, mean %, FLIP.
const BOUNDS: [f64; 4] = [0.05, 6.0, 1.5, 0.02];

fn compare(assets: &Path, most: u32) {
    for name in ["StillLife.exr", "memorial_o876.hdr", "Desk.exr"] {
        let photograph = photograph(&assets.join("hdr").join(name), most);
        let mean = averages(&photograph);
        println!("{name:20} {}×{}: averages {:.2} %", photograph.width, photograph.height, 100.0 * mean);
        assert!(mean < BOUNDS[0], "{name}: averages differ by {mean}");
        for operator in [Operator::Ashikhmin, Operator::Reinhard] {
            let [rms, mean, flip] = pictures(&photograph, operator);
            println!("{name:20} {:10} RMS {rms:.2} %, mean {mean:.2} %, FLIP {flip:.4}", operator.name());
            assert!(
                rms < BOUNDS[1] && mean < BOUNDS[2] && flip < BOUNDS[3],
                "{name} {operator:?}: {rms} {mean} {flip}"
            );
        }
    }
}

#[test]
fn pictures_are_near_the_definition() {
    let Some(assets) = common::assets() else { return };
    compare(&assets, 160);
}

#[test]
#[ignore = "whole photographs take minutes without optimisation"]
fn whole_pictures_are_near_the_definition() {
    let Some(assets) = common::assets() else { return };
    compare(&assets, 100_000);
}

/// What is even or a slope stays so: weights add up to 1, and levels are not shifted.
#[test]
fn planes_and_slopes_are_kept() {
    use twin::plane::Plane;
    let slope = Plane::from_fn(150, 131, |x, y| 5.0 + 0.25 * x as f64 + 0.5 * y as f64);
    for radius in [1, 3, 6, 7, 20, 32] {
        let found = pyramid::averages(&slope, radius as f64 / 2.0, &ashikhmin::Search::weights(radius));
        for (x, y) in [(64, 64), (65, 67), (78, 66), (75, 65)] {
            let error = found[(x, y)] - slope[(x, y)];
            assert!(error.abs() < 1e-9, "radius {radius} at {x}, {y}: {error}");
        }
    }
}
