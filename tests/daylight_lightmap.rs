//! Lightmaps of whole bakes as pictures show them: closed forms, seams, things that stand in a floor, and the path tracer from other cameras.

use crate::{
    daylight_lab::{Studio, baked, baked_with},
    daylight_light::{eye, plan},
    tracer_lab::{Stage, flat_view, matt, render, view},
};
use glam::{Mat4, Quat, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    image::Layers,
    scene::{Material, Scene, Transform, View},
    techniques::daylight::{
        Backs, Baked, Baking, Group, Kind, Light, PictureSettings, Plan, Sources, Stored, digest,
        gathered::Spot,
        lightmap::{self, Unwrapped},
    },
    tracer::Settings,
};

pub fn baking(samples: u32) -> Baking {
    Baking { samples, bounces: 16, roulette: 16, disc: false, diffuse_only: true, ..Baking::default() }
}

/// The plan of a lightmap with one group of lamps: the materials that glow.
pub fn planned(gpu: &Gpu, scene: &Scene, glowing: &[u32], settings: Baking) -> (Plan, Unwrapped) {
    let lamps = vec![Group { name: "lamps".into(), lights: Vec::new(), materials: glowing.to_vec() }];
    let backs = Backs::lit(gpu, scene, &lamps, &settings).unwrap().lit;
    let unwrapped = lightmap::unwrap(scene, &settings, backs.as_deref()).unwrap();
    let (covered, backs) = (unwrapped.receivers.len() as u64, unwrapped.on_backs());
    let corners = digest(&unwrapped.lightmap.corners);
    let plan = Plan {
        receivers: Kind::Lightmap { charts: unwrapped.charts, covered, backs, corners },
        extent: unwrapped.lightmap.extent,
        lamps,
        ..plan(scene, &eye(), settings)
    };
    (plan, unwrapped)
}

fn lightmap_of(gpu: &Gpu, scene: &Scene, glowing: u32, settings: Baking) -> Baked {
    lightmap_lit_by(gpu, scene, &[glowing], settings)
}

pub fn lightmap_lit_by(gpu: &Gpu, scene: &Scene, glowing: &[u32], settings: Baking) -> Baked {
    let (plan, unwrapped) = planned(gpu, scene, glowing, settings);
    let sources = Sources::Lightmap(Box::new(unwrapped.by_tile(plan.side())));
    let stored = baked(gpu, scene, plan, sources);
    Baked::new(Stored { corners: unwrapped.lightmap.corners, ..stored })
}

/// A lightmap whose lamps have the irradiance `of` a position and a normal.
fn lightmap_with(gpu: &Gpu, scene: &Scene, glowing: u32, settings: Baking, of: impl Fn(Vec3, Vec3) -> f32) -> Baked {
    let (plan, unwrapped) = planned(gpu, scene, &[glowing], settings);
    let sources = Sources::Lightmap(Box::new(unwrapped.by_tile(plan.side())));
    let of_tile = |light: &mut Light| {
        let value = |spot: &Spot| of(spot.position.into(), spot.normal.into());
        light.lamps = light.spots.iter().flat_map(|spot| [value(spot); 3]).collect();
        light.lamps_noise = vec![0.0; light.lamps.len()];
    };
    let stored = baked_with(gpu, scene, plan, sources, of_tile, |_| ());
    Baked::new(Stored { corners: unwrapped.lightmap.corners, ..stored })
}

pub fn lamps_alone() -> PictureSettings {
    let mut settings = PictureSettings::default();
    settings.daylight.time = "00:00".into();
    settings.daylight.lamps = "on".into();
    settings
}

/// The pixels with an albedo of 0.5: their normals, and their irradiance by the lamps alone.
pub fn seen(gpu: &Gpu, scene: &Scene, view: View, baked: &Baked) -> Vec<(Vec3, f32)> {
    seen_at(gpu, scene, view, baked).into_iter().map(|(_, normal, irradiance)| (normal, irradiance)).collect()
}

/// The same with the number of each pixel.
fn seen_at(gpu: &Gpu, scene: &Scene, view: View, baked: &Baked) -> Vec<(usize, Vec3, f32)> {
    let mut studio = Studio::with(gpu, scene.clone(), view, baked, &lamps_alone());
    let layers = studio.frame(0, &lamps_alone()).unwrap().0;
    let of = |name: &str| layers.layer(name).unwrap().rgb_pixels().unwrap();
    let (irradiance, albedo, normals) = (of("irradiance"), of("albedo"), of("normal"));
    let grey = (0..albedo.len()).filter(|pixel| (albedo[*pixel][1] - 0.5).abs() < 0.02);
    grey.map(|pixel| (pixel, Vec3::from(normals[pixel]), irradiance[pixel][1])).collect()
}

/// A room of `size` metres that glows with a radiance of 1 around bodies whose albedo is 0.5.
pub fn glowing_room(size: f32, bodies: impl FnOnce(&mut Stage, u32)) -> (Scene, u32) {
    let mut stage = Stage::new();
    let lamp = stage.emitter(Vec3::ONE);
    stage.cuboid(lamp, Vec3::splat(-0.5 * size), Vec3::splat(0.5 * size), true);
    let grey = stage.material(Material::diffuse("grey", Vec3::splat(0.5)));
    bodies(&mut stage, grey);
    (stage.scene, lamp)
}

fn sphere() -> (Scene, u32) {
    glowing_room(4.0, |stage, grey| stage.sphere(grey, Vec3::ZERO, 0.8, 24, false))
}

fn cube_turn() -> Quat {
    Quat::from_euler(glam::EulerRot::XYZ, 0.5, 0.7, 0.3)
}

fn cube() -> (Scene, u32) {
    glowing_room(4.0, |stage, grey| {
        stage.cuboid(grey, Vec3::splat(-0.6), Vec3::splat(0.6), false);
        turn(stage, 6, cube_turn());
    })
}

fn cameras() -> [View; 3] {
    [vec3(0.3, 0.4, 1.9), vec3(-1.8, 1.2, -1.0), vec3(0.5, -1.9, 0.8)]
        .map(|from| view(from, Vec3::ZERO, 60.0, [96, 96]))
}

/// The least and the largest of some numbers.
pub fn range(of: impl Iterator<Item = f32>) -> [f32; 2] {
    of.fold([f32::MAX, f32::MIN], |[least, most], value| [least.min(value), most.max(value)])
}

/// Turns the last `count` meshes of a scene.
fn turn(stage: &mut Stage, count: usize, by: Quat) {
    let all = stage.scene.nodes.len();
    for node in &mut stage.scene.nodes[all - count..] {
        node.local = Transform::Matrix(Mat4::from_quat(by));
    }
}

#[test]
fn every_pixel_finds_the_texels_of_its_own_surface() {
    with_gpu(|gpu| {
        // Each face of the cube has a number.
        let (scene, lamp) = cube();
        let face = |normal: Vec3| {
            let n = cube_turn().inverse() * normal;
            [n.x, -n.x, n.y, -n.y, n.z, -n.z].iter().position(|along| *along > 0.9).map(|face| 1.0 + face as f32)
        };
        let settings = Baking { bounces: 1, tolerance: 0.002, ..baking(2) };
        let baked = lightmap_with(gpu, &scene, lamp, settings, |_, normal| face(normal).unwrap_or(20.0));
        let mut faces = [0; 7];
        let mut wrong = 0;
        for camera in cameras() {
            for (normal, found) in seen(gpu, &scene, camera, &baked) {
                let wanted = face(normal).unwrap();
                wrong += usize::from((found / wanted - 1.0).abs() > 0.01);
                faces[wanted as usize] += 1;
            }
        }
        // A pixel on an edge of the cube may see either face.
        println!("cube: {wrong} of {} pixels have the light of another face", faces.iter().sum::<usize>());
        assert!(wrong <= 6, "{wrong}");
        assert!(faces[1..].iter().filter(|pixels| **pixels > 300).count() >= 5, "{faces:?}");
    });
}

#[test]
fn seams_of_charts_are_invisible() {
    with_gpu(|gpu| {
        // Light that changes by up to 39 % along a metre, with charts that end within a texel of 0.125 m.
        let field = |p: Vec3| 2.0 + p.dot(vec3(0.6, -0.4, 0.3));
        type Find = fn(Vec3, Vec3, Vec3) -> Vec3;
        let on_sphere: Find = |_, _, normal| 0.8 * normal;
        let on_cube: Find = |eye, way, normal| eye + way * ((0.6 - eye.dot(normal)) / way.dot(normal));
        for (name, (scene, lamp), at) in [("sphere", sphere(), on_sphere), ("cube", cube(), on_cube)] {
            for filter in [0, Baking::default().filter] {
                let settings = Baking { bounces: 1, tolerance: 0.002, filter, ..baking(2) };
                let baked = lightmap_with(gpu, &scene, lamp, settings, |position, _| field(position));
                for camera in cameras() {
                    let world_from_clip = camera.clip_from_world.inverse();
                    let mut ratios = vec![f32::NAN; 96 * 96];
                    for (pixel, normal, found) in seen_at(gpu, &scene, camera, &baked) {
                        let [x, y] = [pixel % 96, pixel / 96].map(|at| (at as f32 + 0.5) / 48.0 - 1.0);
                        let way = world_from_clip.project_point3(vec3(x, -y, 0.5)) - camera.position;
                        ratios[pixel] = found / field(at(camera.position, way, normal));
                    }
                    let there = |ratio: &&f32| ratio.is_finite();
                    let [least, most] = range(ratios.iter().filter(there).copied());
                    // Pixels beside each other, and above each other.
                    let steps = [1, 96].map(|by| ratios.iter().zip(&ratios[by..]).map(|(a, b)| (a / b - 1.0).abs()));
                    let step = steps.into_iter().flatten().filter(|step| step.is_finite()).fold(0.0, f32::max);
                    let count = ratios.iter().filter(there).count();
                    println!("{name}, filter {filter}: {count} pixels, {least:.4} to {most:.4}, steps to {step:.4}");
                    assert!(count > 2000 && step < 0.01, "{name}, filter {filter}: {step}");
                    let bias = if filter > 0 { 0.02 } else { 0.01 };
                    assert!(least > 1.0 - bias && most < 1.0 + bias, "{name}, filter {filter}: {least} to {most}");
                }
            }
        }
    });
}

#[test]
fn convex_bodies_under_even_light_have_an_irradiance_of_pi() {
    with_gpu(|gpu| {
        for (name, (scene, lamp)) in [("sphere", sphere()), ("cube", cube())] {
            let baked =
                lightmap_of(gpu, &scene, lamp, Baking { bounces: 1, density: 4.0, tolerance: 0.004, ..baking(1024) });
            for camera in cameras() {
                let mut ratios: Vec<f32> =
                    seen(gpu, &scene, camera, &baked).iter().map(|(_, e)| e / std::f32::consts::PI).collect();
                ratios.sort_by(f32::total_cmp);
                let count = ratios.len();
                let mean = ratios.iter().sum::<f32>() / count as f32;
                let [low, high] = [ratios[count / 100], ratios[count - 1 - count / 100]];
                println!(
                    "{name}: {count} pixels, mean {mean:.4}, 98 of 100 from {low:.4} to {high:.4}; {:.4} to {:.4}",
                    ratios[0],
                    ratios[count - 1]
                );
                assert!(count > 2000 && (mean - 1.0).abs() < 0.03, "{name}: {mean}");
                assert!(low > 0.9 && high < 1.1, "{name}: {low} to {high}");
            }
        }
    });
}

#[test]
fn a_closed_box_that_glows_has_its_emission_over_one_less_its_albedo_from_any_camera() {
    with_gpu(|gpu| {
        let (albedo, emission) = (0.5, 0.4);
        let mut stage = Stage::new();
        let material = Material { emissive: Vec3::splat(emission), ..Material::diffuse("", Vec3::splat(albedo)) };
        let glowing = stage.material(material);
        stage.cuboid(glowing, Vec3::splat(-1.0), Vec3::ONE, true);
        let baked = lightmap_of(gpu, &stage.scene, glowing, baking(512));
        let wanted = std::f32::consts::PI * emission / (1.0 - albedo);
        for [from, to] in [[vec3(0.1, -0.2, 0.8), Vec3::NEG_Z], [vec3(-0.9, 0.9, -0.9), vec3(1.0, -1.0, 0.8)]] {
            let pixels = seen(gpu, &stage.scene, view(from, to, 70.0, [48, 48]), &baked);
            let ratios: Vec<f32> = pixels.iter().map(|(_, e)| e / wanted).collect();
            let mean = ratios.iter().sum::<f32>() / ratios.len() as f32;
            let [least, most] = range(ratios.iter().copied());
            println!("from {from}: mean {mean:.4}, {least:.4} to {most:.4}");
            assert!((mean - 1.0).abs() < 0.01, "from {from}: {mean}");
            // Single texels have the noise of their paths.
            assert!(least > 0.8 && most < 1.2, "from {from}: {least} to {most}");
        }
    });
}

#[test]
fn metals_of_a_diffuse_bake_are_black_as_in_the_path_tracer() {
    with_gpu(|gpu| {
        let (scene, lamp) = glowing_room(4.0, |stage, _| {
            let metal = Material { metallic: 1.0, roughness: 0.6, ..Material::diffuse("metal", Vec3::splat(0.7)) };
            let metal = stage.material(metal);
            stage.cuboid(metal, Vec3::splat(-0.6), Vec3::splat(0.6), false);
        });
        let eye = view(vec3(0.9, 0.4, 1.7), vec3(0.1, 0.0, 0.6), 15.0, [16, 16]);
        let truth = render(gpu, &scene, &eye, &matt(1), 16);
        let most = |layers: &Layers, name: &str| layers.layer(name).unwrap().data.iter().copied().fold(0.0, f32::max);
        assert_eq!((most(&truth, "direct"), most(&truth, "indirect")), (0.0, 0.0));
        let baked = lightmap_of(gpu, &scene, lamp, Baking { bounces: 1, density: 4.0, ..baking(16) });
        let found = Studio::with(gpu, scene, eye, &baked, &lamps_alone()).frame(0, &lamps_alone()).unwrap().0;
        assert!(most(&found, "irradiance") > 1.0);
        assert_eq!(most(&found, "indirect"), 0.0);
    });
}

#[test]
fn gloss_reflects_as_much_of_even_light_as_the_path_tracer_says() {
    with_gpu(|gpu| {
        for (albedo, metallic, roughness) in [(0.05, 0.0, 0.3), (0.05, 0.0, 0.9), (0.5, 0.0, 0.5), (0.7, 1.0, 0.6)] {
            let (scene, lamp) = glowing_room(4.0, |stage, _| {
                let body = Material { metallic, roughness, ..Material::diffuse("body", Vec3::splat(albedo)) };
                let body = stage.material(Material { ior: 1.5, ..body });
                stage.cuboid(body, Vec3::splat(-0.6), Vec3::splat(0.6), false);
            });
            let settings = Baking { bounces: 1, density: 4.0, diffuse_only: false, ..baking(256) };
            let baked = lightmap_of(gpu, &scene, lamp, settings);
            // A face of the body fills the picture.
            let eye = view(vec3(0.9, 0.4, 1.7), vec3(0.1, 0.0, 0.6), 15.0, [32, 32]);
            let pictured = |gloss: bool| {
                let mut settings = lamps_alone();
                settings.daylight.gloss = gloss;
                let mut studio = Studio::with(gpu, scene.clone(), eye, &baked, &settings);
                studio.frame(0, &settings).unwrap().0
            };
            let truth = render(gpu, &scene, &eye, &Settings { diffuse_only: false, ..matt(1) }, 256);
            let sum = |layers: &Layers, name: &str| layers.layer(name).unwrap().data.iter().sum::<f32>();
            let wanted = sum(&truth, "direct") + sum(&truth, "indirect");
            let [found, without] = [true, false].map(|gloss| sum(&pictured(gloss), "indirect") / wanted);
            println!(
                "albedo {albedo}, metallic {metallic}, roughness {roughness}: {found:.4}, without gloss {without:.4}"
            );
            assert!((found - 1.0).abs() < 0.02, "albedo {albedo}, metallic {metallic}, roughness {roughness}: {found}");
            // Without gloss metals are diffuse surfaces of their colour.
            assert!(if metallic > 0.0 { (without - 1.0).abs() < 0.1 } else { without < 0.97 }, "{without}");
        }
    });
}

/// Least and mean irradiance of a floor beside a black block that stands in it, or on it, seen from above; by that of an open floor. `gap`: metres
/// between two such blocks that are narrow, around `middle`, and that reach so far to both sides; `side`: of the part of the floor that is seen, metres; `two_sided`: surfaces of the blocks;
/// `turned`: the walls of the room have two sides, and their fronts face outwards.
fn beside_a_block(
    gpu: &Gpu,
    [foot, head, gap, middle, reach]: [f32; 5],
    side: f32,
    [two_sided, turned]: [bool; 2],
) -> [f32; 2] {
    let (mut scene, lamp) = glowing_room(4.2, |stage, grey| {
        let black = Material { double_sided: two_sided, ..Material::diffuse("black", Vec3::ZERO) };
        let black = stage.material(black);
        stage.quad(grey, vec3(-1.2, 0.0, -1.2), Vec3::Z * 2.4, Vec3::X * 2.4);
        if gap > 0.0 {
            stage.cuboid(black, vec3(-reach, foot, -0.53), vec3(middle - 0.5 * gap, head, 0.53), false);
            stage.cuboid(black, vec3(middle + 0.5 * gap, foot, -0.53), vec3(reach, head, 0.53), false);
        } else {
            stage.cuboid(black, vec3(-0.53, foot, -0.53), vec3(0.53, head, 0.53), false);
        }
    });
    if turned {
        scene.materials[lamp as usize].double_sided = true;
        for primitive in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.primitives).filter(|p| p.material == lamp) {
            primitive.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
            primitive.normals.iter_mut().for_each(|normal| *normal = -*normal);
        }
    }
    let baked = lightmap_of(gpu, &scene, lamp, Baking { bounces: 2, ..baking(1024) });
    let pixels = seen(gpu, &scene, flat_view(vec3(middle, 2.0, 0.0), vec3(middle, 0.0, 0.0), side, [160, 160]), &baked);
    // A block takes at most 28 % of the picture.
    assert!(pixels.len() > 18_000, "{}", pixels.len());
    let mean = pixels.iter().map(|(_, e)| *e).sum::<f32>() / pixels.len() as f32;
    [range(pixels.iter().map(|(_, e)| *e))[0], mean].map(|e| e / std::f32::consts::PI)
}

#[test]
fn a_thing_that_stands_in_a_floor_has_no_black_seam() {
    with_gpu(|gpu| {
        for (foot, two_sided) in [(-0.5, false), (1e-4, false), (-0.5, true)] {
            let [least, _] = beside_a_block(gpu, [foot, 0.6, 0.0, 0.0, 0.0], 2.0, [two_sided, false]);
            println!("foot at {foot} m, surfaces with two sides: {two_sided}: {least:.3} of the open floor's light");
            // A floor beside a wall without an end would have half of the light, with the noise of its paths.
            assert!(least > 0.45, "foot at {foot} m, surfaces with two sides: {two_sided}: {least}");
        }
    });
}

#[test]
fn the_floor_of_a_gap_that_is_narrower_than_a_texel_has_the_light_of_the_gap() {
    with_gpu(|gpu| {
        // The middles of the texels are in the blocks; in the narrow gap, so are the places that are the nearest to them. In the middle between walls
        // without an end, the floor has the light of the strip of sky that it sees: gap / √(gap² + 4 head²).
        for (gap, head, turned) in [(0.1f32, 0.02f32, false), (0.1, 0.3, false), (0.1, 0.3, true), (0.04, 0.12, false)]
        {
            let wanted = gap / gap.hypot(2.0 * head);
            let [least, mean] = beside_a_block(gpu, [-0.5, head, gap, 0.0, 0.17], 0.8 * gap, [false, turned]);
            let name = format!("blocks of {head} m, {gap} m apart, walls turned: {turned}");
            println!("{name}: {mean:.3} of the open floor's light, at least {least:.3}; {wanted:.3} in the middle");
            assert!((mean / wanted - 1.0).abs() < 0.25 && least > 0.6 * wanted, "{name}: {mean}, {least}");
        }
    });
}

#[test]
fn the_floor_of_a_gap_between_the_places_of_a_texel_is_not_black() {
    with_gpu(|gpu| {
        // Places are an eighth of a texel of 0.125 m away from one another and more, and none is in the gap. The blocks cover all texels around a pixel, so
        // its light is that of the floor beside the blocks; that of the gap is 0.29 in the middle.
        let [least, mean] = beside_a_block(gpu, [-0.5, 0.02, 0.012, 0.0306, 0.21], 0.01, [false; 2]);
        println!("{mean:.3} of the open floor's light, at least {least:.3}");
        assert!(least > 0.8 && mean < 1.1, "{least} {mean}");
    });
}

#[test]
fn a_lightmap_has_the_light_of_the_path_tracer_from_cameras_that_it_was_not_made_for() {
    with_gpu(|gpu| {
        let mut stage = Stage { scene: crate::daylight_light::stage() };
        let lamp = stage.emitter(vec3(5.0, 5.0, 5.0));
        stage.quad(lamp, vec3(-1.5, 1.9, -1.0), Vec3::X * 0.8, Vec3::Z * 0.8);
        let baked = lightmap_of(gpu, &stage.scene, lamp, Baking { density: 16.0, ..baking(128) });
        for from in [vec3(0.0, 2.2, 4.5), vec3(1.8, 1.7, 1.8), vec3(-1.2, 0.4, 1.9)] {
            let eye = view(from, vec3(0.0, 0.6, 0.0), 45.0, [48, 36]);
            let mut studio = Studio::with(gpu, stage.scene.clone(), eye, &baked, &lamps_alone());
            let found = studio.frame(0, &lamps_alone()).unwrap().0;
            let truth = render(gpu, &stage.scene, &eye, &matt(16), 256);
            let of = |layers: &Layers, name: &str| layers.layer(name).unwrap().data.clone();
            let [a, b, c] = [of(&found, "indirect"), of(&truth, "direct"), of(&truth, "indirect")];
            let [found, wanted] = (0..a.len())
                .fold([0.0f64; 2], |[found, wanted], i| [found + f64::from(a[i]), wanted + f64::from(b[i] + c[i])]);
            println!("from {from}: {:.4} of the path tracer's energy", found / wanted);
            assert!((found / wanted - 1.0).abs() < 0.02, "from {from}: {}", found / wanted);
        }
    });
}
