//! Adaptation in time: the same at any frame rate, at rest on a still picture, bounded while the view moves.

use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    techniques::tonemap::{Mode, Operator, Settings, Still},
};

const SIDE: u32 = 16;

/// Grey from a hundredth of `light` to `light`.
fn ramp(light: f32) -> Vec<[f32; 4]> {
    (0..SIDE * SIDE)
        .map(|i| {
            let l = light * 10f32.powf(-2.0 * i as f32 / (SIDE * SIDE - 1) as f32);
            [l, l, l, 1.0]
        })
        .collect()
}

fn settings(operator: Operator) -> Settings {
    Settings { operator, mode: Some(Mode::Global), adapt_limit: 0.0, ..Settings::default() }
}

fn still(gpu: &Gpu, settings: &Settings) -> Still {
    Still::new(gpu, settings).unwrap()
}

/// The largest luminance it is adapted to after `frames` of `dt` seconds of a picture of `light`.
fn after(still: &mut Still, light: f32, frames: u32, dt: f32) -> f32 {
    (0..frames).map(|_| still.map(SIDE, SIDE, ramp(light), None, Some(dt)).unwrap().statistics.high).last().unwrap()
}

#[test]
fn frame_rate_does_not_matter_and_both_time_constants_are_kept() {
    with_gpu(|gpu| {
        for (from, to, seconds, tau) in [(1.0f32, 64.0f32, 0.5f32, 0.4f32), (64.0, 1.0, 0.5, 1.2)] {
            let wanted = (to.log2() + (from / to).log2() * (-seconds / tau).exp()).exp2();
            for frames in [1, 5, 30] {
                let mut still = still(gpu, &settings(Operator::Ashikhmin));
                assert_eq!(after(&mut still, from, 1, 0.1).to_bits(), from.to_bits(), "the first frame is adapted to");
                let found = after(&mut still, to, frames, seconds / frames as f32);
                assert!((found / wanted - 1.0).abs() < 1e-4, "{from} to {to} in {frames}: {found} instead of {wanted}");
            }
        }
    });
}

#[test]
fn a_still_picture_comes_to_rest_at_its_own_adaptation() {
    with_gpu(|gpu| {
        for (from, to) in [(1.0, 50.0), (50.0, 1.0), (0.0, 1.0), (1.0, 0.0)] {
            for operator in [Operator::Ashikhmin, Operator::Reinhard] {
                let settings = settings(operator);
                let mut still = still(gpu, &settings);
                after(&mut still, from, 1, 0.1);
                after(&mut still, to, 60, 0.5);
                let one = still.map(SIDE, SIDE, ramp(to), None, Some(0.016)).unwrap();
                let two = still.map(SIDE, SIDE, ramp(to), None, Some(0.033)).unwrap();
                assert!(one.pixels == two.pixels && one.statistics.high.to_bits() == two.statistics.high.to_bits());
                let alone = still.map(SIDE, SIDE, ramp(to), None, None).unwrap();
                assert!(
                    one.pixels == alone.pixels,
                    "{from} to {to}: at rest it is as if there had been nothing before"
                );
                assert_eq!(alone.statistics.high, to);
            }
        }
    });
}

#[test]
fn time_that_stands_still_or_is_no_time() {
    with_gpu(|gpu| {
        let mut still = still(gpu, &settings(Operator::Ashikhmin));
        after(&mut still, 1.0, 1, 0.1);
        assert_eq!(after(&mut still, 64.0, 3, 0.0), 1.0, "no time has passed");
        assert_eq!(after(&mut still, 64.0, 3, -1.0), 1.0);
        assert_eq!(after(&mut still, 64.0, 1, f32::NAN), 64.0, "as without a time");
        still.tonemap().reset().unwrap();
        assert_eq!(after(&mut still, 2.0, 1, 0.01), 2.0, "after a cut it is adapted at once");
    });
}

/// A window that moves over a picture with a lamp in it. From frame to frame statistics change by no more than the limit, and so a pixel that
/// is the same in both frames changes by no more than that: with k stops of change of the adaptation, Reinhard's l/(1 + l) changes by at most
/// k stops. Ashikhmin's curve from L_min, where it is 0, has no such bound in stops; its display luminance changes by at most
/// 0.03 of the display's white here, which it cannot exceed. Without adaptation the same sequence jumps.
#[test]
fn a_panning_view_does_not_jump() {
    with_gpu(|gpu| {
        let (wide, frames, step) = (64usize, 12usize, 4usize);
        let world: Vec<f32> = (0..wide * 16)
            .map(|i| {
                let (x, y) = (i % wide, i / wide);
                let lamp = (x as i32 - 40).pow(2) + (y as i32 - 8).pow(2) < 16;
                if lamp { 5000.0 } else { 0.01 * 2f32.powi((x * 7 + y * 3) as i32 % 12) }
            })
            .collect();
        let view = |frame: usize| -> Vec<[f32; 4]> {
            (0..16 * 16).map(|i| world[i / 16 * wide + frame * step + i % 16]).map(|l| [l, l, l, 1.0]).collect()
        };
        let jump = |operator: Operator, dt: Option<f32>| {
            // 6 stops a second at 60 frames a second.
            let settings = Settings { adapt_limit: 6.0, white: 1e9, ..settings(operator) };
            let mut still = still(gpu, &settings);
            let shown: Vec<_> = (0..frames).map(|f| still.map(16, 16, view(f), None, dt).unwrap()).collect();
            let mut most = 0.0f32;
            for (f, pair) in shown.windows(2).enumerate() {
                for (a, b) in [
                    (pair[0].statistics.high, pair[1].statistics.high),
                    (pair[0].statistics.log_average, pair[1].statistics.log_average),
                ] {
                    let stops = (a / b).log2().abs();
                    assert!(dt.is_none() || stops <= 0.1 + 1e-3, "frame {f}: {stops} stops");
                }
                for i in 0..16 * 16 {
                    let (x, y) = (i % 16, i / 16);
                    if x + step < 16 {
                        let before = pair[0].pixels[y * 16 + x + step][0];
                        let now = pair[1].pixels[i][0];
                        let stops = (before / now).log2().abs();
                        most = most.max(if operator == Operator::Reinhard {
                            stops
                        } else {
                            (before.min(1.0) - now.min(1.0)).abs()
                        });
                    }
                }
            }
            most
        };
        for (operator, bound) in [(Operator::Reinhard, 0.1 + 1e-3), (Operator::Ashikhmin, 0.03)] {
            let (adapted, alone) = (jump(operator, Some(1.0 / 60.0)), jump(operator, None));
            println!("{operator:?}: largest jump {adapted} with adaptation, {alone} without");
            assert!(adapted <= bound && alone > 5.0 * adapted, "{operator:?}: {adapted} {alone}");
        }
    });
}
