//! Adaptation in time: the same at any frame rate, at rest on a still picture, bounded while the view moves.

use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    techniques::tonemap::{Identify, Mode, Operator, Settings, Still},
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

const MODES: [Mode; 3] = [Mode::Global, Mode::Local, Mode::Selective];
const OPERATORS: [Operator; 3] = [Operator::Ashikhmin, Operator::Reinhard, Operator::Bilateral];

fn settings(operator: Operator) -> Settings {
    in_mode(operator, Mode::Global)
}

/// With neighbourhoods that are small beside the pictures here.
fn in_mode(operator: Operator, mode: Mode) -> Settings {
    let reaches = Settings { radius: 4, scales: 4, spatial: 0.03, ..Settings::paper() };
    Settings { operator, mode: Some(mode), adapt_limit: 0.0, ..reaches }
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
fn the_limit_holds_until_the_exponential_is_slower() {
    with_gpu(|gpu| {
        // Six stops at six stops a second; from 6 τ stops on the exponential is slower.
        for (from, to, tau) in [(1.0f32, 64.0f32, 0.4f32), (64.0, 1.0, 0.8)] {
            let settings =
                Settings { adapt_limit: 6.0, adapt_up: 0.4, adapt_down: 0.8, ..settings(Operator::Reinhard) };
            for seconds in [0.1f32, 0.5, 1.0, 1.5] {
                let steady = seconds.min((6.0 - 6.0 * tau) / 6.0);
                let left = (6.0 - 6.0 * steady) * ((steady - seconds) / tau).exp();
                let wanted = to * (if from < to { -left } else { left }).exp2();
                for frames in [1, 4] {
                    let mut still = still(gpu, &settings);
                    after(&mut still, from, 1, 0.1);
                    let found = after(&mut still, to, frames, seconds / frames as f32);
                    assert!(
                        (found / wanted - 1.0).abs() < 1e-4,
                        "{from} to {to} in {seconds} s: {found}, not {wanted}"
                    );
                }
            }
        }
    });
}

#[test]
fn the_way_from_black_begins_forty_stops_below_one() {
    with_gpu(|gpu| {
        let limited = Settings { adapt_limit: 10.0, adapt_up: 0.4, ..settings(Operator::Reinhard) };
        for (seconds, stops) in [(0.5f32, -35.0f32), (1.5, -25.0), (3.0, -10.0)] {
            let mut still = still(gpu, &limited);
            assert_eq!(after(&mut still, 0.0, 1, 0.1), 0.0);
            let found = after(&mut still, 1.0, 1, seconds).log2();
            assert!((found - stops).abs() < 1e-3, "{seconds} s from black: {found} stops");
        }
    });
}

/// Twice the frames, half of the time between them: the same picture, in every mode, with and without the limit.
#[test]
fn twice_the_frames_of_half_the_time_are_the_same_picture() {
    with_gpu(|gpu| {
        for (operator, mode) in OPERATORS.into_iter().flat_map(|o| MODES.map(|m| (o, m))) {
            for (limit, seconds) in [(0.0, 0.8), (6.0, 1.2)] {
                let settings = Settings { adapt_limit: limit, ..in_mode(operator, mode) };
                // From dark to light and, half way, to the dark again.
                let shown = |frames: u32| {
                    let mut still = still(gpu, &settings);
                    let dt = seconds / frames as f32;
                    after(&mut still, 1.0, 1, dt);
                    after(&mut still, 100.0, frames, dt);
                    after(&mut still, 0.3, frames - 1, dt);
                    still.map(SIDE, SIDE, ramp(0.3), None, Some(dt)).unwrap()
                };
                let [few, twice, many] = [2, 4, 16].map(shown);
                let alone = still(gpu, &settings).map(SIDE, SIDE, ramp(0.3), None, None).unwrap();
                let apart = |a: &[[f32; 4]], b: &[[f32; 4]]| {
                    let each = a.as_flattened().iter().zip(b.as_flattened());
                    each.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
                };
                let found = [&twice, &many].map(|other| apart(&few.pixels, &other.pixels));
                // It has something to show: it is still on its way.
                let way = apart(&few.pixels, &alone.pixels);
                assert!(found.iter().all(|f| *f < 1e-3 * way), "{operator:?} {mode:?} {limit}: {found:?} of {way}");
                assert!(way > 1e-3, "{operator:?} {mode:?} {limit}: {way}");
            }
        }
    });
}

/// A bright bar that moves: with [`Settings::adapt_local`] the places where it was keep a part of its adaptation.
#[test]
fn local_adaptation_goes_on_from_frame_to_frame() {
    with_gpu(|gpu| {
        let bar = |at: u32| -> Vec<[f32; 4]> {
            let light = |i: u32| if (i % SIDE) / 4 == at { 50.0 } else { 1.0 };
            (0..SIDE * SIDE).map(|i| [light(i), light(i), light(i), 1.0]).collect()
        };
        for operator in OPERATORS {
            for mode in [Mode::Local, Mode::Selective] {
                let at_once = in_mode(operator, mode);
                let slow = Settings { adapt_local: 0.5, ..at_once.clone() };
                let shown = |settings: &Settings, frames: &[(u32, f32)]| {
                    let mut still = still(gpu, settings);
                    frames
                        .iter()
                        .map(|(at, dt)| still.map(SIDE, SIDE, bar(*at), None, Some(*dt)).unwrap().pixels)
                        .last()
                        .unwrap()
                };
                let apart = |a: &[[f32; 4]], b: &[[f32; 4]]| {
                    a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
                };
                let name = format!("{operator:?} {mode:?}");
                let goal = shown(&at_once, &[(2, 0.1)]);
                // The first frame, and a frame that does not change, are those without the setting.
                assert_eq!(shown(&slow, &[(2, 0.1)]), goal, "{name}");
                assert_eq!(shown(&slow, &[(2, 0.1), (2, 0.1), (2, 0.1)]), goal, "{name}");
                // After a move there is a trail, which fades by the time constant at any frame rate.
                let trail = shown(&slow, &[(0, 0.1), (2, 0.25)]);
                assert!(apart(&trail, &goal) > 1e-3, "{name}: no trail");
                let twice = shown(&slow, &[(0, 0.1), (2, 0.125), (2, 0.125)]);
                assert!(apart(&twice, &trail) < 1e-4, "{name}: {}", apart(&twice, &trail));
                let late = shown(&slow, &[(0, 0.1), (2, 10.0)]);
                assert!(apart(&late, &goal) < 1e-3 * apart(&trail, &goal).max(1.0), "{name}: {}", apart(&late, &goal));
                assert_eq!(shown(&at_once, &[(0, 0.1), (2, 0.25)]), goal, "{name}: ours leaves no trail");
            }
        }
        // A frame of another size, and the frame after a cut, start anew.
        let slow = Settings { adapt_local: 0.5, ..in_mode(Operator::Ashikhmin, Mode::Local) };
        let alone = still(gpu, &slow).map(SIDE, SIDE, bar(2), None, Some(0.1)).unwrap().pixels;
        let mut on = still(gpu, &slow);
        on.map(SIDE, SIDE, bar(0), None, Some(0.1)).unwrap();
        on.map(SIDE / 2, 2 * SIDE, bar(1), None, Some(0.1)).unwrap();
        assert_eq!(on.map(SIDE, SIDE, bar(2), None, Some(0.1)).unwrap().pixels, alone);
        on.map(SIDE, SIDE, bar(0), None, Some(0.1)).unwrap();
        on.tonemap().reset().unwrap();
        assert_eq!(on.map(SIDE, SIDE, bar(2), None, Some(0.1)).unwrap().pixels, alone);
        // A picture in tiles has no frame before.
        let mut tiled =
            still(gpu, &Settings { adapt_local: 0.5, ..in_mode(Operator::Ashikhmin, Mode::Local) }).tiles(8);
        let error = tiled.map(SIDE, SIDE, bar(0), None, Some(0.1)).unwrap_err().to_string();
        assert!(error.contains("adapt_local"), "{error}");
        assert!(tiled.map(SIDE, SIDE, bar(0), None, None).is_ok());
    });
}

#[test]
fn a_still_picture_comes_to_rest_at_its_own_adaptation() {
    with_gpu(|gpu| {
        for (from, to) in [(1.0, 50.0), (50.0, 1.0), (0.0, 1.0), (1.0, 0.0)] {
            for (operator, mode) in OPERATORS.into_iter().flat_map(|o| MODES.map(|m| (o, m))) {
                let settings = in_mode(operator, mode);
                let mut still = still(gpu, &settings);
                after(&mut still, from, 1, 0.1);
                after(&mut still, to, 60, 0.5);
                let one = still.map(SIDE, SIDE, ramp(to), None, Some(0.016)).unwrap();
                let two = still.map(SIDE, SIDE, ramp(to), None, Some(0.033)).unwrap();
                assert!(one.pixels == two.pixels && one.statistics.high.to_bits() == two.statistics.high.to_bits());
                let alone = still.map(SIDE, SIDE, ramp(to), None, None).unwrap();
                assert!(
                    one.pixels == alone.pixels,
                    "{operator:?} {mode:?}, {from} to {to}: at rest it is as if there had been nothing before"
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

/// A window that moves over a picture with a lamp in it, in every mode. From frame to frame statistics change by no more than 0.1 stops (the
/// limit), and the pixels that are in both frames, with all that their local adaptation sees, by no more than a stated bound:
///
/// - Reinhard's l / (1 + l_a): both change by at most k stops, and so does the whole, unless another scale is chosen for l_a, which depends on
///   the log-average; two neighbouring scales differ by little when that happens;
/// - of the bilateral operator's base, white and contrast change: γ (B − log L_max) by at most (1 + 2) k;
/// - Ashikhmin's curve from L_min, where it is 0, has no bound in stops; its display luminance changes by at most 0.03 of the display's white.
///
/// Without adaptation the same sequence jumps.
#[test]
fn a_panning_view_does_not_jump() {
    with_gpu(|gpu| {
        let (wide, side, frames, step, reach) = (112usize, 40usize, 15usize, 4usize, 10usize);
        let world: Vec<f32> = (0..wide * side)
            .map(|i| {
                let (x, y) = (i % wide, i / wide);
                let lamp = (x as i32 - 70).pow(2) + (y as i32 - 20).pow(2) < 16;
                let wave =
                    6.0 + 4.0 * (x as f32 * 0.21).sin() * (y as f32 * 0.17).cos() + 0.4 * ((x * 7 + y * 3) % 5) as f32;
                if lamp { 5000.0 } else { 0.01 * wave.exp2() }
            })
            .collect();
        let view = |frame: usize| -> Vec<[f32; 4]> {
            let from = |i: usize| i / side * wide + frame * step + i % side;
            (0..side * side).map(|i| world[from(i)]).map(|l| [l, l, l, 1.0]).collect()
        };
        let jump = |operator: Operator, mode: Mode, dt: Option<f32>| {
            // 6 stops a second at 60 frames a second.
            let settings = Settings { adapt_limit: 6.0, white: 1e9, threshold: Some(0.4), ..in_mode(operator, mode) };
            assert!((settings.reach(side as u32, side as u32) as usize) < reach);
            let mut still = still(gpu, &settings);
            let size = side as u32;
            let shown: Vec<_> = (0..frames).map(|f| still.map(size, size, view(f), None, dt).unwrap()).collect();
            let mut most = 0.0f32;
            for (f, pair) in shown.windows(2).enumerate() {
                for (a, b) in [
                    (pair[0].statistics.high, pair[1].statistics.high),
                    (pair[0].statistics.log_average, pair[1].statistics.log_average),
                ] {
                    let stops = (a / b).log2().abs();
                    assert!(dt.is_none() || stops <= 0.1 + 1e-3, "frame {f}: {stops} stops");
                }
                for (x, y) in (reach..side - reach).flat_map(|y| (reach..side - reach - step).map(move |x| (x, y))) {
                    let before = pair[0].pixels[y * side + x + step][0];
                    let now = pair[1].pixels[y * side + x][0];
                    most = most.max(match operator {
                        Operator::Ashikhmin => (before.min(1.0) - now.min(1.0)).abs(),
                        _ => (before / now).log2().abs(),
                    });
                }
            }
            most
        };
        for (operator, bound) in [(Operator::Reinhard, 0.1), (Operator::Bilateral, 0.3), (Operator::Ashikhmin, 0.03)] {
            for mode in MODES {
                let (adapted, alone) = (jump(operator, mode, Some(1.0 / 60.0)), jump(operator, mode, None));
                println!("{operator:?} {mode:?}: largest jump {adapted} with adaptation, {alone} without");
                assert!(adapted <= bound + 1e-3 && alone > 5.0 * adapted, "{operator:?} {mode:?}: {adapted} {alone}");
            }
        }
    });
}

/// A map of important pixels that serves several frames is that of the first of them; a mask is of its own frame.
#[test]
fn a_map_serves_as_many_frames_as_wanted() {
    with_gpu(|gpu| {
        let bar = |at: u32| -> Vec<[f32; 4]> {
            let light = |i: u32| if i % SIDE == at { 50.0 } else { 1.0 };
            (0..SIDE * SIDE).map(|i| [light(i), light(i), light(i), 1.0]).collect()
        };
        // A mask of so many pixels.
        let mask = |count: usize| -> Vec<f32> {
            (0..(SIDE * SIDE) as usize).map(|i| f32::from(u8::from(i < count))).collect()
        };
        for identify in [Identify::Sobel, Identify::Saliency] {
            for (scale, keep_map) in [(1, 3), (2, 2)] {
                let plain =
                    Settings { identify, identify_scale: scale, ..in_mode(Operator::Ashikhmin, Mode::Selective) };
                let kept = Settings { keep_map, ..plain.clone() };
                // The number of important pixels, and the picture.
                let shown = |still: &mut Still, at: u32, mask: Option<&[f32]>, dt: Option<f32>| {
                    let mapped = still.map(SIDE, SIDE, bar(at), mask, dt).unwrap();
                    (mapped.important.unwrap(), mapped.pixels)
                };
                // Without a bar (99) there is no detail.
                let alone = [99, 8].map(|at| shown(&mut still(gpu, &plain), at, None, Some(0.1)));
                assert!(alone[0].0 != alone[1].0, "{identify:?} {scale}: {} important pixels in both", alone[0].0);
                let mut on = still(gpu, &kept);
                assert!(shown(&mut on, 99, None, Some(0.1)) == alone[0], "the first frame has its own map");
                for frame in 1..2 * keep_map {
                    let found = shown(&mut on, 8, None, Some(0.1));
                    let (age, name) = (frame % keep_map, format!("{identify:?} {scale} {frame}"));
                    if age == 0 || frame > keep_map {
                        assert_eq!(found.0, alone[1].0, "{name}");
                    } else {
                        assert_eq!(found.0, alone[0].0, "{name}");
                        // The same frame again does not make the map older.
                        assert_eq!(shown(&mut on, 8, None, Some(0.0)).0, alone[0].0, "{name}");
                    }
                }
                // The map stays in its place: light moves from column 2 to column 12, but the important pixels do not. Local adaptation of the
                // important pixels alone is what the mask of their own frame gives.
                let mut on = still(gpu, &kept);
                shown(&mut on, 2, None, Some(0.1));
                let moved = shown(&mut on, 12, None, Some(0.1));
                let global = Settings { threshold: Some(1e18), ..plain.clone() };
                let [here, there] = [2, 12].map(|at| {
                    let local = Settings { threshold: Some(0.0), ..plain.clone() };
                    let of = |settings: &Settings, at: u32| shown(&mut still(gpu, settings), at, None, Some(0.1)).1;
                    let (map, none, all) = (of(&plain, at), of(&global, at), of(&local, at));
                    (map, none, all)
                });
                // Pixels whose global and local light differ tell which of the two they have.
                let marked = |list: &[[f32; 4]], none: &[[f32; 4]], all: &[[f32; 4]]| -> Vec<Option<bool>> {
                    (0..list.len()).map(|i| (none[i] != all[i]).then(|| list[i] == all[i])).collect()
                };
                let at_2 = marked(&here.0, &here.1, &here.2);
                let at_12 = marked(&moved.1, &there.1, &there.2);
                let known = at_2.iter().zip(&at_12).filter_map(|(a, b)| a.zip(*b)).collect::<Vec<_>>();
                assert!(known.iter().all(|(a, b)| a == b), "{identify:?} {scale}");
                // Saliency marks nearly all of so small a picture.
                let differs = at_12 != marked(&there.0, &there.1, &there.2);
                assert!(differs || identify == Identify::Saliency, "{identify:?} {scale}: the map has moved");
                // A mask counts in its frame, over a map of this frame and over an older one, and does not stay.
                let mut on = still(gpu, &kept);
                let all = (SIDE * SIDE) as usize;
                assert_eq!(shown(&mut on, 99, Some(&mask(all)), Some(0.1)).0 as usize, all);
                assert_eq!(shown(&mut on, 99, None, Some(0.1)).0, alone[0].0);
                let mut on = still(gpu, &kept);
                shown(&mut on, 99, None, Some(0.1));
                assert_eq!(shown(&mut on, 8, Some(&mask(all)), Some(0.1)).0 as usize, all);
                // A frame without a time, a cut, and another extent have their own map.
                let mut on = still(gpu, &kept);
                shown(&mut on, 99, None, Some(0.1));
                assert!(shown(&mut on, 8, None, None).0 == alone[1].0);
                shown(&mut on, 99, None, Some(0.1));
                on.tonemap().reset().unwrap();
                assert!(shown(&mut on, 8, None, Some(0.1)) == alone[1]);
                on.tonemap().reset().unwrap();
                shown(&mut on, 99, None, Some(0.1));
                on.map(SIDE / 2, 2 * SIDE, bar(1), None, Some(0.1)).unwrap();
                assert_eq!(shown(&mut on, 8, None, Some(0.1)).0, alone[1].0);
            }
        }
        let error = still(gpu, &Settings { keep_map: 2, ..in_mode(Operator::Ashikhmin, Mode::Selective) })
            .tiles(8)
            .map(SIDE, SIDE, bar(0), None, Some(0.1))
            .unwrap_err()
            .to_string();
        assert!(error.contains("keep_map is 2"), "{error}");
        let wrong = Settings { keep_map: 0, ..Settings::default() }.validate().unwrap_err().to_string();
        assert!(wrong.contains("keep_map"), "{wrong}");
    });
}
