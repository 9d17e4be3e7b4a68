//! Instant global illumination against closed forms and the path tracer.

use crate::igi_lab::{Studio, flux, mean, plain, room};
use crate::tracer_lab::{Stage, flat_view, matt, view};
use glam::{DVec3, Mat4, Quat, Vec3, vec3};
use lucerna::{
    gpu::testing::{with_gpu, with_ray_query},
    scene::{AlphaMode, Environment, LightKind, Material, Pose, Scene},
    shaders::types,
    techniques::igi::{Settings, Visibility},
    tracer::{self, Tracer},
};
use lucerna_scenes as builtin;
use std::f64::consts::PI;

#[test]
fn virtual_lights_inside_a_sphere_light_it_evenly() {
    with_gpu(|gpu| {
        // Between any two points of a sphere cos θ cos θ' / d² is 1 / 4R², so E = ρ Φ / 4πR² for any positions and any number of virtual
        // lights. The lamp is off the centre, so that the virtual lights are not spread evenly.
        let (radius, rho, intensity) = (1.5f32, 0.6f32, 2.0f32);
        let mut stage = Stage::new();
        let wall = stage.material(Material::diffuse("wall", Vec3::splat(rho)));
        stage.sphere(wall, Vec3::ZERO, radius, 80, true);
        stage.point(vec3(0.3, -0.2, 0.5), Vec3::splat(intensity));
        let mut studio = Studio::new(gpu, &stage.scene);
        let seen = view(vec3(0.1, 0.2, 0.0), vec3(1.0, 0.4, 0.3), 80.0, [24, 24]);
        let exact = f64::from(rho * intensity / (radius * radius));
        for vpls in [1, 1000] {
            let shown = studio.render(&seen, &plain(vpls), 0);
            assert_eq!(shown.vpls.len(), vpls as usize);
            let mut found: Vec<f64> = shown.irradiance.iter().map(|p| f64::from(p[1])).collect();
            found.sort_by(f64::total_cmp);
            // The mesh has flat facets, so close to a virtual light it differs from a sphere.
            let middle = found[found.len() / 2];
            assert!((middle / exact - 1.0).abs() < 4e-3, "{vpls}: {middle} instead of {exact}");
            let all = mean(&shown.irradiance);
            assert!((all / exact - 1.0).abs() < 0.01, "{vpls}: mean {all} instead of {exact}");
        }
    });
}

#[test]
fn the_gather_is_the_sum_over_the_virtual_lights() {
    with_gpu(|gpu| {
        // In a convex room nothing is occluded: the formula gives every pixel from the virtual lights that were shot.
        let mut stage = room(vec3(0.7, 0.5, 0.2));
        stage.point(vec3(0.2, 0.3, -0.1), vec3(1.0, 2.0, 3.0));
        let mut studio = Studio::new(gpu, &stage.scene);
        // The middle of the far wall, where pixels lie on z = -1.
        let seen = flat_view(vec3(0.0, 0.0, 0.5), vec3(0.0, 0.0, -1.0), 1.6, [16, 16]);
        for (vpls, bounces, bound) in [(1, 1, 0.0), (3, 3, 0.0), (300, 2, 0.0), (300, 2, 0.2)] {
            let shown = studio.render(&seen, &Settings { bounces, bound, ..plain(vpls) }, 7);
            let least = f64::from(bound) * 12f64.sqrt();
            for (i, pixel) in shown.irradiance.iter().enumerate() {
                let at = |k: usize| (k as f64 + 0.5) / 16.0 * 1.6 - 0.8;
                let x = DVec3::new(at(i % 16), -at(i / 16), -1.0);
                let mut sum = DVec3::ZERO;
                for vpl in &shown.vpls {
                    let to = Vec3::from(vpl.position).as_dvec3() - x;
                    let (d2, normal) = (to.length_squared(), Vec3::from(vpl.normal).as_dvec3());
                    let cosines = to.z.max(0.0) * (-normal.dot(to)).max(0.0);
                    let t = ((d2.sqrt() - 0.8 * least) / (0.4 * least)).clamp(0.0, 1.0);
                    let smooth = if least > 0.0 { t * t * (3.0 - 2.0 * t) } else { 1.0 };
                    sum += Vec3::from(vpl.flux).as_dvec3() * (cosines / (d2 * d2) / PI * smooth);
                }
                for c in 0..3 {
                    let (found, exact) = (f64::from(pixel[c]), sum[c]);
                    assert!(
                        (found - exact).abs() < 2e-4 * exact + 1e-7,
                        "{vpls}, pixel {i}: {found} instead of {exact}"
                    );
                }
            }
        }
    });
}

/// Every kind of light in a scene where no path is lost, with its power.
fn lamps() -> Vec<(&'static str, Scene, f64, f64)> {
    let down = |at| Mat4::from_rotation_translation(Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2), at);
    let mut all = Vec::new();
    let mut add = |name, stage: Stage, power: f64, slack: f64| all.push((name, stage.scene, power, slack));

    let mut stage = room(Vec3::splat(0.5));
    stage.point(vec3(0.1, 0.2, 0.3), Vec3::splat(2.0));
    add("point", stage, 8.0 * PI, 1e-4);

    let mut stage = room(Vec3::splat(0.5));
    let (inner, outer) = (0.3f32, 0.8f32);
    stage.light(LightKind::Spot { range: None, inner, outer }, Vec3::ONE, 3.0, down(vec3(0.1, 0.4, 0.0)));
    let (i, o) = (f64::from(inner.cos()), f64::from(outer.cos()));
    add("spot", stage, 3.0 * 2.0 * PI * (1.0 - i + (i - o) / 3.0), 1e-4);

    // A floor under a sun at 30 degrees from the zenith.
    let mut stage = Stage::new();
    let floor = stage.material(Material::diffuse("floor", Vec3::splat(0.5)));
    stage.quad(floor, vec3(-1.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 2.0);
    let slanted = Mat4::from_quat(Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2 + 0.5));
    stage.light(LightKind::Directional, Vec3::ONE, 4.0, slanted);
    add("sun", stage, 4.0 * 8.0 * 0.5f64.cos(), 1e-4);

    for (double_sided, sides) in [(false, 1.0), (true, 2.0)] {
        let mut stage = room(Vec3::splat(0.5));
        let lamp = stage.material(Material { double_sided, ..Material::emitter("lamp", Vec3::splat(5.0)) });
        stage.quad(lamp, vec3(-0.2, 0.1, -0.1), Vec3::X * 0.4, Vec3::Z * 0.2);
        add(if double_sided { "two sided lamp" } else { "lamp" }, stage, 5.0 * PI * 0.08 * sides, 1e-4);
    }

    // A lamp with an opacity of two fifths.
    let mut stage = room(Vec3::splat(0.5));
    let emitter = Material::emitter("veil", Vec3::splat(5.0));
    let base_color = emitter.base_color.truncate().extend(0.4);
    let lamp = stage.material(Material { alpha: AlphaMode::Blend, base_color, ..emitter });
    stage.quad(lamp, vec3(-0.2, 0.1, -0.1), Vec3::X * 0.4, Vec3::Z * 0.2);
    add("veil", stage, 0.4 * 5.0 * PI * 0.08, 1e-4);

    // A disc of triangles.
    let mut stage = room(Vec3::splat(0.5));
    let lamp = stage.emitter(Vec3::splat(5.0));
    let rim = |i: u32| 2.0 * std::f32::consts::PI * i as f32 / 32.0;
    let corners = (0..32).map(|i| 0.3 * vec3(rim(i).sin(), 0.0, rim(i).cos()));
    let positions = std::iter::once(Vec3::ZERO).chain(corners).collect();
    let indices = (0..32).flat_map(|i| [0, 1 + i, 1 + (i + 1) % 32]).collect();
    stage.mesh(lamp, positions, vec![Vec3::Y; 33], indices);
    add("disc", stage, 5.0 * PI * 0.09 * 16.0 * (PI / 16.0).sin(), 1e-4);

    // A plate under a constant sky, lit from both sides. The table of the sky is uniform; the distribution of cosines is not.
    let mut stage = Stage::new();
    let plate = stage.material(Material::diffuse("plate", Vec3::splat(0.5)));
    stage.quad(plate, vec3(-1.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 2.0);
    stage.scene.environment = Some(Environment::constant(Vec3::splat(3.0)));
    add("sky", stage, 2.0 * PI * 3.0 * 8.0, 0.03);
    all
}

#[test]
fn flux_is_kept_from_every_kind_of_light() {
    with_gpu(|gpu| {
        for (name, scene, power, slack) in lamps() {
            let mut studio = Studio::new(gpu, &scene);
            let seen = view(vec3(0.0, 0.9, 0.9), Vec3::ZERO, 60.0, [4, 4]);
            for (vpls, seed) in [(2000, 0), (2001, 5)] {
                let shown = studio.render(&seen, &Settings { bounces: 2, ..plain(vpls) }, seed);
                let first = f64::from(flux(&shown.vpls, 0).x);
                assert!((first / (0.5 * power) - 1.0).abs() < slack, "{name}: {first} instead of {}", 0.5 * power);
                // No light leaves a closed room, and no light returns to a plate. Lamps are black and absorb their share.
                let second = f64::from(flux(&shown.vpls, 1).x);
                let expected = match name {
                    "point" | "spot" => 0.25 * power,
                    "sun" | "sky" => 0.0,
                    _ => continue,
                };
                assert!(
                    (second - expected).abs() < 1e-3 * power,
                    "{name}: second bounce {second} instead of {expected}"
                );
            }
        }
        // Two lamps with different power and colour.
        let mut stage = room(Vec3::splat(0.5));
        stage.point(vec3(0.5, 0.0, 0.0), vec3(3.0, 0.0, 0.0));
        stage.point(vec3(-0.5, 0.0, 0.0), vec3(0.0, 1.0, 0.0));
        let shown = Studio::new(gpu, &stage.scene).render(&view(Vec3::ZERO, Vec3::X, 60.0, [4, 4]), &plain(1000), 0);
        let found = flux(&shown.vpls, 0).as_dvec3();
        let exact = DVec3::new(6.0 * PI, 2.0 * PI, 0.0);
        assert!((found - exact).length() < 1e-3 * exact.length(), "{found} instead of {exact}");
    });
}

#[test]
fn the_window_of_a_range_takes_its_share_of_the_flux_once() {
    with_gpu(|gpu| {
        // From the middle of a sphere all light goes as far: 1 - (r / range)⁴ of it arrives, and what is reflected goes on without end.
        let (radius, rho, intensity) = (1.5f32, 0.5f32, 2.0f32);
        for range in [None, Some(4.0), Some(1.7), Some(1.4f32)] {
            let (inner, outer) = (0.3f32, 0.8f32);
            let cone = 1.0 - inner.cos() + (inner.cos() - outer.cos()) / 3.0;
            let kinds = [
                (LightKind::Point { range }, 4.0 * std::f32::consts::PI),
                (LightKind::Spot { range, inner, outer }, 2.0 * std::f32::consts::PI * cone),
            ];
            for (kind, angle) in kinds {
                let mut stage = Stage::new();
                let wall = stage.material(Material::diffuse("wall", Vec3::splat(rho)));
                stage.sphere(wall, Vec3::ZERO, radius, 80, true);
                stage.light(kind, Vec3::ONE, intensity, Mat4::IDENTITY);
                let seen = view(vec3(0.1, 0.2, 0.0), Vec3::X, 60.0, [4, 4]);
                let vpls =
                    Studio::new(gpu, &stage.scene).render(&seen, &Settings { bounces: 2, ..plain(2000) }, 0).vpls;
                let arrives = range.map_or(1.0, |range| (1.0 - (radius / range).powi(4)).max(0.0));
                let (first, second) = (flux(&vpls, 0).x, flux(&vpls, 1).x);
                let exact = rho * intensity * angle * arrives;
                println!("{kind:?}: {first} and {second}, the first {exact}");
                // Facets lie up to a third of a thousandth of the radius further in.
                assert!((first - exact).abs() <= 4e-3 * exact, "{kind:?}: {first} instead of {exact}");
                assert!((second - rho * first).abs() <= 1e-3 * exact, "{kind:?}: second {second} after {first}");
            }
        }
    });
}

/// Mean and variance.
fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0))
}

/// An open corner with an emissive surface, under a sun and a sky that is brighter on one side.
fn court() -> Scene {
    let mut stage = Stage::new();
    let white = stage.material(Material { ior: 1.0, ..Material::diffuse("white", Vec3::splat(0.7)) });
    let red = stage.material(Material { ior: 1.0, ..Material::diffuse("red", vec3(0.8, 0.3, 0.2)) });
    stage.quad(white, vec3(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0);
    stage.quad(white, vec3(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Y * 1.5);
    stage.quad(red, vec3(-1.0, 0.0, -1.0), Vec3::Y * 1.5, Vec3::Z * 2.0);
    stage.cuboid(white, vec3(-0.2, 0.0, -0.4), vec3(0.3, 0.6, 0.1), false);
    let glow = stage.emitter(vec3(2.0, 1.5, 1.0));
    stage.quad(glow, vec3(0.5, 1.2, -0.6), Vec3::X * 0.4, Vec3::Z * 0.4);
    stage.light(LightKind::Directional, Vec3::ONE, 2.0, Mat4::from_quat(Quat::from_rotation_x(-0.9)));
    let pixels = (0..32).map(|i| vec3(0.2, 0.3, 0.5) * if i % 8 < 3 { 2.0 } else { 0.5 }).collect();
    let sky = Environment { width: 8, height: 4, pixels, rotation: 0.7, ..Environment::constant(Vec3::ONE) };
    stage.scene.environment = Some(sky);
    stage.scene
}

#[test]
fn without_the_bound_the_mean_is_the_path_tracers() {
    with_gpu(|gpu| {
        // One bounce: Welch's test of the picture's mean over 32 seeds, for the whole picture and for three parts of it.
        let cornell = builtin::load("cornell").unwrap();
        let box_view = lucerna::scene::View::of_camera(&cornell, &Pose::rest(&cornell), 0, [18, 18]).unwrap();
        let court = court();
        let court_view = view(vec3(0.4, 0.9, 2.0), vec3(-0.1, 0.4, -0.5), 50.0, [18, 18]);
        for (name, scene, seen, by) in
            [("cornell", &cornell, &box_view, &[1, 6][..]), ("court", &court, &court_view, &[1])]
        {
            let part = |values: &[f64]| -> [f64; 4] {
                let third = |k: usize| &values[k * values.len() / 3..(k + 1) * values.len() / 3];
                [values, third(0), third(1), third(2)].map(|list| list.iter().sum())
            };
            let mut studio = Studio::new(gpu, scene);
            let mut tracer = Tracer::new(gpu, scene, &Pose::rest(scene)).unwrap();
            let (mut ours, mut theirs) = (vec![vec![Vec::new(); 4]; by.len()], vec![Vec::new(); 4]);
            for seed in 1..=32 {
                for (ours, &candidates) in ours.iter_mut().zip(by) {
                    let shown = studio.render(seen, &Settings { candidates, ..plain(250) }, seed);
                    let found: Vec<f64> = shown.indirect.iter().map(|p| f64::from(p[0] + p[1] + p[2])).collect();
                    ours.iter_mut().zip(part(&found)).for_each(|(list, sum)| list.push(sum));
                }
                let layers = tracer.render(seen, &tracer::Settings { seed, ..matt(1) }, 64).unwrap();
                let data = &layers.layer("indirect").unwrap().data;
                let found: Vec<f64> = data.chunks_exact(3).map(|p| f64::from(p[0] + p[1] + p[2])).collect();
                theirs.iter_mut().zip(part(&found)).for_each(|(list, sum)| list.push(sum));
            }
            for (ours, candidates) in ours.iter().zip(by) {
                for (k, (ours, theirs)) in ours.iter().zip(&theirs).enumerate() {
                    let ((a, va), (b, vb)) = (moments(ours), moments(theirs));
                    let deviation = ((va + vb) / 32.0).sqrt();
                    let t = (a - b) / deviation;
                    println!(
                        "{name}, {candidates} candidates: {a:.4} and {b:.4} ± {deviation:.4} ({:.4} ours), t = {t:.2}",
                        (va / 32.0).sqrt()
                    );
                    // A false alarm in one of a hundred runs, for all twelve tests together, with more than 31 degrees of freedom.
                    assert!(t.abs() < 3.6, "{name}, {candidates} candidates: means {a} and {b}: t = {t}");
                    // In the court, virtual lights close to surfaces cause more noise.
                    let most = if name == "cornell" { 0.009 } else { 0.016 } * if k == 0 { 1.0 } else { 3.0 };
                    assert!(deviation < most * b, "too noisy to say anything");
                }
            }
        }
    });
}

#[test]
fn the_error_falls_with_the_number_of_virtual_lights() {
    with_gpu(|gpu| {
        let scene = builtin::load("cornell").unwrap();
        let seen = lucerna::scene::View::of_camera(&scene, &Pose::rest(&scene), 0, [20, 20]).unwrap();
        let mut studio = Studio::new(gpu, &scene);
        let settings = |vpls| Settings { bound: 0.1, ..plain(vpls) };
        let truth = studio.render(&seen, &settings(10_000), 99).irradiance;
        let mut points = Vec::new();
        for vpls in [16u32, 64, 256, 1024] {
            let mut sum = 0.0;
            for seed in 1..=6 {
                let found = studio.render(&seen, &settings(vpls), seed).irradiance;
                sum += found.iter().zip(&truth).map(|(f, t)| f64::from(f[1] - t[1]).powi(2)).sum::<f64>();
            }
            points.push((f64::from(vpls).ln(), sum.ln()));
        }
        let n = points.len() as f64;
        let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
        let slope = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>()
            / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>();
        println!("slope of the mean squared error: {slope:.2}");
        // Random points would give -1; Halton points are more even.
        assert!((-2.2..-0.95).contains(&slope), "{slope}: {points:?}");
    });
}

#[test]
fn the_bound_only_takes_away() {
    with_gpu(|gpu| {
        let scene = builtin::load("cornell").unwrap();
        let seen = lucerna::scene::View::of_camera(&scene, &Pose::rest(&scene), 0, [32, 32]).unwrap();
        let mut studio = Studio::new(gpu, &scene);
        let mut before: Option<Vec<[f32; 4]>> = None;
        for bound in [0.0, 0.01, 0.03, 0.1, 0.3, 1.0f32] {
            let found = studio.render(&seen, &Settings { bound, bounces: 2, ..plain(200) }, 0).irradiance;
            if let Some(before) = &before {
                assert!(found.iter().zip(before).all(|(f, b)| (0..3).all(|c| f[c] <= b[c])), "bound {bound}");
            }
            before = Some(found);
        }
        // With the diagonal of the room as bound nearly no light is left.
        let all = mean(&studio.render(&seen, &Settings { bounces: 2, ..plain(200) }, 0).irradiance);
        assert!(before.is_some_and(|b| mean(&b) < 0.02 * all));
    });
}

#[test]
fn all_eight_ways_to_be_faster_show_the_same_room() {
    with_gpu(|gpu| {
        let scene = builtin::load("cornell").unwrap();
        let seen = lucerna::scene::View::of_camera(&scene, &Pose::rest(&scene), 0, [96, 96]).unwrap();
        let mut studio = Studio::new(gpu, &scene);
        let base = Settings { bound: 0.1, bounces: 2, ..plain(180) };
        let exact = studio.render(&seen, &base, 0);
        // The texels of the unlit lamp have irradiance only for their neighbours; the lamp itself reflects none.
        let lit: Vec<bool> = exact.albedo.iter().map(|albedo| albedo[3] > 0.5).collect();
        let mut boxes = 0.0;
        for (downsample, interleave) in [(1, 1), (4, 1), (1, 3), (4, 3), (3, 2), (2, 4)] {
            let mut pictures = Vec::new();
            for imperfect in [false, true] {
                let settings = Settings { imperfect, downsample, interleave, ..base.clone() };
                let mut found = studio.render(&seen, &settings, 0).irradiance;
                found.iter_mut().zip(&lit).filter(|(_, lit)| !**lit).for_each(|(f, _)| *f = [0.0; 4]);
                let error: f64 =
                    found.iter().zip(&exact.irradiance).map(|(f, e)| f64::from((f[1] - e[1]).abs())).sum::<f64>()
                        / exact.irradiance.iter().map(|e| f64::from(e[1])).sum::<f64>();
                println!("imperfect {imperfect}, downsample {downsample}, interleave {interleave}: {error:.4}");
                let most = match downsample * interleave {
                    0..=1 => 0.07,
                    2..=4 => 0.12,
                    5..=8 => 0.18,
                    _ => 0.28,
                };
                assert!(error < most, "{downsample} {interleave}: {error}");
                // Only the boxes lose light, and they lose the same share in every variant.
                let light = mean(&found) / mean(&exact.irradiance);
                if (downsample, interleave, imperfect) == (1, 1, true) {
                    boxes = light;
                    assert!(boxes > 0.9, "boxes leave {boxes} of the light");
                }
                let expected = if imperfect { boxes } else { 1.0 };
                println!("    light {light:.4} beside {expected:.4}");
                // There are few texels on each wall, and the filters lose light along edges.
                let slack = if downsample * interleave > 4 { 0.05 } else { 0.025 };
                assert!((light / expected - 1.0).abs() < slack, "{downsample} {interleave}: {light} beside {expected}");
                assert!(error > 0.0 || (downsample, interleave, imperfect) == (1, 1, false));
                pictures.push(found);
            }
            // A box occludes every ray that its triangle occludes.
            let darker = pictures[1].iter().zip(&pictures[0]).all(|(i, e)| (0..3).all(|c| i[c] <= e[c] * 1.00001));
            assert!(darker, "imperfect visibility is brighter somewhere: {downsample} {interleave}");
        }
    });
}

#[test]
fn scenes_with_next_to_nothing() {
    with_gpu(|gpu| {
        let seen = view(vec3(0.0, 0.0, 3.0), Vec3::ZERO, 40.0, [8, 8]);
        let every = Settings { bounces: 3, imperfect: true, downsample: 4, interleave: 3, ..Settings::default() };
        // An empty scene.
        let shown = Studio::new(gpu, &Scene::default()).render(&seen, &every, 0);
        assert!(shown.total.iter().all(|p| p[..3] == [0.0; 3]));
        // A lamp without surfaces to light.
        let mut stage = Stage::new();
        stage.point(Vec3::ZERO, Vec3::ONE);
        assert_eq!(mean(&Studio::new(gpu, &stage.scene).render(&seen, &every, 1).total), 0.0);
        // Surfaces without a lamp.
        let dark = room(Vec3::ONE);
        let shown = Studio::new(gpu, &dark.scene).render(&view(Vec3::ZERO, Vec3::X, 60.0, [8, 8]), &every, 0);
        assert!(mean(&shown.total) == 0.0 && shown.vpls.iter().all(|v| v.flux == [0.0; 3]));
        // One triangle under a lamp has direct light, and does not light itself.
        let mut stage = Stage::new();
        let white = stage.material(Material::diffuse("white", Vec3::ONE));
        stage.mesh(
            white,
            vec![vec3(-1.0, -1.0, 0.0), vec3(1.0, -1.0, 0.0), vec3(0.0, 1.0, 0.0)],
            vec![Vec3::Z; 3],
            vec![0, 1, 2],
        );
        stage.point(vec3(0.0, 0.0, 2.0), Vec3::ONE);
        let shown = Studio::new(gpu, &stage.scene).render(
            &seen,
            &Settings { interleave: 1, downsample: 1, ..every.clone() },
            0,
        );
        // Rounding may lift a pixel off the plane, so that virtual lights on it send next to nothing to it.
        let (direct, indirect) = (mean(&shown.direct), mean(&shown.indirect));
        assert!(direct > 0.01 && indirect < 1e-4 * direct, "{direct} {indirect}");
        // Only mirrors: light paths leave no virtual lights.
        let mut stage = Stage::new();
        let mirror =
            stage.material(Material { metallic: 1.0, roughness: 0.0, ..Material::diffuse("mirror", Vec3::splat(0.9)) });
        stage.cuboid(mirror, Vec3::splat(-1.0), Vec3::ONE, true);
        stage.point(vec3(0.3, 0.2, 0.1), Vec3::ONE);
        let shown = Studio::new(gpu, &stage.scene).render(&view(Vec3::ZERO, Vec3::X, 60.0, [8, 8]), &every, 0);
        assert!(shown.vpls.iter().all(|v: &types::Vpl| v.flux == [0.0; 3]) && mean(&shown.indirect) == 0.0);
    });
}

#[test]
fn ray_queries_show_the_same() {
    with_ray_query(|gpu| {
        let scene = builtin::load("teapot").unwrap();
        let seen = lucerna::scene::View::of_camera(&scene, &Pose::rest(&scene), 0, [24, 18]).unwrap();
        let base = Settings { bounces: 2, vpls: 24, direct_samples: 2, ..Settings::default() };
        for imperfect in [false, true] {
            let shown = [Visibility::Compute, Visibility::Query].map(|visibility| {
                let settings = Settings { visibility, imperfect, ..base.clone() };
                Studio::with(gpu, &scene, &settings).render(&seen, &settings, 0)
            });
            // Rounding decides which triangle a ray along an edge hits.
            let differ = |a: &[f32; 4], b: &[f32; 4]| (0..3).any(|c| (a[c] - b[c]).abs() > 1e-3 * b[c].abs() + 1e-5);
            let [compute, query] = &shown;
            let other = compute.total.iter().zip(&query.total).filter(|(a, b)| differ(a, b)).count();
            println!("imperfect {imperfect}: {other} of {} pixels differ", compute.total.len());
            assert!(other * 50 <= compute.total.len(), "{other} pixels differ");
            assert!((mean(&compute.total) / mean(&query.total) - 1.0).abs() < 2e-3);
        }
    });
}

#[test]
fn virtual_lights_go_where_they_are_seen() {
    with_gpu(|gpu| {
        // Two identical closed rooms; the camera is in one of them.
        let mut stage = room(Vec3::splat(0.6));
        let wall = stage.material(Material::diffuse("wall", Vec3::splat(0.6)));
        stage.cuboid(wall, vec3(3.0, -1.0, -1.0), vec3(5.0, 1.0, 1.0), true);
        stage.point(vec3(0.2, 0.3, 0.4), Vec3::ONE);
        stage.point(vec3(4.2, 0.3, 0.4), Vec3::ONE);
        let mut studio = Studio::new(gpu, &stage.scene);
        let seen = view(vec3(0.0, 0.0, 0.9), vec3(0.2, -0.1, -1.0), 80.0, [24, 24]);
        let here = |vpls: &[types::Vpl]| vpls.iter().filter(|v| v.position[0] < 2.0).count() as f64 / vpls.len() as f64;
        let settings = Settings { bound: 0.05, ..plain(200) };
        let truth = mean(&studio.render(&seen, &Settings { vpls: 10_000, ..settings.clone() }, 0).irradiance);
        let (mut error, mut share) = ([0.0; 2], [0.0; 2]);
        for seed in 1..=6 {
            for (k, candidates) in [1, 8].into_iter().enumerate() {
                let shown = studio.render(&seen, &Settings { candidates, ..settings.clone() }, seed);
                error[k] += mean(&shown.irradiance) / truth / 6.0 - 1.0 / 6.0;
                share[k] += here(&shown.vpls) / 6.0;
            }
        }
        println!("shares {share:?}, errors of the mean {error:?}");
        // Half of the probability follows the flux alone, and so is shared evenly by the rooms.
        assert!((share[0] - 0.5).abs() < 0.02 && (share[1] - 0.75).abs() < 0.02, "{share:?}");
        assert!(error.iter().all(|e| e.abs() < 0.02), "{error:?}");
    });
}
