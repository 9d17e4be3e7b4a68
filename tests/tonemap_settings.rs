//! Every setting of tone mapping, away from its default, on the device against the CPU twin: colours, not luminance alone.

use lucerna::{
    gpu::testing::with_gpu,
    reference::tonemap as twin,
    techniques::tonemap::{Local, Mode, Operator, Settings, apply},
};

const WIDTH: u32 = 33;
const HEIGHT: u32 = 21;

/// Patches from 10⁻³ to 10³ in different colours, with texture.
fn picture() -> Vec<[f32; 3]> {
    let mut state = 12345u32;
    let mut next = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    let patches: Vec<[f32; 4]> = (0..16).map(|_| [6.0 * next() - 3.0, next(), next(), next()]).collect();
    (0..WIDTH * HEIGHT)
        .map(|i| {
            let [stops, r, g, b] = patches[(i % WIDTH / 9 + 4 * (i / WIDTH / 6)) as usize];
            let light = 10f32.powf(stops) * (0.7 + 0.6 * next());
            [r, g, b].map(|c| light * (0.1 + 0.9 * c))
        })
        .collect()
}

/// What is changed, and the settings before and after.
fn cases() -> Vec<(String, Settings, Settings)> {
    type Change = (&'static str, fn(&mut Settings));
    let all: &[Change] = &[
        ("exposure", |s| s.exposure = 1.5),
        ("exposure", |s| s.exposure = -2.25),
        ("saturation", |s| s.saturation = Some(0.6)),
    ];
    let ranged: &[Change] = &[("percentile", |s| s.percentile = 6.0), ("normalize", |s| s.normalize = true)];
    let of = |operator| -> &[Change] {
        match operator {
            Operator::Ashikhmin => {
                &[("display", |s| s.display = 230.0), ("radius", |s| s.radius = 4), ("contrast", |s| s.contrast = 0.2)]
            }
            Operator::Reinhard => &[
                ("key", |s| s.key = 0.36),
                ("scales", |s| s.scales = 4),
                ("phi", |s| s.phi = 5.0),
                ("epsilon", |s| s.epsilon = 0.2),
            ],
            Operator::ReinhardGlobal => &[("white", |s| s.white = 3.0)],
            Operator::Drago => &[("bias", |s| s.bias = 0.7)],
            Operator::ReinhardDevlin => &[
                ("intensity", |s| s.intensity = 1.5),
                ("receptor_contrast", |s| s.receptor_contrast = Some(0.45)),
                ("chromatic", |s| s.chromatic = 0.6),
                ("adaptation", |s| s.adaptation = 0.3),
            ],
            Operator::Fattal => {
                &[("alpha", |s| s.alpha = 0.5), ("beta", |s| s.beta = 0.7), ("clipped", |s| s.clipped = Some(3.0))]
            }
            Operator::Mantiuk => {
                &[("contrast_scale", |s| s.contrast_scale = 0.6), ("clipped", |s| s.clipped = Some(3.0))]
            }
            Operator::Bilateral => &[
                ("spatial", |s| s.spatial = 0.08),
                ("range", |s| s.range = 0.9),
                ("base_contrast", |s| s.base_contrast = 30.0),
                ("detail", |s| s.detail = 1.6),
            ],
            _ => &[],
        }
    };
    let mut out = Vec::new();
    for (name, operator) in Operator::ALL {
        for mode in [Mode::Global, Mode::Local] {
            let base = Settings { operator, mode: Some(mode), local: Local::Literal, ..Settings::paper() };
            if base.validate().is_err() {
                continue;
            }
            let scales = !matches!(operator, Operator::Linear | Operator::Aces | Operator::Agx | Operator::Neutral);
            let mut changes: Vec<Change> = all.to_vec();
            changes.extend(if scales { ranged } else { &ranged[1..] });
            changes.extend(of(operator));
            if mode == Mode::Local {
                changes.push(("contrast_limit", |s| s.contrast_limit = Some(1.1)));
            }
            out.push((format!("{name} {mode:?}"), base.clone(), base.clone()));
            for (what, change) in changes {
                let mut changed = base.clone();
                change(&mut changed);
                out.push((format!("{name} {mode:?} {what}"), base.clone(), changed));
            }
        }
    }
    out
}

#[test]
fn every_setting_does_on_the_device_as_by_the_definition() {
    let pixels = picture();
    let with_alpha: Vec<[f32; 4]> = pixels.iter().map(|p| [p[0], p[1], p[2], 1.0]).collect();
    let mut means = std::collections::BTreeMap::<String, bool>::new();
    with_gpu(|gpu| {
        for (name, before, settings) in cases() {
            let expected = twin::tonemap(WIDTH, HEIGHT, &pixels, &settings);
            let found = apply(gpu, WIDTH, HEIGHT, &with_alpha, None, &settings).unwrap().pixels;
            let near = |a: f32, b: f32| (a - b).abs() <= 1e-3 * b.abs() + 2e-5;
            let far = found.iter().zip(&expected).filter(|(a, b)| !(0..3).all(|c| near(a[c], b[c]))).count();
            // Where a neighbourhood is even to the last bits the search may end on either side.
            assert!(far <= pixels.len() / 100, "{name}: {far} of {} pixels differ", pixels.len());
            // The change does something in at least one of the operators and modes, by the definition.
            let does = twin::tonemap(WIDTH, HEIGHT, &pixels, &before) != expected;
            if let Some(what) = name.split(' ').nth(2) {
                *means.entry(what.to_owned()).or_default() |= does;
            }
        }
    });
    assert!(means.len() == 26 || means.is_empty(), "{means:?}");
    assert!(means.values().all(|does| *does), "{means:?}");
}
