//! Virtual lights with shadow maps: the picture agrees with that of shadow rays, up to the resolution of the maps.

use crate::igi_lab::{Studio, mean, plain};
use crate::tracer_lab::{Stage, view};
use glam::{Vec3, Vec4, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    resident::Resident,
    scene::{AlphaMode, Material, Pose, Scene, View},
    techniques::igi::{Igi, Pattern, PictureSettings, Settings, Visibility},
};
use lucerna_scenes as builtin;

fn raster(settings: &Settings, raster_size: u32) -> Settings {
    Settings { visibility: Visibility::Raster, raster_size, ..settings.clone() }
}

#[test]
fn the_inside_of_a_sphere_is_lit_evenly() {
    with_gpu(|gpu| {
        // As with rays, E = ρ Φ / 4πR² for any positions of the virtual lights. A sphere has no shadows on its inside.
        let (radius, rho, intensity) = (1.5f32, 0.6f32, 2.0f32);
        let mut stage = Stage::new();
        let wall = stage.material(Material::diffuse("wall", Vec3::splat(rho)));
        stage.sphere(wall, Vec3::ZERO, radius, 80, true);
        stage.point(vec3(0.3, -0.2, 0.5), Vec3::splat(intensity));
        let mut studio = Studio::new(gpu, &stage.scene);
        let seen = view(vec3(0.1, 0.2, 0.0), vec3(1.0, 0.4, 0.3), 80.0, [24, 24]);
        let exact = f64::from(rho * intensity / (radius * radius));
        for (vpls, size) in [(1, 128), (50, 64)] {
            let shown = studio.render(&seen, &raster(&plain(vpls), size), 0);
            let mut found: Vec<f64> = shown.irradiance.iter().map(|p| f64::from(p[1])).collect();
            found.sort_by(f64::total_cmp);
            let (middle, all) = (found[found.len() / 2], mean(&shown.irradiance));
            println!("{vpls}: median {middle}, mean {all}, exact {exact}");
            assert!((middle / exact - 1.0).abs() < 6e-3, "{vpls}: {middle} instead of {exact}");
            assert!((all / exact - 1.0).abs() < 0.015, "{vpls}: mean {all} instead of {exact}");
        }
    });
}

/// Share of pixels that differ by more than a twentieth; sum of their absolute differences, relative to all light; and the ratio of the sums,
/// raster over rays.
fn compared(scene: &Scene, gpu: &lucerna::gpu::Gpu, seen: &View, settings: &Settings, size: u32) -> (f64, f64, f64) {
    let mut studio = Studio::new(gpu, scene);
    let rays = studio.render(seen, settings, 0);
    let maps = studio.render(seen, &raster(settings, size), 0);
    let floor = 0.02 * mean(&rays.irradiance) as f32;
    let differ = |a: &[f32; 4], b: &[f32; 4]| (0..3).any(|c| (a[c] - b[c]).abs() > 0.05 * b[c] + floor);
    let others: Vec<_> = maps.irradiance.iter().zip(&rays.irradiance).filter(|(a, b)| differ(a, b)).collect();
    let off: f64 = others.iter().map(|(a, b)| (0..3).map(|c| f64::from((a[c] - b[c]).abs())).sum::<f64>()).sum();
    // Both have the same virtual lights, bit for bit.
    assert_eq!(bytemuck::cast_slice::<_, u8>(&maps.vpls), bytemuck::cast_slice::<_, u8>(&rays.vpls));
    let pixels = maps.irradiance.len() as f64;
    let all = mean(&rays.irradiance);
    (others.len() as f64 / pixels, off / (3.0 * pixels * all), mean(&maps.irradiance) / all)
}

#[test]
fn rooms_look_as_by_rays() {
    with_gpu(|gpu| {
        for (name, allowed, most) in [("cornell", 0.03, 0.002), ("teapot", 0.22, 0.05)] {
            let scene = builtin::load(name).unwrap();
            let seen = View::of_camera(&scene, &Pose::rest(&scene), 0, [40, 30]).unwrap();
            let settings = Settings { bound: 0.02, ..plain(16) };
            let mut before = f64::INFINITY;
            for size in [64, 256] {
                let (share, off, ratio) = compared(&scene, gpu, &seen, &settings, size);
                println!(
                    "{name}, {size}²: {share:.4} of the pixels differ by more than 5 %, by {off:.4} of all light, energy ratio {ratio:.4}"
                );
                // Finer maps agree better.
                assert!(share <= before + 0.01, "{name}: {share} with {size}²");
                before = share;
                if size == 256 {
                    assert!(
                        share < allowed && off < most,
                        "{name}: {share} of the pixels differ by {off} of all light"
                    );
                    assert!((ratio - 1.0).abs() < 0.03, "{name}: energy ratio {ratio}");
                }
            }
        }
    });
}

#[test]
fn holes_of_alpha_masks_let_light_through() {
    with_gpu(|gpu| {
        // A screen with vertex alpha between a virtual light on the floor and the wall: opaque, or fully cut out.
        let build = |alpha: Option<f32>| {
            let mut stage = Stage::new();
            let wall = stage.material(Material::diffuse("wall", Vec3::splat(0.7)));
            stage.cuboid(wall, Vec3::splat(-1.0), Vec3::ONE, true);
            stage.point(vec3(-0.6, 0.0, 0.0), Vec3::ONE);
            if let Some(alpha) = alpha {
                let screen = Material {
                    alpha: AlphaMode::Mask { cutoff: 0.5 },
                    double_sided: true,
                    base_color: Vec4::new(0.0, 0.0, 0.0, alpha),
                    ..Material::diffuse("screen", Vec3::ZERO)
                };
                let screen = stage.material(screen);
                stage.quad(screen, vec3(0.2, -0.9, -0.9), Vec3::Z * 1.8, Vec3::Y * 1.8);
            }
            stage.scene
        };
        let seen = view(vec3(0.4, 0.0, 0.0), Vec3::X, 80.0, [16, 16]);
        let shown = [None, Some(0.2), Some(0.9)].map(|alpha| {
            let scene = build(alpha);
            let rays = mean(&Studio::new(gpu, &scene).render(&seen, &plain(40), 0).irradiance);
            let maps = mean(&Studio::new(gpu, &scene).render(&seen, &raster(&plain(40), 128), 0).irradiance);
            println!("{alpha:?}: {maps} by maps, {rays} by rays");
            assert!((maps / rays - 1.0).abs() < 0.05, "{alpha:?}: {maps} by maps, {rays} by rays");
            maps
        });
        assert!((shown[0] / shown[1] - 1.0).abs() < 1e-3 && shown[2] < 0.8 * shown[0], "{shown:?}");
    });
}

#[test]
fn deforming_meshes_cast_where_they_stand() {
    with_gpu(|gpu| {
        let scene = builtin::load("figure").unwrap();
        let mut resident = Resident::new(gpu, &scene).unwrap();
        let settings = Settings { bound: 0.02, ..plain(12) };
        let mut runner = lucerna::graph::Runner::new(gpu);
        let mut shares = Vec::new();
        // At the second time the figure has moved. As a control, each picture is also compared with rays at the other time.
        let mut render = |settings: &Settings, seconds: f32| {
            let mut igi = Igi::new(gpu, &scene, &resident, settings).unwrap();
            let mut graph = lucerna::graph::Graph::new("igi");
            let pose = Pose::playing(&scene, seconds);
            let handles = resident.frame_in(&mut graph, &scene, &pose);
            let view = View::of_camera(&scene, &pose, 0, [32, 24]).unwrap().fit_far(&handles.bounds());
            let all = PictureSettings { igi: settings.clone(), ..Default::default() };
            let picture = igi.picture(&mut graph, &scene, &pose, &handles, &view, &all).unwrap();
            let token = graph.read_image(picture.outputs.irradiance);
            runner.run(&graph).unwrap().image(token).to_f32()
        };
        let later = render(&settings, 1.3);
        for seconds in [1.3, 0.0] {
            let maps = render(&raster(&settings, 128), seconds);
            let floor = 0.02 * mean(&later) as f32;
            let differ = |a: &[f32; 4], b: &[f32; 4]| (0..3).any(|c| (a[c] - b[c]).abs() > 0.05 * b[c] + floor);
            let count = maps.iter().zip(&later).filter(|(a, b)| differ(a, b)).count();
            shares.push(count as f64 / maps.len() as f64);
        }
        println!("pixels that differ: {shares:?}");
        assert!(shares[0] < 0.15 && shares[1] > shares[0] + 0.02, "{shares:?}");
    });
}

#[test]
fn maps_in_several_batches_and_all_accelerations_of_pixels() {
    with_gpu(|gpu| {
        let scene = builtin::load("cornell").unwrap();
        let seen = View::of_camera(&scene, &Pose::rest(&scene), 0, [24, 24]).unwrap();
        let mut studio = Studio::new(gpu, &scene);
        for (downsample, interleave, pattern) in
            [(1, 1, Pattern::Regular), (2, 3, Pattern::Regular), (2, 3, Pattern::Irregular)]
        {
            let scattered = pattern == Pattern::Irregular;
            let base = Settings { downsample, interleave, pattern, scattered, bound: 0.05, ..plain(40) };
            // At 1024² only 32 lights fit into memory at one time.
            let large = studio.render(&seen, &raster(&base, 1024), 0);
            let rays = studio.render(&seen, &base, 0);
            let ratio = mean(&large.irradiance) / mean(&rays.irradiance);
            println!("downsample {downsample}, interleave {interleave}: ratio {ratio:.4}");
            assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
            // Every texel gathers from the same subset as with rays.
            let apart = large.gathered.iter().zip(&rays.gathered).filter(|(a, b)| (a[1] - b[1]).abs() > 0.1 * b[1]);
            let apart = apart.count();
            assert!(20 * apart <= rays.gathered.len(), "{apart} of {} texels have other lights", rays.gathered.len());
            assert_eq!(
                large.irradiance,
                studio.render(&seen, &raster(&base, 1024), 0).irradiance,
                "not the same twice"
            );
        }
    });
}

#[test]
fn what_maps_cannot_do_is_refused() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let wall = stage.material(Material::diffuse("wall", Vec3::ONE));
        stage.cuboid(wall, Vec3::splat(-1.0), Vec3::ONE, true);
        let scene = stage.scene;
        let mut resident = Resident::new(gpu, &scene).unwrap();
        let pose = Pose::rest(&scene);
        for (settings, part) in [
            (Settings { vpls: 10_000, ..raster(&Settings::default(), 64) }, "to 2048"),
            (Settings { imperfect: true, ..raster(&Settings::default(), 64) }, "imperfect"),
            (raster(&Settings::default(), 4096), "16 to 1024"),
        ] {
            let mut igi = Igi::new(gpu, &scene, &resident, &settings).unwrap();
            let mut graph = lucerna::graph::Graph::new("igi");
            let handles = resident.frame_in(&mut graph, &scene, &pose);
            let seen = view(Vec3::ZERO, Vec3::X, 60.0, [8, 8]);
            let all = PictureSettings { igi: settings, ..Default::default() };
            let error = igi.picture(&mut graph, &scene, &pose, &handles, &seen, &all).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(part), "{error}");
        }
    });
}
