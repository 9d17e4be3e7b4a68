//! Tone mapping against the values of independent programs, recorded in agreement/tonemap.tsv by
//! agreement/regenerate_tonemap.py.
//!
//! `cargo test --test tonemap_agreement -- --nocapture` prints how far they are apart.

mod common;

use std::{collections::BTreeMap, fs, path::Path};

use lucerna::{
    image::{self, Layers},
    reference::tonemap::{ashikhmin, plane, plane::Plane, reinhard, statistics},
    scene::Limits,
};

/// Crops of photographs: name, file, left, top.
const CROPS: [(&str, &str, usize, usize); 3] = [
    ("desk", "hdr/Desk.exr", 250, 260),
    ("memorial", "hdr/memorial_o876.hdr", 180, 380),
    ("stilllife", "hdr/StillLife.exr", 300, 420),
];
const SIZE: [usize; 2] = [192, 144];
/// The recorded pixels are STEP apart.
const STEP: usize = 12;

/// The luminances that all programs are given: no negative values, and black in the corner, for Luminance HDR takes the darkest
/// luminance to be 0 whatever is in the image. Grey, for it clips saturated colours when it writes.
fn crop(assets: &Path, file: &str, left: usize, top: usize) -> Vec<[f32; 3]> {
    let picture = image::read(assets.join(file), &Limits::default()).unwrap();
    let pixels = picture.main().unwrap().rgb_pixels().unwrap();
    let width = picture.width as usize;
    let at = |i: usize| {
        let luminance = plane::luminance_of(pixels[(top + i / SIZE[0]) * width + left + i % SIZE[0]]);
        [luminance.max(0.0) as f32; 3]
    };
    let mut crop: Vec<[f32; 3]> = (0..SIZE[0] * SIZE[1]).map(at).collect();
    crop[0] = [0.0; 3];
    crop
}

/// What the program of the second column computes, by our twin, in the form that the program writes.
fn ours(operator: &str, luminance: &Plane) -> Plane {
    let (low, high) = luminance.range().unwrap();
    let curve = ashikhmin::Curve { low, high, display: 100.0 };
    let search = ashikhmin::Search { largest: 10, contrast: 0.5 };
    let average = statistics::log_average(&luminance.values, 1e-5);
    let scales = reinhard::Scales { count: 8, key: 0.18, phi: 8.0, epsilon: 0.05 };
    let scaled = luminance.map(|l| l * scales.key / average);
    let with = |level: &Plane, f: &(dyn Fn(f64, f64) -> f64 + Sync)| {
        Plane::from_fn(luminance.width, luminance.height, |x, y| f(luminance[(x, y)], level[(x, y)]))
    };
    // Luminance HDR divides by the largest value it finds.
    let normal = |plane: Plane| {
        let largest = plane.range().unwrap().1;
        plane.map(|v| v / largest)
    };
    match operator {
        "luminance" => luminance.clone(),
        "ashikhmin-global" => luminance.map(|l| curve.display(l, l) / curve.display),
        "ashikhmin-adaptation" => search.adaptation(luminance),
        "ashikhmin-local" => with(&search.adaptation(luminance), &|l, a| curve.display(l, a) / curve.display),
        "ashikhmin-eq2" => {
            let level = search.adaptation(luminance).map(|a| if a == 0.0 { 1e-5 } else { a });
            normal(with(&level, &|l, a| l * curve.map(a) / a))
        }
        "ashikhmin-eq4" => {
            let level = search.adaptation(luminance).map(|a| if a == 0.0 { 1e-5 } else { a });
            let capacity = ashikhmin::capacity;
            normal(with(&level, &|l, a| curve.map(a) + capacity(curve.map(a)) / capacity(a) * (l - a)))
        }
        "reinhard-global" => {
            let white = scaled.range().unwrap().1;
            scaled.map(|l| reinhard::global(l, white))
        }
        "reinhard-local" => {
            let level = scales.adaptation(&scaled);
            Plane::from_fn(scaled.width, scaled.height, |x, y| reinhard::local(scaled[(x, y)], level[(x, y)]))
        }
        _ => panic!("no operator is called {operator}"),
    }
}

/// Largest RMS % and mean % (Michael 2010, equations 18 and 19) that are accepted.
fn tolerance(operator: &str, program: &str) -> [f64; 2] {
    match (program.starts_with("Luminance"), operator) {
        (false, _) => [1e-4, 1e-4],
        (true, "ashikhmin-global" | "reinhard-global") => [1e-3, 1e-3],
        _ => [1e9, 1e9],
    }
}

#[test]
fn agrees_with_independent_programs() {
    let Some(assets) = common::assets() else { return };
    let crops: BTreeMap<&str, Vec<[f32; 3]>> =
        CROPS.iter().map(|(name, file, left, top)| (*name, crop(&assets, file, *left, *top))).collect();
    if let Some(folder) = std::env::var_os("LUCERNA_WRITE_CROPS") {
        fs::create_dir_all(&folder).unwrap();
        for (name, pixels) in &crops {
            let picture = Layers::rgb(SIZE[0] as u32, SIZE[1] as u32, pixels.as_flattened().to_vec());
            let options = image::WriteOptions { overwrite: true, ..Default::default() };
            image::write(Path::new(&folder).join(format!("{name}.pfm")), &picture, &options).unwrap();
        }
        return;
    }
    let mut wrong = Vec::new();
    let mut computed: BTreeMap<(&str, &str), Plane> = BTreeMap::new();
    for line in include_str!("agreement/tonemap.tsv").lines().skip(1) {
        let columns: Vec<&str> = line.split('\t').collect();
        let [name, operator, _, program, values] = columns[..] else { panic!("{line}") };
        let ours = computed
            .entry((name, operator))
            .or_insert_with(|| ours(operator, &plane::luminance(SIZE[0], SIZE[1], &crops[name])));
        let places =
            (STEP / 2..SIZE[1]).step_by(STEP).flat_map(|y| (STEP / 2..SIZE[0]).step_by(STEP).map(move |x| (x, y)));
        let values: Vec<f64> = values.split(' ').map(|v| v.parse().unwrap()).collect();
        let errors: Vec<f64> = places.zip(&values).map(|(at, theirs)| (ours[at] - theirs) / theirs).collect();
        assert_eq!(errors.len(), values.len());
        let n = errors.len() as f64;
        let rms = 100.0 * (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
        let mean = 100.0 * errors.iter().map(|e| e.abs()).sum::<f64>() / n;
        println!("{name:10} {operator:22} {program:24} RMS {rms:9.5} %  mean {mean:9.5} %");
        let most = tolerance(operator, program);
        if !(rms <= most[0] && mean <= most[1]) {
            wrong.push(format!("{name} {operator} {program}: RMS {rms} %, mean {mean} %, allowed {most:?}"));
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}
