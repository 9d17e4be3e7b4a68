//! Closed forms and invariances of the operators.

use super::{
    Picture, ashikhmin, clean, curves, identify,
    plane::{Plane, gaussian, luminance_of},
    reinhard, statistics, tonemap, tonemap_masked,
};
use crate::techniques::tonemap::{BadValues, Mode, Operator, Settings};

type Pixels = Vec<[f32; 3]>;

/// All operators in all their modes.
fn all() -> Vec<Settings> {
    let modes = [Mode::Global, Mode::Local, Mode::Selective];
    let with = |(_, operator): (&str, Operator)| {
        modes.map(|mode| Settings { operator, mode: Some(mode), ..Settings::paper() })
    };
    Operator::ALL.into_iter().flat_map(with).filter(|s| s.validate().is_ok()).collect()
}

/// Four decades of smooth and noisy colour.
pub(super) fn picture(width: u32, height: u32) -> Pixels {
    let pixel = |i: u32| {
        let (x, y) = (i % width, i / width);
        let noise = (x.wrapping_mul(374_761_393) ^ y.wrapping_mul(668_265_263)).wrapping_mul(1_274_126_177) >> 16;
        let level = 10f32.powf(3.0 * ((x + 2 * y) as f32 / (width + 2 * height) as f32) - 2.0);
        let level = if (x / 7 + y / 5) % 3 == 0 { 6.0 * level } else { level };
        [1.0, 0.8, 0.3].map(|c| c * level * (1.0 + noise as f32 / 400_000.0))
    };
    (0..width * height).map(pixel).collect()
}

fn close(a: &[[f32; 3]], b: &[[f32; 3]], tolerance: f32, what: &str) {
    assert_eq!(a.len(), b.len());
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        let same = a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance * a.abs().max(1e-4));
        assert!(same, "{what}: pixel {i} is {a:?} and {b:?}");
    }
}

/// Luminances over thirteen decades and the borders of the pieces, in ascending order.
fn luminances() -> Vec<f64> {
    let mut all: Vec<f64> = (0..=1300).map(|i| 10f64.powf(f64::from(i) * 0.01 - 7.0)).collect();
    all.extend([0.0034, 1.0, 7.2444]);
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

#[test]
fn averages_along_both_axes_are_the_definition() {
    let plane = Plane::from_fn(13, 9, |x, y| ((x * 7 + y * 13) % 11) as f64 + 0.1);
    for (sigma, radius) in [(1.7, 5), (0.5, 1), (10.0, 20), (0.0, 3)] {
        let weights = gaussian(sigma, radius);
        let averages = plane.averages(&weights);
        for (x, y) in (0..9).flat_map(|y| (0..13).map(move |x| (x, y))) {
            assert!((averages[(x, y)] - plane.average(x, y, &weights)).abs() < 1e-12);
        }
    }
}

#[test]
fn capacity_is_continuous_and_the_integral_of_one_over_the_threshold() {
    use ashikhmin::{capacity, threshold};
    for border in [0.0034, 1.0, 7.2444] {
        let step = capacity(border * (1.0 + 1e-12)) - capacity(border * (1.0 - 1e-12));
        assert!(step.abs() < 1e-9, "C jumps by {step} at {border}");
    }
    // The four digits that the paper prints: 2.4483 where 0.0034 / 0.0014 is 2.4286, and the same difference from there on.
    for (border, printed) in [(0.0034, 2.4483), (1.0, 16.5630), (7.2444, 32.0693)] {
        assert!((capacity(border) + 0.01973 - printed).abs() < 1e-4, "C({border}) = {}", capacity(border));
    }
    for l in luminances() {
        let h = l * 1e-6;
        if [0.0034, 1.0, 7.2444].iter().all(|border: &f64| (border - l).abs() > 2.0 * h) {
            let slope = (capacity(l + h) - capacity(l - h)) / (2.0 * h);
            assert!((slope * threshold(l) - 1.0).abs() < 1e-6, "TVI is not 1 / C' at {l}: {slope}");
        }
    }
    assert!(luminances().windows(2).all(|p| capacity(p[0]) < capacity(p[1])), "C does not rise");
}

#[test]
fn ashikhmins_curve_maps_the_picture_onto_the_display_and_rises() {
    for (low, high) in [(0.0, 1e5), (1e-3, 2e-3), (0.5, 30.0), (1e-6, 1e6)] {
        let curve = ashikhmin::Curve { low, high, display: 80.0, capacity: ashikhmin::capacity };
        assert_eq!((curve.map(low), curve.map(high)), (0.0, 80.0));
        let inside: Vec<f64> = luminances().into_iter().filter(|l| (low..=high).contains(l)).collect();
        assert!(inside.windows(2).all(|p| curve.map(p[0]) < curve.map(p[1])));
        // A pixel that is its own neighbourhood is on the global curve; around it, one threshold is one threshold.
        for l in inside {
            let (mapped, step) = (curve.map(l), ashikhmin::threshold(l));
            assert_eq!(curve.display(l, l), mapped);
            let shown = curve.display(l + step, l) - mapped;
            assert!((shown / ashikhmin::threshold(mapped) - 1.0).abs() < 1e-9, "a visible step at {l} stays one");
        }
    }
}

#[test]
fn curves_have_their_published_points() {
    let grey = |curve: fn([f64; 3]) -> [f64; 3], v: f64| {
        let [r, g, b] = curve([v; 3]);
        // The rows of AgX' matrix sum to 1.00014, 0.99996 and 0.99995, those of ACES' to 1 but for 10⁻⁵.
        assert!((r - g).abs() < 5e-4 * g + 1e-5 && (g - b).abs() < 5e-4 * g + 1e-5, "grey {v} becomes {r} {g} {b}");
        g
    };
    let rises = |curve: fn([f64; 3]) -> [f64; 3], most: f64| {
        let shown: Vec<f64> = luminances().into_iter().map(|l| grey(curve, l)).collect();
        assert!(shown.windows(2).all(|p| p[0] <= p[1]) && *shown.last().unwrap() <= most);
    };
    // AgX: middle grey is the pivot of the sigmoid, half of the encoded range; both ends of the log range are black and white.
    assert!((grey(curves::agx, 0.18) - 0.5f64.powf(2.2)).abs() < 1e-4);
    assert!(grey(curves::agx, 0.0) < 1e-12 && (grey(curves::agx, 1e6) - 1.0).abs() < 1e-3);
    rises(curves::agx, 1.001);
    // Neutral: an offset of 0.04 between 0.08 and 0.8, a square below, towards 1 above.
    assert!((grey(curves::neutral, 0.5) - 0.46).abs() < 1e-12);
    assert!((grey(curves::neutral, 0.04) - 6.25 * 0.04 * 0.04).abs() < 1e-12);
    assert!((grey(curves::neutral, 1e9) - 1.0).abs() < 1e-6);
    assert_eq!(curves::neutral([0.7, 0.2, 0.08]).map(|v| (v * 1e9).round()), [660e6, 160e6, 40e6]);
    rises(curves::neutral, 1.0);
    // ACES: rows of its matrices sum to 1; the limit of the fit is 1 / 0.983729.
    assert!((grey(curves::aces, 1e9) - 1.0 / 0.983729).abs() < 1e-4);
    rises(curves::aces, 1.0 / 0.983729 + 1e-4);
    // Extended Reinhard maps white to 1 and is half way where l = 1 without a white.
    for white in [0.3, 1.0, 40.0] {
        assert!((reinhard::global(white, white) - 1.0).abs() < 1e-12);
    }
    assert!((reinhard::global(1.0, 1e12) - 0.5).abs() < 1e-12);
}

#[test]
fn degenerate_pictures() {
    for settings in all() {
        let name = format!("{} {:?}", settings.operator.name(), settings.mode());
        assert!(tonemap(0, 0, &[], &settings).is_empty());
        // ACES' fit has a value of -0.00038 at 0.
        let black = tonemap(9, 7, &[[0.0; 3]; 63], &settings);
        assert!(black.iter().flatten().all(|v| v.abs() < 5e-4), "{name}: black is {:?}", black[0]);
        for value in [1e-4, 0.02, 0.5, 3.0, 2e4] {
            let pixel = [value, 0.5 * value, 0.25 * value];
            let one = tonemap(1, 1, &[pixel], &settings)[0];
            let even = tonemap(9, 7, &[pixel; 63], &settings);
            assert!(even.iter().flatten().all(|v| v.is_finite() && *v > -5e-4), "{name}: {:?}", even[0]);
            close(&even, &[one; 63], 1e-6, &name);
            if settings.operator.has_local() && settings.mode() == Mode::Global {
                assert!((luminance_of(one) - 1.0).abs() < 1e-4, "{name}: the only luminance is white, not {one:?}");
            }
        }
        let mut hot = vec![[0.01, 0.02, 0.03]; 35 * 31];
        hot[35 * 15 + 17] = [6e4, 5e4, 4e4];
        let shown = tonemap(35, 31, &hot, &settings);
        assert!(shown.iter().flatten().all(|v| v.is_finite() && *v > -5e-4), "{name}");
        assert!(luminance_of(shown[35 * 15 + 17]) > luminance_of(shown[0]), "{name}: the hot pixel is the brightest");
    }
}

#[test]
fn colour_keeps_its_ratios_and_local_adaptation_of_even_neighbourhoods_is_global() {
    let (width, height) = (64, 48);
    let pixels = picture(width, height);
    let halves: Pixels = (0..96 * 9).map(|i| if i % 96 < 48 { [0.3, 0.2, 0.1] } else { [20.0, 30.0, 10.0] }).collect();
    for settings in all().into_iter().filter(|s| s.operator.has_local()) {
        let shown = tonemap(width, height, &pixels, &settings);
        for (before, after) in pixels.iter().zip(&shown) {
            let ratio = luminance_of(*after) / luminance_of(*before);
            let same = before.iter().zip(after).all(|(b, a)| (f64::from(*a) - f64::from(*b) * ratio).abs() < 1e-6);
            assert!(same, "{}: {before:?} became {after:?}", settings.operator.name());
        }
        let global = tonemap(96, 9, &halves, &Settings { mode: Some(Mode::Global), ..settings.clone() });
        let mut local = tonemap(96, 9, &halves, &settings);
        if settings.operator == Operator::Reinhard && settings.mode() == Mode::Local {
            // Without the white of equation 4, to which equation 9 does not lead.
            let picture = Picture::new(96, 9, &halves, &settings);
            let l = |i: usize| 0.18 * picture.luminance.values[i] / picture.statistics.log_average;
            assert!((luminance_of(local[0]) - l(0) / (1.0 + l(0))).abs() < 1e-6);
            local = global.clone();
        }
        if settings.operator == Operator::Reinhard && settings.mode() == Mode::Selective {
            continue;
        }
        // Gaussians reach at most 20 pixels; the bilateral filter sees the other side over 5 of its σ away.
        for x in [0, 10, 20, 80, 95] {
            close(&global[x..=x], &local[x..=x], 2e-5, settings.operator.name());
        }
    }
}

#[test]
fn scaling_the_picture_does_what_the_papers_say() {
    let (width, height) = (40, 30);
    let pixels = picture(width, height);
    let scaled: Pixels = pixels.iter().map(|p| p.map(|v| v * 8.0)).collect();
    for settings in all() {
        let shown = tonemap(width, height, &pixels, &settings);
        let name = format!("{} {:?}", settings.operator.name(), settings.mode());
        // Exposure is scaling, for every operator.
        let exposed = tonemap(width, height, &pixels, &Settings { exposure: 3.0, ..settings.clone() });
        close(&exposed, &tonemap(width, height, &scaled, &settings), 1e-6, &name);
        match settings.operator {
            // Which pixels are selected depends on the scale.
            _ if settings.mode() == Mode::Selective => {}
            // But for the log-average's δ of 10⁻⁶.
            Operator::Reinhard => close(&exposed, &shown, 1e-3, &name),
            Operator::Bilateral | Operator::Fattal | Operator::Mantiuk => close(&exposed, &shown, 1e-5, &name),
            Operator::Linear => close(&exposed, &scaled, 1e-6, &name),
            _ => assert!(exposed.iter().flatten().zip(shown.iter().flatten()).any(|(a, b)| a > b), "{name}"),
        }
        let normal =
            |pixels: &[[f32; 3]]| tonemap(width, height, pixels, &Settings { normalize: true, ..settings.clone() });
        close(&normal(&pixels), &normal(&scaled), 1e-3, &name);
    }
}

#[test]
fn mirrored_and_repeated_pictures_give_mirrored_and_repeated_results() {
    // Pyramids begin at the left, so that only a width that is a power of two has mirrored levels.
    let (width, height) = (64u32, 33u32);
    let pixels = picture(width, height);
    let mirrored =
        |p: &[[f32; 3]]| -> Pixels { p.chunks(width as usize).flat_map(|r| r.iter().rev().copied()).collect() };
    let twice = |p: &[[f32; 3]]| -> Pixels { p.iter().chain(p).copied().collect() };
    for settings in all() {
        let shown = tonemap(width, height, &pixels, &settings);
        let name = settings.operator.name();
        close(&mirrored(&shown), &tonemap(width, height, &mirrored(&pixels), &settings), 1e-5, name);
        if settings.mode() == Mode::Global {
            close(&twice(&shown), &tonemap(width, 2 * height, &twice(&pixels), &settings), 1e-6, name);
        }
    }
}

#[test]
fn global_curves_rise_with_luminance() {
    let ramp: Pixels = (0..400).map(|i| [10f32.powf(i as f32 / 50.0 - 4.0); 3]).collect();
    for settings in all().into_iter().filter(|s| s.mode() == Mode::Global) {
        let shown = tonemap(400, 1, &ramp, &settings);
        assert!(shown.windows(2).all(|p| p[0][1] <= p[1][1]), "{} falls", settings.operator.name());
        if settings.operator.has_local() || settings.operator == Operator::ReinhardGlobal {
            let last = shown[399][1];
            assert!((last - 1.0).abs() < 1e-5 && shown[0][1] >= 0.0, "the brightest is {last}");
        }
    }
}

#[test]
fn selection_goes_from_global_to_local() {
    let (width, height) = (48, 40);
    let pixels = picture(width, height);
    for operator in [Operator::Ashikhmin, Operator::Reinhard, Operator::Bilateral] {
        let with =
            |mode, threshold| Settings { operator, mode: Some(mode), threshold: Some(threshold), ..Settings::paper() };
        let adapted = |s: &Settings, mask: Option<&[bool]>| Picture::new(width, height, &pixels, s).adaptation(mask);
        let [global, local] = [Mode::Global, Mode::Local].map(|m| adapted(&with(m, 0.1), None));
        assert_eq!(adapted(&with(Mode::Selective, 1e18), None), global);
        let mask = vec![true; pixels.len()];
        assert_eq!(adapted(&with(Mode::Selective, 1e18), Some(&mask)), local);
        let some = with(Mode::Selective, 1.0);
        let important = Picture::new(width, height, &pixels, &some).important(None);
        let count = important.iter().filter(|i| **i).count();
        assert!(count > 100 && count < pixels.len() - 100, "{count} important pixels test nothing");
        let adapted = adapted(&some, None);
        for (i, important) in important.into_iter().enumerate() {
            let from = if important { &local } else { &global };
            assert_eq!(adapted.values[i], from.values[i]);
        }
        let masked = tonemap_masked(width, height, &pixels, Some(&mask), &with(Mode::Selective, 1e18));
        assert!(masked.iter().flatten().all(|v| v.is_finite()));
    }
}

#[test]
fn sobel_of_a_ramp_is_eight_slopes() {
    let ramp = Plane::from_fn(9, 8, |x, y| 3.0 * x as f64 + 4.0 * y as f64);
    let edges = identify::sobel(&ramp);
    assert!((edges[(4, 4)] - 40.0).abs() < 1e-12);
    // At the edge the outer sample is repeated, which halves the slope across.
    assert!((edges[(0, 4)] - 8.0 * 1.5f64.hypot(4.0)).abs() < 1e-12);
    assert_eq!(identify::sobel(&ramp.map(|_| 5.0)).range(), Some((0.0, 0.0)));
}

#[test]
fn saliency_is_blind_to_scale_and_even_pictures() {
    let even = Plane::from_fn(50, 37, |_, _| 0.3);
    assert!(identify::saliency(&even).range().unwrap().1 < 1e-12);
    let dot = Plane::from_fn(70, 66, |x, y| if (x, y) == (30, 31) { 9.0 } else { 0.0 });
    let map = identify::saliency(&dot);
    let doubled = identify::saliency(&dot.map(|v| 2.0 * v));
    assert!(map.values.iter().zip(&doubled.values).all(|(a, b)| (a - b).abs() < 1e-12));
    // Nothing but the pixel itself is in the finest centre; around it, centre and surround are the pyramid's weights.
    assert!(map.range().unwrap().1 <= 1.0 && map[(30, 31)] > 0.9, "{}", map[(30, 31)]);
    // Boxes of a ramp have its values at their centres.
    let small = identify::shrink(&Plane::from_fn(10, 7, |x, y| x as f64 + 10.0 * y as f64), 4);
    assert_eq!((small.width, small.height), (3, 2));
    assert_eq!((small[(0, 0)], small[(2, 0)], small[(1, 1)]), (16.5, 23.5, 55.5));
}

#[test]
fn statistics_of_counted_luminances() {
    let values: Vec<f64> = (1..=200).rev().map(f64::from).collect();
    let found = |percent| statistics::statistics(&values, percent);
    assert_eq!((found(0.0).min, found(0.0).max), (1.0, 200.0));
    assert_eq!((found(1.0).min, found(1.0).max), (2.0, 199.0));
    assert_eq!((found(1.1).min, found(1.1).max), (3.0, 198.0));
    assert!((statistics::log_average(&[1.0, 10.0, 100.0], 0.0) - 10.0).abs() < 1e-12);
    assert!((statistics::statistics(&[0.0; 4], 5.0).log_average - 1e-6).abs() < 1e-18);
}

#[test]
fn bad_values_become_what_the_policy_says() {
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let pixels = [[1.0, 2.0, 3.0], [nan, inf, -1.0], [5.0, 6.0, -7.0], [inf, -inf, 2.0]];
    let of = |policy| clean(4, 1, &pixels, policy);
    assert_eq!(of(BadValues::Zero), [[1.0, 2.0, 3.0], [0.0; 3], [5.0, 6.0, 0.0], [0.0, 0.0, 2.0]]);
    assert_eq!(of(BadValues::Clamp), [[1.0, 2.0, 3.0], [0.0, 6.0, 0.0], [5.0, 6.0, 0.0], [5.0, 0.0, 2.0]]);
    assert_eq!(of(BadValues::Neighbour), [[1.0, 2.0, 3.0], [3.0, 4.0, 0.0], [5.0, 6.0, 0.0], [5.0, 6.0, 0.0]]);
    for settings in all() {
        let shown = tonemap(4, 1, &pixels, &settings);
        assert!(shown.iter().flatten().all(|v| v.is_finite()), "{}", settings.operator.name());
    }
}
