//! VDP against the psychophysics that it models: thresholds of gratings, masking, and what any such measure must keep.

use std::f64::consts::{PI, TAU};

use lucerna::measure::{Display, Exposure, Measure, Measured, Options, Pair, Picture};

const SIDE: u32 = 120;
/// Pixels in a degree.
const PPD: f64 = 30.0;

fn options(white: f64) -> Options {
    Options {
        pixels_per_degree: PPD,
        white_luminance: white,
        display: Display { exposure: Exposure::Stops(0.0), ..Display::default() },
        ..Options::default()
    }
}

/// A grating on mid grey: cycles a degree, angle, contrast.
type Grating = (f64, f64, f64);

fn gratings(list: &[Grating]) -> Picture {
    Picture::from_fn(SIDE, SIDE, |x, y| {
        let wave = |&(cycles, angle, contrast): &Grating| {
            // Cosines: the pixels hit their peaks.
            let (sin, cos) = angle.sin_cos();
            contrast * (TAU * cycles / PPD * (f64::from(x) * cos + f64::from(y) * sin)).cos()
        };
        [(0.5 * (1.0 + list.iter().map(wave).sum::<f64>())) as f32; 3]
    })
}

fn vdp(reference: &Picture, test: &Picture, options: &Options) -> Measured {
    Measure::Vdp.of(&Pair::new(reference, test).unwrap(), options).unwrap()
}

/// Largest probability of detection in the middle, away from edges.
fn seen(reference: &Picture, test: &Picture, options: &Options) -> f64 {
    let map = vdp(reference, test, options).map;
    let inner = |i: &usize| [i % SIDE as usize, i / SIDE as usize].iter().all(|c| (40..80).contains(c));
    let values = (0..map.values.len()).filter(inner).map(|i| f64::from(map.values[i]));
    values.fold(0.0, f64::max)
}

/// The contrast of a grating on a mask that is detected with the probability 1 − 1/e.
fn threshold(mask: &[Grating], (cycles, angle): (f64, f64), options: &Options) -> f64 {
    let reference = gratings(mask);
    let (mut low, mut high) = (1e-4_f64, 0.5);
    for _ in 0..10 {
        let contrast = (low * high).sqrt();
        let test = gratings(&[mask, &[(cycles, angle, contrast)]].concat());
        if seen(&reference, &test, options) > 1.0 - 1.0 / std::f64::consts::E {
            high = contrast
        } else {
            low = contrast
        }
    }
    (low * high).sqrt()
}

/// Daly's CSF, written from the paper once more.
fn sensitivity(rho: f64, angle: f64, l: f64) -> f64 {
    let area = (f64::from(SIDE) / PPD).powi(2);
    let s1 = |r: f64| {
        let a = 0.801 / (1.0 + 0.7 / l).powf(0.2);
        let b = 0.3 * (1.0 + 100.0 / l).powf(0.15);
        let low = (3.23 / (r * r * area).powf(0.3)).powf(5.0);
        a * 0.9 * r * (-b * 0.9 * r).exp() * (1.0 + 0.06 * (b * 0.9 * r).exp()).sqrt() / (low + 1.0).powf(0.2)
    };
    let oblique = 0.11 * (4.0 * angle).cos() + 0.89;
    250.0 * s1(rho).min(s1(rho / (0.856 * 0.7_f64.powf(0.14) * oblique)))
}

#[test]
fn thresholds_of_gratings_follow_the_contrast_sensitivity() {
    println!("cd/m²  cycles/degree  angle  threshold  1/CSF");
    for white in [2.0, 200.0] {
        let mean = white * (0.001 + 0.999 * 0.5);
        // The middle of an octave is 2/3 of its upper limit; orientations lie 30° apart.
        for (cycles, degrees) in [(1.25, 0.0), (2.5, 0.0), (5.0, 0.0), (10.0, 0.0), (5.0, 90.0), (5.0, 30.0)] {
            let angle = f64::to_radians(degrees);
            let found = threshold(&[], (cycles, angle), &options(white));
            let expected = 1.0 / sensitivity(cycles, angle, mean);
            println!("{mean:6.1} {cycles:13} {degrees:6} {found:10.5} {expected:.5}");
            assert!((found / expected - 1.0).abs() < 0.03, "{white} {cycles} {degrees}: {found} for {expected}");
        }
        // Between octaves, two channels see half of it each: 2^(1 − 1/3.5) = 1.64 times the contrast.
        let between = threshold(&[], (3.75, 0.0), &options(white)) * sensitivity(3.75, 0.0, mean);
        assert!((0.9..1.75).contains(&between), "{white}: {between}");
    }
}

#[test]
fn masks_of_the_same_kind_raise_thresholds() {
    let options = options(200.0);
    let target = (5.0, 0.0);
    let plain = threshold(&[], target, &options);
    let masked = |mask: Grating| threshold(&[mask], target, &options) / plain;
    let (weak, strong) = (masked((5.0, 0.0, 0.05)), masked((5.0, 0.0, 0.3)));
    println!("elevation: weak {weak:.2}, strong {strong:.2}");
    assert!(weak > 1.5 && strong > 2.0 * weak, "{weak} {strong}");
    // Six times the mask, 6^0.7 = 3.5 times the threshold.
    assert!((2.5..4.5).contains(&(strong / weak)), "{weak} {strong}");
    // Across, or two octaves away: nearly nothing.
    let (across, coarse) = (masked((5.0, PI / 2.0, 0.3)), masked((1.25, 0.0, 0.3)));
    println!("across {across:.2}, two octaves below {coarse:.2}");
    assert!(across < 1.3 && coarse < 1.6, "{across} {coarse}");
}

#[test]
fn equal_images_differ_nowhere_and_more_distortion_is_seen_more() {
    let mut state = 1_u32;
    let noise: Vec<f32> = (0..SIDE * SIDE)
        .map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32 - 0.5
        })
        .collect();
    let reference = gratings(&[(2.0, 0.4, 0.3), (6.0, 1.3, 0.1)]);
    let with = |amount: f32| {
        let pixel = |i: usize| reference.pixels[i].map(|v| v + amount * noise[i]);
        Picture::from_fn(SIDE, SIDE, |x, y| pixel((y * SIDE + x) as usize))
    };
    let found = [0.0, 0.002, 0.01, 0.03, 0.1].map(|amount| vdp(&reference, &with(amount), &options(100.0)));
    assert!(found[0].value == 0.0 && found[0].detail("mean_probability") == Some(0.0));
    let means = found.each_ref().map(|m| m.detail("mean_probability").unwrap());
    assert!(means.windows(2).all(|pair| pair[0] <= pair[1]) && found[4].value > 50.0, "{means:?}");
    assert!(found.windows(2).all(|pair| pair[0].value <= pair[1].value));
    // One code in 256 of brightness is not seen, half the light is.
    let scaled = |s: f32| Picture::from_fn(SIDE, SIDE, |x, y| reference.pixels[(y * SIDE + x) as usize].map(|v| v * s));
    assert_eq!(vdp(&reference, &scaled(0.996), &options(100.0)).value, 0.0);
    assert!(vdp(&reference, &scaled(0.5), &options(100.0)).value > 50.0);
    // Fine noise is not seen from far away, nor in the dark.
    let far = Options { pixels_per_degree: 300.0, ..options(100.0) };
    let dark = options(0.01);
    let near = found[3].detail("mean_probability").unwrap();
    for other in [far, dark] {
        assert!(vdp(&reference, &with(0.03), &other).detail("mean_probability").unwrap() < 0.5 * near);
    }
}

#[test]
fn what_differs_in_one_place_is_seen_there() {
    let reference = gratings(&[]);
    let spot = |x: u32, y: u32| (50..58).contains(&x) && (30..38).contains(&y);
    let test = Picture::from_fn(SIDE, SIDE, |x, y| [if spot(x, y) { 0.7 } else { 0.5 }; 3]);
    let map = vdp(&reference, &test, &options(100.0)).map;
    let at = |x: usize, y: usize| map.values[y * SIDE as usize + x];
    assert!(at(53, 33) > 0.99 && at(100, 100) < 0.05 && at(10, 110) < 0.05, "{} {}", at(53, 33), at(100, 100));
}
