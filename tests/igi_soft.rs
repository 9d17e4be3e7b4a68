//! The filter for the noise of direct light from emissive surfaces and from the sky, and of compensated light: against its twin, and its effect on
//! pictures.

use crate::igi_lab::{
    Studio, mean,
    twins::{Texels, is_lit, soft},
};
use crate::isr_lab::{Random, gbuffer, image, read, scene};
use crate::tracer_lab::{Stage, view};
use glam::{DVec4, Vec3, dvec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    graph::{Extent, Graph},
    reference::isr_scene::{Buffers, Eye},
    scene::{Environment, Material, Pose, View},
    techniques::igi::{Settings, filters},
};
use lucerna_scenes as builtin;

const SIZE: (usize, usize) = (45, 34);

/// Surfaces with edges, steps and background, and random light with halves that differ by about its noise.
fn stage() -> (Eye, Buffers, Texels) {
    let (_, patches) = scene(SIZE.0, SIZE.1);
    let eye = Eye::look_at(dvec3(0.3, 1.2, 0.9), dvec3(0.0, 0.25, -1.3), 0.8, 10.0, SIZE.0, SIZE.1);
    let mut buffers = Buffers::cast(&eye, &patches, 1);
    // Unlit surfaces, which have no part in it.
    buffers.mask.iter_mut().step_by(7).for_each(|mask| *mask = 0.0);
    let mut random = Random(21);
    let texel = |_| {
        let [r, g, b, a] = random.texel();
        [r, g, b, 0.5 * a - 0.2]
    };
    let noisy = (0..SIZE.0 * SIZE.1).map(texel).collect();
    (eye, buffers, noisy)
}

fn filtered(
    gpu: &lucerna::gpu::Gpu,
    eye: &Eye,
    buffers: &Buffers,
    noisy: &Texels,
    turns: u32,
    rare: bool,
) -> Vec<[f32; 4]> {
    let mut graph = Graph::new("soft");
    let g = gbuffer(&mut graph, eye, buffers);
    let extent = Extent::new(SIZE.0 as u32, SIZE.1 as u32);
    let soft = image(&mut graph, "soft", extent, noisy);
    let light = filters::soft_light(&mut graph, &g, soft, turns, rare);
    let [light] = read(gpu, graph, [light]);
    light
}

#[test]
fn it_agrees_with_its_twin_and_keeps_the_light() {
    with_gpu(|gpu| {
        let (eye, buffers, noisy) = stage();
        for (turns, rare) in [(0, false), (1, false), (2, false), (4, false), (0, true), (3, true)] {
            let found = filtered(gpu, &eye, &buffers, &noisy, turns, rare);
            let expected = soft(&eye, &buffers, &noisy, turns, rare);
            let (mut before, mut after) = (DVec4::ZERO, DVec4::ZERO);
            let mut seen = 0;
            for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
                let found = glam::Vec4::from(*found).as_dvec4();
                let Some(expected) = expected else {
                    assert_eq!(found.w, -1.0, "{turns} turns, pixel {i} shows nothing");
                    continue;
                };
                seen += 1;
                let off = (found - *expected).abs().max_element();
                assert!(off < 2e-4, "{turns} turns, pixel {i}: {found} instead of {expected}");
                before += glam::Vec4::from(noisy[i]).as_dvec4();
                after += found;
            }
            assert!(seen > 600 && seen < found.len(), "{seen} pixels show something");
            let change = (after / before - 1.0).truncate().abs().max_element();
            assert!(change < 1e-5, "{turns} turns change the light by {change}");
        }
    });
}

#[test]
fn light_stays_on_its_surface() {
    with_gpu(|gpu| {
        let (eye, buffers, mut noisy) = stage();
        // The surface of the first pixel that shows something has light, with much noise; others have none.
        let first = (0..buffers.depth.len()).find(|i| is_lit(&buffers, *i)).unwrap();
        let alike = |i: usize| buffers.normal[i].dot(buffers.normal[first]) > 0.99;
        for (i, texel) in noisy.iter_mut().enumerate() {
            texel[3] = 2.0;
            if !alike(i) {
                *texel = [0.0, 0.0, 0.0, 2.0];
            }
        }
        let found = filtered(gpu, &eye, &buffers, &noisy, 3, false);
        let (mut lit, mut dark) = (0.0f32, 0.0f32);
        for (i, texel) in found.iter().enumerate().filter(|(i, _)| is_lit(&buffers, *i)) {
            let place = if alike(i) { &mut lit } else { &mut dark };
            *place = place.max(texel[0]);
        }
        assert!(lit > 0.5 && dark < 1e-3 * lit, "{dark} beside {lit}");
    });
}

/// Relative mean squared error of luminance, with 0.01 added to the squared truth, as `lucerna compare -m rel-mse` has it.
fn error(found: &[[f32; 4]], truth: &[[f32; 4]]) -> f64 {
    let luminance = |p: &[f32; 4]| 0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2]);
    let each = |(a, b)| (luminance(a) - luminance(b)).powi(2) / (luminance(b).powi(2) + 0.01);
    found.iter().zip(truth).map(each).sum::<f64>() / found.len() as f64
}

#[test]
fn pictures_have_less_noise_and_as_much_light() {
    with_gpu(|gpu| {
        // A sky behind columns, a sky through a door and lamps, an emissive rectangle.
        for (name, less) in [("figure", 3.0), ("garage", 4.0), ("cornell-area", 1.05)] {
            let scene = builtin::load(name).unwrap();
            let view = View::of_camera(&scene, &Pose::rest(&scene), 0, [96, 72]).unwrap();
            let mut studio = Studio::new(gpu, &scene);
            let mut direct = |direct_samples, direct_filter| {
                let settings = Settings { indirect: false, direct_samples, direct_filter, ..Settings::default() };
                studio.render(&view, &settings, 3).direct
            };
            let truth = direct(512, 0);
            let (noisy, filtered) = (direct(16, 0), direct(16, Settings::default().direct_filter));
            let (before, after) = (error(&noisy, &truth), error(&filtered, &truth));
            let light = mean(&filtered) / mean(&noisy);
            println!("{name}: error {before:.3e} to {after:.3e}, light {light:.5}");
            assert!(after * less < before, "{name}: error {before} before and {after} after the filter");
            assert!((light - 1.0).abs() < 2e-3, "{name}: {light} times the light");
        }
    });
}

#[test]
fn highlights_of_the_sky_have_no_bright_points() {
    with_gpu(|gpu| {
        // Samples of an even sky rarely find the narrow highlight of a smooth surface, which then is far too bright.
        for (roughness, metallic) in [(0.1, 0.0), (0.3, 0.0), (0.2, 1.0)] {
            let mut stage = Stage::new();
            let material = Material { roughness, metallic, ..Material::diffuse("glossy", Vec3::splat(0.2)) };
            let material = stage.material(material);
            stage.sphere(material, Vec3::ZERO, 1.0, 40, false);
            stage.scene.environment = Some(Environment::constant(Vec3::ONE));
            let view = view(vec3(0.0, 0.0, 2.5), vec3(0.0, 0.0, -1.0), 40.0, [32, 32]);
            let mut studio = Studio::new(gpu, &stage.scene);
            let mut direct = |direct_samples| {
                let settings = Settings { indirect: false, direct_samples, direct_filter: 0, ..Settings::default() };
                studio.render(&view, &settings, 5).direct
            };
            let (found, truth) = (direct(16), direct(2048));
            let seen = truth.iter().filter(|p| p[0] > 0.0).count();
            assert!(seen > 500, "{seen} pixels show the sphere");
            let light = mean(&found) / mean(&truth);
            let (most, steady) = found
                .iter()
                .zip(&truth)
                .filter(|(_, b)| b[0] > 0.0)
                .fold((0.0f32, 0.0f32), |all, (a, b)| (all.0.max(a[0] / b[0]), all.1.max(b[0])));
            println!("roughness {roughness}, metallic {metallic}: light {light:.4}, brightest point {most:.2}");
            assert!((light - 1.0).abs() < 0.01, "roughness {roughness}: {light} times the light");
            assert!(
                most < 2.0 && steady < 1.01,
                "roughness {roughness}: a point of {most} times its light, or {steady} of the sky's"
            );
        }
    });
}

/// Mean squared difference of luminance over the squared mean of the truth: bright spots weigh most.
fn spread(found: &[[f32; 4]], truth: &[[f32; 4]]) -> f64 {
    let each = |(a, b): (&[f32; 4], &[f32; 4])| f64::from(a[1] - b[1]).powi(2);
    found.iter().zip(truth).map(each).sum::<f64>() / found.len() as f64 / mean(truth).powi(2)
}

#[test]
fn virtual_lights_leave_no_spots_on_the_walls() {
    with_gpu(|gpu| {
        let scene = builtin::load("cornell").unwrap();
        let view = View::of_camera(&scene, &Pose::rest(&scene), 0, [64, 64]).unwrap();
        let mut studio = Studio::new(gpu, &scene);
        let mut irradiance = |settings: Settings| studio.render(&view, &settings, 0).irradiance;
        let usual = Settings::default();
        // So many virtual lights have small spots even with a short bound.
        let truth = irradiance(Settings { vpls: 8000, candidates: 1, bound: 0.01, compensation: 0, ..usual.clone() });
        let spots = irradiance(Settings { bound: 0.02, compensation: 0, ..usual.clone() });
        let noisy = irradiance(Settings { compensation_filter: 0, ..usual.clone() });
        let found = irradiance(usual);
        let errors = [&spots, &noisy, &found].map(|of| error(of, &truth));
        let points = [&spots, &noisy, &found].map(|of| spread(of, &truth));
        let light = [mean(&found) / mean(&noisy), mean(&found) / mean(&truth)];
        println!(
            "short bound, without and with filter: errors {errors:.4?}, weight of spots {points:.4?}; light {light:.4?}"
        );
        assert!(errors[2] < 0.6 * errors[0] && errors[2] < 0.8 * errors[1], "errors {errors:?}");
        assert!(points[2] < 0.5 * points[0] && points[2] < 0.8 * points[1], "weights of spots {points:?}");
        assert!((light[0] - 1.0).abs() < 1e-4 && (light[1] - 1.0).abs() < 0.05, "{light:?} times the light");
    });
}

#[test]
fn without_a_sky_and_glowing_surfaces_no_bit_changes() {
    with_gpu(|gpu| {
        let scene = builtin::load("cornell").unwrap();
        let view = View::of_camera(&scene, &Pose::rest(&scene), 0, [48, 48]).unwrap();
        let mut studio = Studio::new(gpu, &scene);
        let mut direct = |direct_filter| {
            studio.render(&view, &Settings { indirect: false, direct_filter, ..Settings::default() }, 0).direct
        };
        assert_eq!(direct(0), direct(5));
    });
}
