//! Arithmetic measures against values worked out by hand, and what every measure must keep.

use lucerna::measure::{Display, Exposure, Map, Measure, NrmseRange, Options, Pair, Picture, Space, magma};

fn noise(seed: u32, width: u32, height: u32) -> Picture {
    let mut state = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    Picture::from_fn(width, height, |_, _| {
        [(); 3].map(|()| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        })
    })
}

fn of(measure: Measure, reference: &Picture, test: &Picture) -> f64 {
    measure.of(&Pair::new(reference, test).unwrap(), &Options::default()).unwrap().value
}

fn picture(pixels: &[[f32; 3]]) -> Picture {
    Picture::new(pixels.len() as u32, 1, pixels.to_vec()).unwrap()
}

fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b}");
}

#[test]
fn worked_by_hand() {
    let reference = picture(&[[1.0, 0.0, 2.0], [3.0, 4.0, 4.0]]);
    let test = picture(&[[1.5, 0.0, 1.0], [3.0, 2.0, 4.0]]);
    // |r − t|: 0.5 0 1, 0 2 0.
    close(of(Measure::Mae, &reference, &test), 3.5 / 6.0, 1e-12);
    close(of(Measure::Rmse, &reference, &test), (5.25_f64 / 6.0).sqrt(), 1e-12);
    // Ranges 2, 4, 2; errors √(0.25/2), √(4/2), √(1/2).
    let nrmse = (0.125_f64.sqrt() / 2.0 + 2_f64.sqrt() / 4.0 + 0.5_f64.sqrt() / 2.0) / 3.0;
    close(of(Measure::Nrmse, &reference, &test), nrmse, 1e-12);
    let e = 0.01;
    let rel = (0.25 / (1.0 + e) + 1.0 / (4.0 + e) + 4.0 / (16.0 + e)) / 6.0;
    close(of(Measure::RelMse, &reference, &test), rel, 1e-12);
    // Luminances 0.357, 3.7874 and 0.3911, 2.357.
    let y = |p: [f64; 3]| 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
    let (a, b) = (y([1.0, 0.0, 2.0]), y([3.0, 4.0, 4.0]));
    let (ea, eb) = ((a - y([1.5, 0.0, 1.0])) / a, (b - y([3.0, 2.0, 4.0])) / b);
    close(of(Measure::MeanPercent, &reference, &test), 50.0 * (ea.abs() + eb.abs()), 1e-5);
    close(of(Measure::RmsPercent, &reference, &test), 100.0 * ((ea * ea + eb * eb) / 2.0).sqrt(), 1e-5);
    // One grey level of 0.1 in sRGB codes is 20 dB.
    let codes = |v: f32| picture(&[[lucerna::image::srgb::decode(v); 3]; 4]);
    close(of(Measure::Psnr, &codes(0.5), &codes(0.4)), 20.0, 1e-4);
}

#[test]
fn correlation_is_one_for_any_rising_line() {
    let reference = noise(1, 32, 16);
    let line =
        |a: f32, b: f32| Picture::from_fn(32, 16, |x, y| reference.pixels[(y * 32 + x) as usize].map(|v| a * v + b));
    close(of(Measure::Pearson, &reference, &line(0.25, 3.0)), 1.0, 1e-6);
    close(of(Measure::Pearson, &reference, &line(-2.0, 1.0)), -1.0, 1e-6);
    close(of(Measure::Pearson, &reference, &noise(2, 32, 16)), 0.0, 0.1);
    let flat = picture(&[[1.0; 3]; 4]);
    assert_eq!(of(Measure::Pearson, &flat, &flat), 1.0);
    let undefined =
        Measure::Pearson.of(&Pair::new(&flat, &picture(&[[2.0; 3]; 4])).unwrap(), &Options::default()).unwrap();
    assert!(undefined.value.is_nan() && undefined.note.unwrap().contains("not defined"));
}

#[test]
fn black_pixels_of_the_reference_are_left_out_of_relative_errors() {
    let reference = picture(&[[0.0; 3], [1.0; 3], [0.0; 3]]);
    let test = picture(&[[1.0; 3], [1.5; 3], [0.0; 3]]);
    let measured = Measure::MeanPercent.of(&Pair::new(&reference, &test).unwrap(), &Options::default()).unwrap();
    close(measured.value, 25.0, 1e-9);
    assert_eq!(measured.detail("left_out_pixels"), Some(1.0));
    let black = picture(&[[0.0; 3]; 2]);
    assert!(of(Measure::RmsPercent, &black, &picture(&[[1.0; 3]; 2])).is_nan());
}

#[test]
fn three_images() {
    let reference = picture(&[[1.0; 3], [1.0; 3], [1.0; 3], [1.0; 3]]);
    let baseline = picture(&[[0.5; 3], [0.5; 3], [1.0; 3], [0.5; 3]]);
    let test = picture(&[[0.75; 3], [1.5; 3], [1.25; 3], [1.0; 3]]);
    let pair = Pair::new(&reference, &test).unwrap().with_baseline(&baseline).unwrap();
    let of = |measure: Measure, pair: &Pair<'_>| measure.of(pair, &Options::default()).unwrap();
    // Errors: 1.5 against 1.0 in sum.
    close(of(Measure::Gain, &pair).value, 100.0 / 3.0, 1e-9);
    assert_eq!(of(Measure::Fq, &pair).value, -1.0);
    let improved = of(Measure::Improved, &pair);
    assert_eq!((improved.value, improved.detail("equal"), improved.detail("worse")), (50.0, Some(25.0), Some(25.0)));
    assert_eq!(improved.map.values, [1.0, 0.0, -1.0, 1.0]);
    let swapped = Pair::new(&reference, &baseline).unwrap().with_baseline(&test).unwrap();
    assert_eq!((of(Measure::Fq, &swapped).value, of(Measure::Gain, &swapped).value), (1.0, -50.0));
    let same = Pair::new(&reference, &test).unwrap().with_baseline(&test).unwrap();
    assert_eq!((of(Measure::Fq, &same).value, of(Measure::Gain, &same).value), (0.0, 0.0));
    // The pixels' gains have the gain as their mean.
    let map: Map = of(Measure::Gain, &pair).map;
    close(map.values.iter().map(|v| f64::from(*v)).sum::<f64>() / 4.0, 100.0 / 3.0, 1e-5);
    let none = Measure::Gain.of(&Pair::new(&reference, &test).unwrap(), &Options::default()).unwrap_err();
    assert!(none.exit_code() == 2 && none.to_string().contains("baseline"));
}

#[test]
fn what_is_chosen_is_done() {
    let (reference, test) = (noise(3, 20, 20), noise(4, 20, 20));
    let pair = Pair::new(&reference, &test).unwrap();
    let with = |measure: Measure, options: Options| measure.of(&pair, &options).unwrap().value;
    let plain = Options::default();
    let brighter = Display { exposure: Exposure::Stops(2.0), ..Display::default() };
    // Linear values know no exposure, displayed ones do.
    assert_eq!(with(Measure::Mae, plain.clone()), with(Measure::Mae, Options { display: brighter, ..plain.clone() }));
    let shown = Options { space: Some(Space::Display), ..plain.clone() };
    assert_ne!(with(Measure::Mae, shown.clone()), with(Measure::Mae, Options { display: brighter, ..shown }));
    let both = Options { nrmse_range: NrmseRange::Both, ..plain.clone() };
    assert!(with(Measure::Nrmse, both) < with(Measure::Nrmse, plain.clone()));
    for wrong in [
        Options { rel_mse_epsilon: 0.0, ..plain.clone() },
        Options { pixels_per_degree: f64::NAN, ..plain.clone() },
        Options { pdiff_fov: 90.0, ..plain.clone() },
        Options { flip_start: Some(1.0), flip_stop: Some(0.0), ..plain.clone() },
    ] {
        assert_eq!(Measure::Mae.of(&pair, &wrong).unwrap_err().exit_code(), 2);
    }
}

#[test]
fn every_measure_likes_the_reference_best_and_no_number_of_threads_matters() {
    let reference = noise(5, 181, 177);
    let worse = |amount: f32| {
        let other = noise(6, 181, 177);
        let mix = |i: usize| std::array::from_fn(|c| reference.pixels[i][c] + amount * (other.pixels[i][c] - 0.5));
        Picture::from_fn(181, 177, |x, y| mix((y * 181 + x) as usize))
    };
    let baseline = worse(0.2);
    for measure in Measure::ALL {
        let info = measure.info();
        let measure_at = |test: &Picture, threads: usize| {
            let pair = Pair::new(&reference, test).unwrap().with_baseline(&baseline).unwrap();
            let options = Options { threads: Some(threads), ..Options::default() };
            measure.of(&pair, &options).unwrap()
        };
        let values: Vec<f64> = [0.0, 0.02, 0.1, 0.4].map(|amount| measure_at(&worse(amount), 2).value).to_vec();
        let better = |a: f64, b: f64| if info.higher_is_better { a >= b } else { a <= b };
        assert!(values.windows(2).all(|pair| better(pair[0], pair[1])), "{measure}: {values:?}");
        assert!(better(values[0], values[3]) && values[0] != values[3], "{measure}: {values:?}");
        let one = measure_at(&worse(0.1), 1);
        for threads in [2, 3, 5] {
            assert_eq!(one, measure_at(&worse(0.1), threads), "{measure} on {threads} threads");
        }
        let map = &one.map;
        assert!(map.values.len() == 181 * 177 && map.values.iter().all(|v| v.is_finite()), "{measure}");
        assert!(map.range[0] < map.range[1] && !map.meaning.is_empty(), "{measure}");
    }
}

#[test]
fn maps_are_magma() {
    assert_eq!((magma(0.0), magma(1.0), magma(f32::NAN)), ([0, 0, 4], [252, 253, 191], [0, 0, 4]));
    let lightness = |v: f32| magma(v).iter().map(|c| u32::from(*c)).sum::<u32>();
    assert!((0..100).all(|i| lightness(i as f32 / 100.0) <= lightness((i + 1) as f32 / 100.0)));
    let map = Map { width: 2, height: 1, values: vec![0.0, 10.0], range: [0.0, 5.0], meaning: "test" };
    let picture = map.picture();
    let codes: Vec<u8> = picture.layers[0].data.iter().map(|v| lucerna::image::srgb::encode_u8(*v)).collect();
    assert_eq!(codes, [magma(0.0), magma(1.0)].concat());
    assert_eq!((map.quantile(0.0), map.quantile(1.0)), (0.0, 10.0));
}
