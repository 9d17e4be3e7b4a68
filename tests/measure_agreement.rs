//! Measures against the numbers of independent programs, recorded in agreement/values.tsv by agreement/regenerate.py.
//!
//! `cargo test --test image measure_agreement -- --nocapture` prints the table of agreement.

use crate::images;
use std::{collections::BTreeMap, fmt::Write};

use lucerna::{
    image::srgb,
    measure::{Measure, Measured, Options, Pair, Picture, Space, SsimChannels, ToneCurve},
};

/// Largest difference that is accepted, in the unit of the value.
fn tolerance(measure: Measure, value: f64) -> f64 {
    match measure {
        Measure::Ssim | Measure::MsSsim => 1e-4,
        Measure::Flip | Measure::HdrFlip => 1e-3,
        // Points of the share of failing pixels.
        Measure::Pdiff => 0.2,
        Measure::Psnr => 1e-4,
        _ => 1e-5 * value.abs().max(0.1),
    }
}

fn picture(codes: &[[u8; 3]]) -> Picture {
    let pixels = codes.iter().map(|p| p.map(srgb::decode_u8)).collect();
    let picture = Picture::new(images::WIDTH, images::HEIGHT, pixels).unwrap();
    Picture { display_referred: true, ..picture }
}

/// Settings from the words of the table's third column, and the detail that is meant instead of the value.
fn options(words: &str) -> (Options, Option<String>) {
    let mut options = Options::default();
    let mut detail = None;
    for word in words.split_whitespace() {
        let (key, value) = word.split_once('=').unwrap_or((word, ""));
        let number = || value.parse::<f64>().unwrap();
        match key {
            "rgb" => options.ssim_channels = SsimChannels::Rgb,
            "luma" => options.ssim_channels = SsimChannels::Luma,
            "display" => options.space = Some(Space::Display),
            "ppd" => options.pixels_per_degree = number(),
            "fov" => options.pdiff_fov = number(),
            "luminance" => options.white_luminance = number(),
            "curve" => options.flip_curve = ToneCurve::NAMES.into_iter().find(|(name, _)| *name == value).unwrap().1,
            "start" => options.flip_start = Some(number()),
            "stop" => options.flip_stop = Some(number()),
            "n" => options.flip_exposures = Some(value.parse().unwrap()),
            _ => detail = Some(word.to_owned()),
        }
    }
    (options, detail)
}

/// One line of the table: measure, options, program, value.
type Row<'a> = [&'a str; 4];

#[test]
fn agrees_with_independent_programs() {
    let text = include_str!("agreement/values.tsv");
    let mut rows: BTreeMap<&str, Vec<Row<'_>>> = BTreeMap::new();
    for line in text.lines().skip(1) {
        let columns: Vec<&str> = line.split('\t').collect();
        let [pair, rest @ ..] = columns.as_slice() else { panic!("{line}") };
        rows.entry(pair).or_default().push(rest.try_into().unwrap_or_else(|_| panic!("{line}")));
    }
    assert!(rows.len() >= 12, "only {} pairs are recorded", rows.len());
    let mut worst: BTreeMap<(Measure, &str), (f64, usize)> = BTreeMap::new();
    let mut wrong = String::new();
    for (pair, rows) in rows {
        let (kind, name) = pair.split_once('-').unwrap();
        let (reference, test, bytes) = match kind {
            "ldr" => {
                let (a, b) = images::pair(name);
                (picture(&a), picture(&b), [a.concat(), b.concat()])
            }
            _ => {
                let (a, b) = images::hdr_pair(name);
                let bytes = [&a, &b].map(|image| image.iter().flatten().flat_map(|v| v.to_le_bytes()).collect());
                let new = |pixels| Picture::new(images::WIDTH, images::HEIGHT, pixels).unwrap();
                (new(a), new(b), bytes)
            }
        };
        let compared = Pair::new(&reference, &test).unwrap();
        // Several rows look at one comparison.
        let mut done: Vec<(Measure, Options, Measured)> = Vec::new();
        for [measure, words, program, value] in rows {
            if measure == "checksum" {
                let of = &bytes[usize::from(words == "test")];
                assert_eq!(images::checksum(of), value, "{pair}: the images differ from those of images.py");
                continue;
            }
            let measure: Measure = measure.parse().unwrap();
            let expected: f64 = value.parse().unwrap();
            let (options, detail) = options(words);
            let known = done.iter().position(|(m, o, _)| *m == measure && *o == options);
            let known = known.unwrap_or_else(|| {
                let found = measure.of(&compared, &options).unwrap();
                done.push((measure, options, found));
                done.len() - 1
            });
            let found = &done[known].2;
            let found = detail.map_or(found.value, |name| found.detail(&name).unwrap());
            let difference = (found - expected).abs();
            println!("{pair:14} {measure:12} {words:24} {program:22} {expected:12.6} {found:12.6} {difference:.1e}");
            if difference.is_nan() || difference > tolerance(measure, expected) {
                let _ = writeln!(wrong, "{pair} {measure} {words}: {program} has {expected}, here {found}");
            }
            let worst = worst.entry((measure, program)).or_default();
            *worst = (worst.0.max(difference), worst.1 + 1);
        }
    }
    println!("\nlargest difference of each measure");
    for ((measure, program), (difference, count)) in &worst {
        println!("{measure:12} {program:22} {count:3} values {difference:.1e}");
    }
    assert!(wrong.is_empty(), "\n{wrong}");
    let programs: Vec<Measure> = worst.keys().map(|(measure, _)| *measure).collect();
    for measure in [Measure::Ssim, Measure::MsSsim, Measure::Flip, Measure::HdrFlip, Measure::Pdiff, Measure::Pearson] {
        assert!(programs.contains(&measure), "{measure} is compared with no program");
    }
}
