//! Operators on the device: the fast way of local adaptation against its definition, images without anything to adapt to, closed forms.

use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    reference::tonemap as twin,
    techniques::tonemap::{Local, Mode, Operator, Settings, apply},
};

fn noise(seed: u32) -> impl FnMut() -> f32 {
    let mut state = seed.wrapping_mul(747_796_405).wrapping_add(1);
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    }
}

/// Patches of very different light with texture, as photographs have them.
fn picture(width: u32, height: u32, seed: u32) -> Vec<[f32; 4]> {
    let mut next = noise(seed);
    let patches: Vec<[f32; 4]> =
        (0..64).map(|_| [10f32.powf(5.0 * next() - 3.0), 0.2 + 0.8 * next(), 0.2 + 0.8 * next(), next()]).collect();
    (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let [l, r, g, a] = patches[((x / 17 + 3 * (y / 23)) % 64) as usize];
            let l = l * (0.8 + 0.4 * next());
            [l * r, l * g, l, a]
        })
        .collect()
}

fn run(gpu: &Gpu, width: u32, height: u32, pixels: &[[f32; 4]], settings: &Settings) -> Vec<[f32; 4]> {
    apply(gpu, width, height, pixels, None, settings).unwrap().pixels
}

fn with(operator: Operator, mode: Mode) -> Settings {
    Settings { operator, mode: Some(mode), ..Settings::paper() }
}

/// A pixel whose contrast is at the limit to the last bits may fall on either side: such pixels are counted, all others are near.
#[test]
fn fast_local_adaptation_is_the_definition() {
    with_gpu(|gpu| {
        for (operator, radius, scales) in [
            (Operator::Ashikhmin, 10, 8),
            (Operator::Ashikhmin, 1, 8),
            (Operator::Ashikhmin, 16, 8),
            (Operator::Reinhard, 10, 8),
            (Operator::Reinhard, 10, 1),
        ] {
            let large = if radius == 10 && scales == 8 { (61, 43) } else { (17, 14) };
            for (width, height) in [(1, 1), (1, 50), (40, 1), (9, 8), large] {
                let pixels = picture(width, height, width);
                let fast = Settings { radius, scales, ..with(operator, Mode::Local) };
                let literal = Settings { local: Local::Literal, ..fast.clone() };
                let fast = run(gpu, width, height, &pixels, &fast);
                let literal = run(gpu, width, height, &pixels, &literal);
                let far = fast
                    .iter()
                    .flatten()
                    .zip(literal.iter().flatten())
                    .filter(|(f, l)| (**f - **l).abs() > 2e-5 * l.abs() + 1e-7)
                    .count();
                assert!(far <= fast.len() / 1000, "{operator:?} {radius} {scales}, {width}×{height}: {far} values");
            }
        }
    });
}

/// The blocks of the fast bilateral filter: exact where a block is a pixel, near the definition elsewhere.
#[test]
fn fast_bilateral_filter_is_near_its_definition() {
    with_gpu(|gpu| {
        for (spatial, mean, most) in [(0.03, 1e-6, 1e-5), (0.08, 0.006, 0.05)] {
            let (width, height) = (90, 60);
            let pixels = picture(width, height, 3);
            let fast = Settings { spatial, ..with(Operator::Bilateral, Mode::Local) };
            let literal = Settings { local: Local::Literal, ..fast.clone() };
            let fast = run(gpu, width, height, &pixels, &fast);
            let literal = run(gpu, width, height, &pixels, &literal);
            let errors: Vec<f32> = fast.iter().zip(&literal).map(|(f, l)| (f[2] / l[2] - 1.0).abs()).collect();
            let found = errors.iter().sum::<f32>() / errors.len() as f32;
            let largest = errors.iter().copied().fold(0.0, f32::max);
            println!("spatial {spatial}: mean {found}, largest {largest}");
            assert!(found < mean && largest < most, "{spatial}: mean {found}, largest {largest}");
        }
    });
}

#[test]
fn a_pixel_unlike_all_blocks_keeps_its_own_luminance() {
    with_gpu(|gpu| {
        // The upper mean of their block lies between both bright pixels, a decade and a half from each.
        let (width, height) = (90, 60);
        let mut pixels = vec![[1.0, 1.0, 1.0, 1.0]; 90 * 60];
        let bright = [(42, 30, 1e3), (43, 30, 1e6)].map(|(x, y, l)| (y * 90 + x, l));
        bright.iter().for_each(|(i, l)| pixels[*i] = [*l, *l, *l, 1.0]);
        // The base alone.
        let fast = Settings { spatial: 0.08, detail: 0.0, ..with(Operator::Bilateral, Mode::Local) };
        let literal = Settings { local: Local::Literal, ..fast.clone() };
        let [fast, literal] = [fast, literal].map(|settings| run(gpu, width, height, &pixels, &settings));
        for (i, _) in bright {
            let (found, exact) = (fast[i][1], literal[i][1]);
            println!("{found} and {exact}");
            assert!((found / exact - 1.0).abs() < 0.05, "pixel {i}: {found} instead of {exact}");
        }
    });
}

#[test]
fn the_edge_repeats_beyond_the_border_whatever_blocks_it_cuts() {
    with_gpu(|gpu| {
        // A brighter column that is all of the last block weighs as all that repeat it.
        for (width, height) in [(88u32, 60), (91, 60), (94, 60)] {
            let last = |i: usize| i % width as usize == width as usize - 1;
            let light = |i: usize| if last(i) { 1.5 } else { 1.0 };
            let pixels: Vec<_> = (0..(width * height) as usize).map(|i| [light(i); 3]).collect();
            let pixels: Vec<_> = pixels.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect();
            // The base alone.
            let fast = Settings { spatial: 0.08, detail: 0.0, ..with(Operator::Bilateral, Mode::Local) };
            let literal = Settings { local: Local::Literal, ..fast.clone() };
            let [fast, literal] = [fast, literal].map(|settings| run(gpu, width, height, &pixels, &settings));
            let offs = fast.iter().zip(&literal).map(|(f, l)| f64::from(f[1] / l[1] - 1.0));
            let (mean, most) =
                offs.clone().fold((0.0, 0f64), |(s, m), off| (s + off / offs.len() as f64, m.max(off.abs())));
            println!("{width}: {mean:.5} off in the mean, {most:.4} at most");
            assert!(mean.abs() < 0.003 && most < 0.03, "{width}: {mean} off in the mean, {most} at most");
        }
    });
}

#[test]
fn the_bilateral_operator_never_raises_the_contrast_of_the_base() {
    with_gpu(|gpu| {
        // Luminances within a factor of two: less than what the display has.
        let pixels: Vec<_> = (0..64).map(|i| [1.0 + i as f32 / 63.0; 3]).map(|[r, g, b]| [r, g, b, 1.0]).collect();
        let shown = run(gpu, 8, 8, &pixels, &with(Operator::Bilateral, Mode::Global));
        for (shown, pixel) in shown.iter().zip(&pixels) {
            assert!((shown[1] / (pixel[1] / 2.0) - 1.0).abs() < 1e-4, "{} of {}", shown[1], pixel[1]);
        }
    });
}

/// Windows that grow, against the twin on the CPU. A pixel whose contrast is at the limit to the last bits may fall on either side.
#[test]
fn growing_windows_are_those_of_the_twin() {
    with_gpu(|gpu| {
        for (radius, width, height) in [(1, 40, 1), (2, 1, 1), (5, 61, 43), (10, 37, 50), (16, 61, 43), (16, 9, 8)] {
            let pixels: Vec<[f32; 4]> =
                picture(width, height, radius).iter().map(|p| [p[0], p[1], p[2], 1.0]).collect();
            let settings = Settings { radius, local: Local::Growing, ..with(Operator::Ashikhmin, Mode::Local) };
            let found = run(gpu, width, height, &pixels, &settings);
            let rgb: Vec<[f32; 3]> = pixels.iter().map(|p| [p[0], p[1], p[2]]).collect();
            let twin = twin::tonemap(width, height, &rgb, &settings);
            let far = |(a, b): &(&[f32; 4], &[f32; 3])| (0..3).any(|c| (a[c] - b[c]).abs() > 1e-4 * (1.0 + b[c].abs()));
            let far = found.iter().zip(&twin).filter(far).count();
            assert!(far * 500 <= twin.len(), "radius {radius}, {width}×{height}: {far} of {}", twin.len());
            let fast = run(gpu, width, height, &pixels, &Settings { local: Local::Fast, ..settings.clone() });
            assert!(twin.len() < 100 || fast != found, "windows are not Gaussians");
        }
        let other = Settings { local: Local::Growing, ..with(Operator::Reinhard, Mode::Local) };
        let error = apply(gpu, 1, 1, &[[1.0; 4]], None, &other).unwrap_err().to_string();
        assert!(error.contains("growing"), "{error}");
    });
}

#[test]
fn images_without_anything_to_adapt_to() {
    with_gpu(|gpu| {
        for (operator, mode) in [Operator::Ashikhmin, Operator::Reinhard, Operator::Bilateral]
            .into_iter()
            .flat_map(|o| [(o, Mode::Global), (o, Mode::Local)])
            .chain(Operator::ALL[3..].iter().map(|(_, o)| (*o, if o.solves() { Mode::Local } else { Mode::Global })))
        {
            let ways = if mode == Mode::Global || operator.solves() {
                &[Local::Fast][..]
            } else {
                &[Local::Fast, Local::Literal, Local::Pyramid]
            };
            for &local in ways.iter().chain((operator == Operator::Ashikhmin).then_some(&Local::Growing)) {
                let settings = Settings { local, ..with(operator, mode) };
                let name = format!("{operator:?} {mode:?} {local:?}");
                for (width, height) in [(1, 1), (5, 3)] {
                    let count = (width * height) as usize;
                    let black = run(gpu, width, height, &vec![[0.0, 0.0, 0.0, 0.5]; count], &settings);
                    assert!(
                        black.iter().all(|p| p[..3].iter().all(|v| v.abs() < 1e-3) && p[3] == 0.5),
                        "{name}: {black:?}"
                    );
                    let even = run(gpu, width, height, &vec![[3.0, 3.0, 3.0, 1.0]; count], &settings);
                    let first = even[0];
                    assert!(first[0] > 0.0 && first.iter().all(|v| v.is_finite()), "{name}: {first:?}");
                    assert!(even.iter().all(|p| (0..3).all(|c| (p[c] - first[c]).abs() < 1e-5)), "{name}: {even:?}");
                }
                let mut hot = vec![[0.01, 0.01, 0.01, 1.0]; 20 * 12];
                hot[6 * 20 + 11] = [1e30, 1e30, 1e30, 1.0];
                let hot = run(gpu, 20, 12, &hot, &settings);
                assert!(hot.iter().flatten().all(|v| v.is_finite() && *v > -0.01), "{name}");
                let spot = hot[6 * 20 + 11][1];
                assert!(hot.iter().all(|p| p[1] <= spot), "{name}: nothing outshines the hot pixel");
            }
        }
    });
}

/// A picture of one luminance L: Ashikhmin makes it white, Reinhard L key / L … of its closed forms.
#[test]
fn one_luminance_has_closed_forms() {
    with_gpu(|gpu| {
        let grey = vec![[4.0, 4.0, 4.0, 1.0]; 12];
        let value = |settings: &Settings| run(gpu, 4, 3, &grey, settings)[5][1];
        let near = |found: f32, wanted: f32| assert!((found - wanted).abs() < 2e-5, "{found} {wanted}");
        for mode in [Mode::Global, Mode::Local] {
            near(value(&with(Operator::Ashikhmin, mode)), 1.0);
        }
        near(value(&with(Operator::Reinhard, Mode::Global)), 1.0);
        near(value(&with(Operator::Reinhard, Mode::Local)), 0.18 / 1.18);
        near(value(&Settings { white: 3.0, ..with(Operator::Reinhard, Mode::Global) }), 0.18 * 1.02 / 1.18);
        near(value(&Settings { exposure: -1.0, ..with(Operator::Linear, Mode::Global) }), 2.0);
        near(value(&Settings { normalize: true, exposure: -1.0, ..with(Operator::Linear, Mode::Global) }), 0.5);
        near(
            value(&Settings { white: 8.0, ..with(Operator::ReinhardGlobal, Mode::Global) }),
            4.0 * (1.0 + 4.0 / 64.0) / 5.0,
        );
        near(value(&with(Operator::ReinhardGlobal, Mode::Global)), 1.0);
        // Middle grey of AgX is 1/2 before the power.
        let middle = Settings { exposure: (0.18f32 / 4.0).log2(), ..with(Operator::Agx, Mode::Global) };
        assert!((value(&middle) - 0.5f32.powf(2.2)).abs() < 1e-4, "{}", value(&middle));
        // Khronos PBR Neutral: the Fresnel offset below 0.76.
        near(value(&Settings { exposure: -3.0, ..with(Operator::Neutral, Mode::Global) }), 0.46);
    });
}

#[test]
fn tiles_change_no_bit_of_local_operators() {
    with_gpu(|gpu| {
        use lucerna::techniques::tonemap::Still;
        let (width, height) = (120, 90);
        let pixels = picture(width, height, 5);
        for operator in [Operator::Ashikhmin, Operator::Reinhard, Operator::Bilateral] {
            for local in [Local::Fast, Local::Pyramid] {
                let settings = Settings { spatial: 0.05, local, ..with(operator, Mode::Local) };
                let whole = Still::new(gpu, &settings).unwrap().map(width, height, pixels.clone(), None, None).unwrap();
                let cut = Still::new(gpu, &settings)
                    .unwrap()
                    .tiles(50)
                    .map(width, height, pixels.clone(), None, None)
                    .unwrap();
                assert!(whole.pixels == cut.pixels, "{operator:?} {local:?}");
            }
        }
    });
}

/// Hue and saturation: operators that scale luminance change the ratios of red, green and blue by nothing but rounding, in any mode. The
/// curves of colours change them by definition: bright colours go to white.
#[test]
fn operators_that_scale_luminance_keep_the_ratios_of_colours() {
    with_gpu(|gpu| {
        let (width, height) = (61, 43);
        let pixels = picture(width, height, 11);
        for (_, operator) in Operator::ALL {
            for mode in [Mode::Global, Mode::Local, Mode::Selective] {
                let settings = Settings { threshold: Some(1.0), ..with(operator, mode) };
                if settings.validate().is_err() {
                    continue;
                }
                let shown = run(gpu, width, height, &pixels, &settings);
                let mut most = 0.0f32;
                for (before, after) in pixels.iter().zip(&shown) {
                    let largest = |p: &[f32; 4]| p[0].max(p[1]).max(p[2]);
                    // What became black has no hue.
                    if largest(after) > 1e-6 {
                        let ratios = |p: &[f32; 4]| [0, 1, 2].map(|c| p[c] / largest(p));
                        let apart = ratios(before).into_iter().zip(ratios(after)).map(|(a, b)| (a - b).abs());
                        most = most.max(apart.fold(0.0, f32::max));
                    }
                }
                println!("{operator:?} {mode:?}: ratios change by at most {most}");
                let changes =
                    matches!(operator, Operator::Aces | Operator::Agx | Operator::Neutral | Operator::ReinhardDevlin);
                assert!(if changes { most > 0.05 } else { most < 1e-6 }, "{operator:?} {mode:?}: {most}");
            }
        }
    });
}
