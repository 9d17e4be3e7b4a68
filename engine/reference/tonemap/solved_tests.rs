//! Closed forms of the operators that solve an equation, and of the photoreceptors.

use super::{
    Picture, fattal, mantiuk,
    plane::Plane,
    receptor::{self, Receptor},
    solve::{self, Edges},
    tonemap,
};
use crate::techniques::tonemap::{Operator, Settings};

/// Hills, a step and noise, in decades.
fn logarithm(width: usize, height: usize) -> Plane {
    Plane::from_fn(width, height, |x, y| {
        let noise = ((x * 7919 + y * 104_729) % 211) as f64 / 211.0 - 0.5;
        let step = if 3 * x > 2 * width { 1.7 } else { 0.0 };
        (x as f64 / 5.0).sin() + 0.7 * (y as f64 / 9.0).cos() + step + 0.2 * noise
    })
}

fn centred(plane: &Plane) -> Plane {
    let mean = plane.values.iter().sum::<f64>() / plane.values.len() as f64;
    plane.map(|v| v - mean)
}

fn apart(a: &Plane, b: &Plane) -> f64 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    a.values.iter().zip(&b.values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

const SIZES: [(usize, usize); 7] = [(1, 1), (1, 9), (12, 1), (2, 3), (33, 20), (70, 65), (97, 64)];

#[test]
fn what_changes_nothing_gives_the_picture_back() {
    for (width, height) in SIZES {
        let given = logarithm(width, height);
        // All attenuations are 1, whatever α is.
        for alpha in [0.1, 1.0] {
            let back = fattal::solution(&given, alpha, 1.0);
            assert!(apart(&back, &centred(&given)) < 1e-9, "Fattal, {width}×{height}");
        }
        let back = mantiuk::solution(&given, 1.0);
        assert!(apart(&back, &centred(&given)) < 1e-9, "Mantiuk, {width}×{height}");
        let even = given.map(|_| -2.5);
        for flat in [fattal::solution(&even, 0.1, 0.8), mantiuk::solution(&even, 0.3)] {
            assert_eq!(flat.range(), Some((0.0, 0.0)));
        }
    }
}

#[test]
fn cosines_are_solved_exactly() {
    use std::f64::consts::PI;
    let (width, height) = (37, 24);
    for (m, n) in [(1, 0), (0, 1), (1, 1), (5, 3), (36, 23)] {
        let wave = |i: usize, m: usize, count: usize| (PI * m as f64 * (i as f64 + 0.5) / count as f64).cos();
        let cosine = Plane::from_fn(width, height, |x, y| wave(x, m, width) * wave(y, n, height));
        // The eigenvalue of the five-point operator with a free border.
        let half = |m: usize, count: usize| (PI * m as f64 / (2.0 * count as f64)).sin().powi(2);
        let eigenvalue = 4.0 * (half(m, width) + half(n, height));
        let right: Vec<f64> = cosine.values.iter().map(|v| eigenvalue * v).collect();
        let apply =
            |values: &[f64]| Edges::differences(&Plane { width, height, values: values.to_vec() }).gathered().values;
        let found = Plane { width, height, values: solve::conjugate_gradients(apply, &right) };
        assert!(apart(&found, &cosine) < 1e-9, "{m} {n}");
    }
}

#[test]
fn sharing_is_the_transpose_of_halving() {
    for (width, height) in SIZES {
        let fine = logarithm(width, height);
        let coarse = solve::halved(&fine).map(|v| (3.0 * v).cos());
        let dot = |a: &Plane, b: &Plane| a.values.iter().zip(&b.values).map(|(a, b)| a * b).sum::<f64>();
        let (one, two) = (dot(&solve::halved(&fine), &coarse), dot(&fine, &solve::shared(&coarse, width, height)));
        assert!((one - two).abs() < 1e-12 * (1.0 + one.abs()), "{width}×{height}: {one} {two}");
    }
}

/// Two even halves: the step stays a step, smaller than it was, and both halves stay even.
#[test]
fn a_step_keeps_its_order_and_becomes_smaller() {
    let given = Plane::from_fn(16, 8, |x, _| if x < 8 { -1.0 } else { 1.5 });
    let compressed = [("Fattal", fattal::solution(&given, 0.1, 0.8)), ("Mantiuk", mantiuk::solution(&given, 0.3))];
    for (name, shown) in compressed {
        let (low, high) = (shown[(0, 0)], shown[(15, 7)]);
        assert!(high > low + 0.05 && high - low < 0.5 * 2.5, "{name}: {low} {high}");
        let ordered = |y| (0..15).all(|x| shown[(x, y)] <= shown[(x + 1, y)] + 1e-9);
        assert!((0..8).all(ordered), "{name}");
    }
    // The gradients of Fattal beside the step are those of half the height; from α on, they go with the power β.
    let [strong, weak] = [0.8, 0.9].map(|beta| fattal::attenuation(&given, 0.1, beta));
    let mean: f64 = 2.0 * 8.0 * 1.25 / 128.0;
    for (found, beta) in [(&strong, 0.8f64), (&weak, 0.9)] {
        assert!((found[(8, 3)] - (1.25 / (0.1 * mean)).powf(beta - 1.0)).abs() < 1e-12);
        assert!((found[(0, 3)] - fattal::LEAST.powf(beta - 1.0)).abs() < 1e-12);
    }
}

#[test]
fn response_to_contrast_has_the_slope_of_its_threshold() {
    let linear = mantiuk::linear();
    assert_eq!((mantiuk::response(0.0), mantiuk::contrast(0.0)), (0.0, 0.0));
    for g in [1e-4, 0.01, linear, 0.03, 0.2, 1.0, 4.0] {
        let r = mantiuk::response(g);
        assert!((mantiuk::contrast(r) / g - 1.0).abs() < 1e-12, "{g}");
        let slope = (mantiuk::response(1.0001 * g) - mantiuk::response(0.9999 * g)) / (2e-4 * g);
        assert!((slope * mantiuk::threshold(g, linear) - 1.0).abs() < 1e-3, "{g}: {slope}");
    }
    // Three tenths of a weak contrast are left, and far less of a strong one.
    let left = |g: f64| mantiuk::contrast(0.3 * mantiuk::response(g)) / g;
    assert!((left(0.01) - 0.3).abs() < 1e-12 && left(1.0) < 0.15, "{} {}", left(0.01), left(1.0));
    // The median is half of white's code, the farther percentile white or black.
    let shown = |x| mantiuk::shown(x, [-1.0, 0.0, 0.4]);
    assert!((shown(0.0) - 0.5f64.powf(2.2)).abs() < 1e-12 && shown(-1.0) == 0.0 && (shown(1.0) - 1.0).abs() < 1e-12);
    assert!((mantiuk::shown(0.0, [0.0; 3]) - 0.5f64.powf(2.2)).abs() < 1e-12);
    // Fattal: light between both percentiles, of which the lower one is black.
    let shown = [-3.0, -2.0, 10f64.powi(-1).log10(), 0.0].map(|x| fattal::shown(x, [-2.0, 0.0]));
    assert!(shown[..2] == [0.0, 0.0] && (shown[2] - 0.09 / 0.99).abs() < 1e-12 && (shown[3] - 1.0).abs() < 1e-12);
}

#[test]
fn units_of_the_picture_do_not_matter_to_what_is_solved() {
    let given = logarithm(40, 33);
    let pixels = |factor: f64| -> Vec<[f32; 3]> {
        given.values.iter().map(|l| [1.0, 0.6, 0.2].map(|c| (c * factor * 10f64.powf(*l)) as f32)).collect()
    };
    for operator in [Operator::Fattal, Operator::Mantiuk] {
        let settings = Settings { operator, ..Settings::default() };
        let [one, other] = [1.0, 37.0].map(|factor| tonemap(40, 33, &pixels(factor), &settings));
        for (a, b) in one.as_flattened().iter().zip(other.as_flattened()) {
            assert!((a - b).abs() < 1e-5 * a.max(0.01), "{operator:?}: {a} {b}");
        }
    }
}

#[test]
fn photoreceptors_at_special_values() {
    let base = Receptor { mean: [2.0, 3.0, 4.0], intensity: 0.0, contrast: 1.0, chromatic: 0.0, adaptation: 0.0 };
    let world = 0.2126 * 2.0 + 0.7152 * 3.0 + 0.0722 * 4.0;
    let pixel = [0.5f32, 1.0, 8.0];
    let near = |found: [f64; 3], wanted: [f64; 3]| {
        found.iter().zip(wanted).for_each(|(a, b)| assert!((a - b).abs() < 1e-9, "{found:?} {wanted:?}"));
    };
    let light = pixel.map(f64::from);
    // Adapted to the mean luminance: a hyperbola of each channel. To the means of the channels: to each its own.
    near(base.response(pixel), light.map(|v| v / (v + world)));
    let of = |mean: [f64; 3]| std::array::from_fn(|i| light[i] / (light[i] + mean[i]));
    near(Receptor { chromatic: 1.0, ..base }.response(pixel), of(base.mean));
    // To itself: half of white, whatever the light is; less of it with more intensity.
    let own = Receptor { chromatic: 1.0, adaptation: 1.0, ..base };
    near(own.response(pixel), [0.5; 3]);
    near(Receptor { intensity: 3f64.ln(), ..own }.response(pixel), [0.75; 3]);
    // m is a power of what it adapts to, and black stays black.
    let power = Receptor { contrast: 0.3, ..base };
    near(power.response(pixel), light.map(|v| v / (v + world.powf(0.3))));
    assert_eq!(power.response([0.0; 3]), [0.0; 3]);
    // m by the key: 0.3 where the log-average is the maximum, 1 where it is the minimum, half way by the power 1.4.
    let [bright, dark, middle] = [100.0, 0.01, 1.0].map(|average| receptor::contrast(0.01, 100.0, average));
    assert!((bright - 0.3).abs() < 1e-12 && (dark - 1.0).abs() < 1e-12);
    assert!((middle - (0.3 + 0.7 * 0.5f64.powf(1.4))).abs() < 1e-12);
    assert_eq!(receptor::contrast(0.0, 0.0, 1e-6), 0.3);
    let stretched = receptor::stretched(&[[0.2, 0.3, 0.4], [0.6, 0.5, 0.4]]);
    assert_eq!((stretched[0][0], stretched[1][0]), (0.0, 1.0));
    assert_eq!(receptor::stretched(&[[0.5; 3], [0.5; 3]]), [[1.0; 3]; 2]);
}

/// A colour cast of the whole picture goes away with full chromatic adaptation to the mean, and stays without.
#[test]
fn chromatic_adaptation_takes_a_cast_away() {
    let plain: Vec<[f32; 3]> = (1..=60).map(|i| [i as f32, 61.0 - i as f32, 20.0]).collect();
    let cast: Vec<[f32; 3]> = plain.iter().map(|[r, g, b]| [3.0 * r, *g, 0.25 * b]).collect();
    let with = |chromatic| Settings {
        operator: Operator::ReinhardDevlin,
        chromatic,
        adaptation: 0.0,
        receptor_contrast: Some(1.0),
        ..Settings::default()
    };
    let most = |settings: &Settings| {
        let [a, b] = [&plain, &cast].map(|pixels| tonemap(10, 6, pixels, settings));
        a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    assert!(most(&with(1.0)) < 1e-6 && most(&with(0.0)) > 0.1, "{} {}", most(&with(1.0)), most(&with(0.0)));
}

#[test]
fn logarithms_end_six_decades_below_the_brightest() {
    let settings = Settings { operator: Operator::Fattal, ..Settings::default() };
    let pixels = [[0.0; 3], [1e-9; 3], [100.0; 3], [1.0; 3]];
    let found = Picture::new(2, 2, &pixels, &settings).logarithm();
    for (found, wanted) in found.values.iter().zip([-4.0, -4.0, 2.0, 0.0]) {
        assert!((found - wanted).abs() < 1e-6, "{found} {wanted}");
    }
}
