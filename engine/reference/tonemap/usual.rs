//! What the usual settings have that the papers lack, by the CPU twin: a threshold that does not depend on the exposure, a limit of contrast,
//! weaker colours. And the points of Drago's curve.

use super::{Picture, drago, plane::luminance_of, tests::picture, tonemap};
use crate::techniques::tonemap::{Mode, Operator, Settings, ThresholdUnit};

const SIZE: (u32, u32) = (64, 48);

fn shown(settings: &Settings) -> Vec<[f32; 3]> {
    tonemap(SIZE.0, SIZE.1, &picture(SIZE.0, SIZE.1), settings)
}

fn close(a: &[[f32; 3]], b: &[[f32; 3]], what: &str) {
    for (a, b) in a.as_flattened().iter().zip(b.as_flattened()) {
        assert!((a - b).abs() <= 1e-5 * b.abs().max(1e-4), "{what}: {a} and {b}");
    }
}

#[test]
fn a_threshold_in_log_averages_does_not_depend_on_the_exposure() {
    let pixels = picture(SIZE.0, SIZE.1);
    let share = |threshold_unit, exposure| {
        let settings = Settings { mode: Some(Mode::Selective), threshold_unit, exposure, ..Settings::default() };
        let map = Picture::new(SIZE.0, SIZE.1, &pixels, &settings).important(None);
        map.iter().filter(|important| **important).count() as f64 / map.len() as f64
    };
    let [dark, usual, bright] = [-6.0, 0.0, 6.0].map(|exposure| share(ThresholdUnit::LogAverage, exposure));
    assert!((dark - usual).abs() < 0.002 && (bright - usual).abs() < 0.002, "{dark} {usual} {bright}");
    assert!((0.05..0.9).contains(&usual), "{usual}");
    let [dark, bright] = [-6.0, 6.0].map(|exposure| share(ThresholdUnit::Luminance, exposure));
    assert!(dark + 0.3 < bright, "{dark} {bright}");
}

#[test]
fn a_contrast_limit_goes_from_global_to_local() {
    for operator in [Operator::Ashikhmin, Operator::Bilateral] {
        let with = |mode, limit| {
            shown(&Settings { operator, mode: Some(mode), contrast_limit: Some(limit), ..Settings::paper() })
        };
        let (global, local) = (with(Mode::Global, 1e6), with(Mode::Local, 1e6));
        close(&with(Mode::Local, 1.0), &global, operator.name());
        let far = |limit| -> f64 {
            let limited = with(Mode::Local, limit);
            limited.iter().zip(&global).map(|(a, b)| f64::from((a[1] - b[1]).abs())).sum()
        };
        let steps = [1.0, 1.05, 1.2, 2.0].map(far);
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{}: {steps:?}", operator.name());
        close(&with(Mode::Local, 1e5), &local, operator.name());
    }
    let usual = Settings::default();
    assert_eq!((usual.contrast_limit(), Settings::paper().contrast_limit()), (Some(1.2), None));
}

#[test]
fn weaker_colours_have_the_power_of_the_ratios() {
    let pixels = picture(SIZE.0, SIZE.1);
    for (_, operator) in Operator::ALL {
        let with =
            |saturation| shown(&Settings { operator, mode: Some(Mode::Global), saturation, ..Settings::paper() });
        let (full, usual) = (with(Some(1.0)), with(None));
        let power = Settings { operator, ..Settings::default() }.saturation();
        for (i, (full, usual)) in full.iter().zip(&usual).enumerate() {
            let (light, display) = (luminance_of(pixels[i]), luminance_of(*full));
            for c in 0..3 {
                let scaled = display * (f64::from(pixels[i][c]) / light).powf(f64::from(power));
                let expected = if power == 1.0 { f64::from(full[c]) } else { scaled };
                assert!((f64::from(usual[c]) - expected).abs() < 1e-5 * expected + 1e-6, "{} {c}", operator.name());
            }
        }
    }
}

#[test]
fn dragos_curve_has_the_points_of_the_paper() {
    for bias in [0.5, 0.7, 0.85, 1.0] {
        for (high, average) in [(100.0, 1.0), (3e4, 0.02), (1.0, 1.0)] {
            let shown = |l: f64| drago::display(l, high, average, bias);
            assert!((shown(high) - 1.0).abs() < 1e-12 && shown(0.0) == 0.0);
            let ramp: Vec<f64> = (0..=200).map(|i| shown(high * 10f64.powf(f64::from(i) / 40.0 - 5.0))).collect();
            // The base of the logarithm grows with light. With a lower bias or a higher contrast the formula falls again near the largest luminance.
            let rises = bias < 0.85 || high > 100.0 * average || ramp.windows(2).all(|pair| pair[0] < pair[1]);
            assert!(rises, "bias {bias}, {high}");
        }
    }
    // A bias of 0.5 takes bases from 2 to 10 in proportion to luminance: at half of the largest, 6.
    let half = drago::display(50.0, 100.0, 0.65f64.powi(5), 0.5);
    assert!((half - 51f64.ln() / 6f64.ln() / 101f64.log10()).abs() < 1e-12, "{half}");
}
