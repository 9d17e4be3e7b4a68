use super::errors::{Errors, lights as lights_of};
use crate::experiment::{file, kinds};

#[test]
fn errors_of_known_pixels() {
    let truth = [[1.0, 2.0, 0.0], [3.0, 2.0, 4.0]];
    let test = [[1.0, 2.0, 0.0], [0.0, 2.0, 2.0]];
    let errors = Errors::of(2, &truth, &test, |_| true).unwrap();
    // Mean 2, squares 9 and 4 of six values.
    assert!((errors.rms - 100.0 * (13.0f64 / 6.0).sqrt() / 2.0).abs() < 1e-9);
    // The one block is off by −1.5, 0 and −1.
    assert!((errors.blocks - 100.0 * (3.25f64 / 3.0).sqrt() / 2.0).abs() < 1e-9);
    assert_eq!(errors.energy, [0.25, 1.0, 0.5]);
    assert!((errors.energy() - 1.75 / 3.0).abs() < 1e-12);
    let first = Errors::of(2, &truth, &test, |at| at == 0).unwrap();
    assert_eq!([first.rms, first.blocks], [0.0, 0.0]);
    assert_eq!(Errors::of(1, &[[0.0; 3]], &[[1.0; 3]], |_| true), None);
    // A colour without light has no energy.
    let red = Errors::of(1, &[[2.0, 0.0, 0.0]], &[[1.0, 0.0, 0.0]], |_| true).unwrap();
    assert!(red.energy() == 0.5 && red.energy[1].is_nan());
}

#[test]
fn noise_leaves_the_blocks() {
    // A checkerboard of errors around a grey picture, and one block of four that is off.
    let truth = vec![[1.0; 3]; 256];
    let sign = |at: usize| if (at / 16 + at % 16).is_multiple_of(2) { 0.1 } else { -0.1 };
    let noisy: Vec<[f32; 3]> = (0..256).map(|at| [1.0 + sign(at); 3]).collect();
    let errors = Errors::of(16, &truth, &noisy, |_| true).unwrap();
    assert!((errors.rms - 10.0).abs() < 1e-4 && errors.blocks < 1e-4, "{errors:?}");
    let off: Vec<[f32; 3]> = (0..256).map(|at| if at / 16 < 8 && at % 16 < 8 { [1.5; 3] } else { [1.0; 3] }).collect();
    let errors = Errors::of(16, &truth, &off, |_| true).unwrap();
    assert!((errors.blocks - 25.0).abs() < 1e-4 && (errors.rms - 25.0).abs() < 1e-4, "{errors:?}");
}

#[test]
fn every_light_of_the_experiment_has_its_reference() {
    for quick in [false, true] {
        let experiment = file::open("prt", quick).unwrap();
        let mut lights = Vec::new();
        let of = |kind: &'static str| experiment.methods.iter().filter(move |method| method.kind == kind);
        for method in of("prt-truth") {
            for variant in method.variants() {
                let settings = kinds::find(&method.kind).unwrap().effective(method, &variant).unwrap();
                lights.push((method.scenes.clone(), lights_of(&settings, "")));
            }
        }
        for method in of("prt") {
            for variant in method.variants() {
                let settings = kinds::find(&method.kind).unwrap().effective(method, &variant).unwrap();
                let frames = method.name.contains("1024×768");
                if settings["show"] != "total" || settings["picture"]["prt"]["strength"] != 1.0 || frames {
                    continue;
                }
                let light = (method.scenes.clone(), lights_of(&settings, "/picture/prt"));
                assert!(lights.contains(&light), "{}: {light:?}", method.name);
            }
        }
        let count = of("prt").find(|method| method.name == "ours").map_or(0, |method| method.variant_count());
        assert_eq!(count, if quick { 4 } else { 12 });
    }
}

#[test]
fn the_settings_beside_each_other_are_the_papers_and_the_defaults() {
    let experiment = file::open("prt", false).unwrap();
    let settings = |name: &str| {
        let method = experiment.methods.iter().find(|method| method.name == name).unwrap();
        let variant = method.variants().remove(0);
        kinds::find("prt").unwrap().effective(method, &variant).unwrap()
    };
    let bake = |name: &str| {
        serde_json::from_value::<lucerna::techniques::prt::Baking>(settings(name)["bake"].clone()).unwrap()
    };
    use lucerna::techniques::prt::Baking;
    assert_eq!(
        [bake("ours"), bake("paper"), bake("paper, equation 10")],
        [Baking::default(), Baking::paper(), Baking::paper()]
    );
    for (name, mean) in [("paper", true), ("paper, equation 10", false)] {
        assert_eq!(settings(name)["picture"]["prt"]["mean"], mean, "{name}");
    }
}
