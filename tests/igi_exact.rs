//! Instant global illumination against closed forms, and against the same picture computed in another way.

use crate::igi_lab::{Studio, flux, mean, plain, room};
use crate::tracer_lab::{Stage, flat_view, view};
use glam::{Mat4, Quat, Vec3, vec3, vec4};
use lucerna::{
    gpu::testing::with_gpu,
    graph::Graph,
    resident::Resident,
    scene::{AlphaMode, Environment, LightKind, Material, Pose, Transform, environment::uv_from_direction},
    techniques::igi::{Igi, PictureSettings, Settings, Visibility},
};
use std::f64::consts::PI;

#[test]
fn a_wire_before_the_sky_gathers_for_itself() {
    with_gpu(|gpu| {
        // An object one pixel wide, between the pixels of the coarse texels: no texel in the neighbourhood hits a surface.
        let mut stage = Stage::new();
        let white = stage.material(Material::diffuse("white", Vec3::splat(0.8)));
        stage.quad(white, vec3(-0.625, -1.0, 0.0), Vec3::X * 0.125, Vec3::Y * 2.0);
        stage.quad(white, vec3(-2.0, -2.0, 4.0), Vec3::Y * 4.0, Vec3::X * 4.0);
        stage.point(vec3(0.0, 0.0, 3.0), Vec3::splat(3.0));
        let mut studio = Studio::new(gpu, &stage.scene);
        let seen = flat_view(vec3(0.0, 0.0, 2.0), Vec3::ZERO, 2.0, [16, 16]);
        let right = studio.render(&seen, &plain(64), 3).irradiance;
        let wire: Vec<usize> = (0..256).filter(|&i| right[i][1] > 0.0).collect();
        assert!(wire.len() == 16 && wire.iter().all(|i| i % 16 == 3), "{wire:?}");
        for despeckle in [0.0, 3.0] {
            let settings = Settings { downsample: 4, refine: 0.05, despeckle, ..plain(64) };
            let found = studio.render(&seen, &settings, 3).irradiance;
            for &i in &wire {
                let (found, right) = (found[i][1], right[i][1]);
                assert!((found - right).abs() < 1e-4 * right, "pixel {i}: {found} instead of {right}, {despeckle}");
            }
        }
        // Without refinement a pixel uses a texel further away.
        stage.scene.meshes[0].primitives[0].positions[1..3].iter_mut().for_each(|p| p.x += 1.5);
        let mut studio = Studio::new(gpu, &stage.scene);
        let found = studio.render(&seen, &Settings { downsample: 4, ..plain(64) }, 3);
        assert!(found.irradiance.iter().zip(&found.albedo).all(|(e, a)| a[1] == 0.0 || e[1] > 0.0));
    });
}

#[test]
fn mirrors_and_glass_show_what_they_emit() {
    with_gpu(|gpu| {
        // A dark scene: the emitter is seen directly, and in a mirror behind the camera that reflects nine tenths.
        let glow = vec3(1.0, 0.5, 2.0);
        let base = Material { emissive: glow, roughness: 0.0, ..Material::diffuse("glow", Vec3::ONE) };
        for material in [
            Material { transmission: 1.0, ..base.clone() },
            Material { transmission: 0.4, ..base.clone() },
            Material { metallic: 1.0, ..base.clone() },
            Material { ior: 1.0, ..base },
        ] {
            let mut stage = Stage::new();
            let material = stage.material(material);
            stage.quad(material, vec3(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0);
            let mut studio = Studio::new(gpu, &stage.scene);
            for specular_depth in [0, 6] {
                let settings = Settings { specular_depth, vpls: 8, candidates: 1, ..Settings::default() };
                let shown = studio.render(&view(Vec3::Z, Vec3::ZERO, 30.0, [8, 8]), &settings, 0);
                for pixel in &shown.total {
                    let found = Vec3::from_slice(&pixel[..3]);
                    assert!((found - glow).abs().max_element() < 2e-3, "{found} instead of {glow}");
                }
            }
        }
    });
}

#[test]
fn a_narrow_spot_sends_no_more_than_it_shines() {
    with_gpu(|gpu| {
        // The slope of the falloff at the cone's rim is limited, so a narrow cone has less flux than its angles say.
        for (degrees, slack) in [(1.0f32, 5e-3), (2.0, 2e-3), (2.5, 1e-3), (10.0, 1e-4)] {
            let mut stage = room(Vec3::splat(0.5));
            let kind = LightKind::Spot { range: None, inner: 0.0, outer: degrees.to_radians() };
            let turned = Mat4::from_rotation_translation(Quat::from_rotation_x(0.3), vec3(0.1, 0.2, 0.3));
            stage.light(kind, Vec3::ONE, 3.0, turned);
            let edge = f64::from(degrees.to_radians().cos());
            let scale = 1.0 / (1.0 - edge).max(1e-3);
            let power = 3.0 * 2.0 * PI * scale * scale * (1.0 - edge).powi(3) / 3.0;
            let mut studio = Studio::new(gpu, &stage.scene);
            let shown = studio.render(&view(Vec3::ZERO, Vec3::X, 60.0, [4, 4]), &plain(200), 0);
            let found = f64::from(flux(&shown.vpls, 0).x) / 0.5;
            assert!((found / power - 1.0).abs() < slack, "{degrees} degrees: {found} instead of {power}");
            // The distribution of the light: the mean of sin² about the axis, for a falloff that is the square of a linear ramp in the cosine.
            let axis = turned.transform_vector3(Vec3::NEG_Z).as_dvec3();
            let off = |vpl: &lucerna::shaders::types::Vpl| {
                let to = (Vec3::from(vpl.position) - vec3(0.1, 0.2, 0.3)).as_dvec3().normalize();
                to.cross(axis).length_squared()
            };
            let spread = shown.vpls.iter().map(off).sum::<f64>() / shown.vpls.len() as f64;
            let expected = 0.5 * (1.0 - edge);
            assert!((spread / expected - 1.0).abs() < 0.05, "{degrees} degrees: {spread} instead of {expected}");
        }
    });
}

#[test]
fn light_behind_a_pane_has_not_bounced() {
    with_gpu(|gpu| {
        // A pane of transmission 0.5 and index 1 across the middle of a room: it transmits half of the light.
        let mut stage = room(Vec3::splat(0.5));
        let pane = Material { transmission: 0.5, double_sided: true, ior: 1.0, ..Material::diffuse("pane", Vec3::ONE) };
        let pane = stage.material(pane);
        stage.quad(pane, vec3(0.0, -1.0, -1.0), Vec3::Y * 2.0, Vec3::Z * 2.0);
        stage.point(vec3(-0.5, 0.0, 0.0), Vec3::ONE);
        let mut studio = Studio::new(gpu, &stage.scene);
        for bounces in [1, 3] {
            let settings = Settings { bounces, specular: true, ..plain(3000 * bounces) };
            let shown = studio.render(&view(Vec3::splat(0.5), Vec3::X, 60.0, [4, 4]), &settings, 0);
            let first = |of: &dyn Fn(f32) -> bool| -> f64 {
                let mine = shown.vpls.iter().filter(|vpl| vpl.depth == 0 && of(vpl.position[0]));
                mine.map(|vpl| f64::from(vpl.flux[0])).sum()
            };
            // Solid angle of a square of half side 1 at distance 0.5.
            let met = 4.0 * (1.0f64 / 1.25).asin();
            let sides = [
                ("before", first(&|x| x < -0.01), 0.5 * (4.0 * PI - met)),
                ("on", first(&|x| x.abs() <= 0.01), 0.5 * met),
                ("behind", first(&|x| x > 0.01), 0.5 * 0.5 * met),
            ];
            for (name, found, exact) in sides {
                println!("{bounces} bounces, {name}: {found:.4}, exact {exact:.4}");
                assert!((found / exact - 1.0).abs() < 0.08, "{bounces} bounces, {name}: {found} instead of {exact}");
            }
        }
    });
}

#[test]
fn a_weak_lamp_beside_a_strong_one_shines_all_around_in_time() {
    with_gpu(|gpu| {
        // One path in sixteen belongs to the weak lamp. Over many frames the directions of this path are spread evenly.
        let mut stage = room(Vec3::splat(0.5));
        stage.point(vec3(0.3, 0.0, 0.0), vec3(1.0, 0.0, 0.0));
        stage.point(vec3(-0.3, 0.0, 0.0), vec3(0.0, 15.0, 0.0));
        let mut studio = Studio::new(gpu, &stage.scene);
        let mut counts = [0; 4];
        for frame in 0..32 {
            studio.frame = frame;
            let settings = Settings { history: 100, ..plain(16) };
            let shown = studio.render(&view(Vec3::ZERO, Vec3::X, 60.0, [4, 4]), &settings, 0);
            for vpl in shown.vpls.iter().filter(|vpl| vpl.flux[0] > 0.0) {
                let z = (Vec3::from(vpl.position) - vec3(0.3, 0.0, 0.0)).normalize().z;
                counts[((2.0 * z + 2.0) as usize).min(3)] += 1;
            }
        }
        let all: i32 = counts.iter().sum();
        println!("{counts:?}");
        assert!(all >= 24 && counts.iter().all(|&count| 4 * count >= all / 2), "{counts:?}");
    });
}

#[test]
fn what_flies_far_away_does_not_change_the_light_of_a_room() {
    with_gpu(|gpu| {
        let mut stage = room(Vec3::splat(0.7));
        stage.point(vec3(0.2, 0.3, 0.1), Vec3::ONE);
        let bird = stage.material(Material::diffuse("bird", Vec3::ZERO));
        let bird = stage.quad(bird, vec3(-0.01, 0.99, -0.01), Vec3::X * 0.02, Vec3::Z * 0.02);
        stage.scene.nodes[bird].local =
            Transform::Trs { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE };
        let mut away = stage.scene.clone();
        away.nodes[bird].local =
            Transform::Trs { translation: Vec3::Y * 100.0, rotation: Quat::IDENTITY, scale: Vec3::ONE };
        let away = Pose::rest(&away);
        let mut studio = Studio::new(gpu, &stage.scene);
        let seen = view(vec3(0.0, 0.0, 0.9), vec3(0.1, -0.3, -1.0), 70.0, [24, 24]);
        let settings = Settings { bound: 0.05, ..plain(100) };
        let near = mean(&studio.render(&seen, &settings, 0).irradiance);
        studio.pose = away;
        let far = mean(&studio.render(&seen, &settings, 0).irradiance);
        assert!((far / near - 1.0).abs() < 1e-3, "{far} instead of {near}");
    });
}

#[test]
fn short_paths_look_at_a_sun_beside_a_sky_as_often_as_it_is_worth() {
    with_gpu(|gpu| {
        // Compensation in an open corner. The number of shadow rays for direct light must not change its mean.
        let court = |suns: u32| {
            let mut stage = Stage::new();
            let white = stage.material(Material::diffuse("white", Vec3::splat(0.8)));
            stage.quad(white, vec3(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0);
            stage.quad(white, vec3(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Y);
            let slanted = Mat4::from_quat(Quat::from_rotation_x(-0.8));
            (0..suns).for_each(|_| stage.light(LightKind::Directional, Vec3::ONE, 3.0 / suns as f32, slanted));
            stage.scene.environment = Some(Environment::constant(Vec3::splat(0.1)));
            stage.scene
        };
        let seen = view(vec3(0.0, 0.5, 1.0), vec3(0.0, 0.1, -1.0), 50.0, [24, 24]);
        let back = |suns: u32, direct_samples: u32| {
            let scene = court(suns);
            let mut studio = Studio::new(gpu, &scene);
            let (mut sum, mut squares) = (0.0, 0.0);
            for seed in 1..=4 {
                let settings = Settings { bound: 0.3, direct_samples, ..plain(8) };
                let without = studio.render(&seen, &settings, seed).irradiance;
                let with = studio.render(&seen, &Settings { compensation: 2, ..settings }, seed).irradiance;
                for (with, without) in with.iter().zip(&without) {
                    let added = f64::from(with[1] - without[1]);
                    assert!(added > -1e-4, "light was taken: {added}");
                    sum += added / 4.0 / 576.0;
                    squares += added * added / 4.0 / 576.0;
                }
            }
            (sum, squares.sqrt())
        };
        let (one, few, many) = (back(1, 1), back(1, 64), back(40, 64));
        println!("mean and root mean square: {one:?}, 64 samples {few:?}, 40 suns {many:?}");
        for (name, (sum, squares)) in [("64 samples", few), ("40 suns", many)] {
            assert!((sum / one.0 - 1.0).abs() < 0.06, "{name}: {sum} instead of {}", one.0);
            assert!(squares < 1.25 * one.1, "{name}: spread {squares} beside {}", one.1);
        }
    });
}

#[test]
fn rays_of_another_kind_than_the_scene_was_prepared_for_and_odd_backgrounds_are_refused() {
    with_gpu(|gpu| {
        let stage = room(Vec3::splat(0.5));
        let seen = view(Vec3::ZERO, Vec3::X, 60.0, [4, 4]);
        let query = Settings { visibility: Visibility::Query, ..plain(4) };
        let compute = Settings { visibility: Visibility::Compute, ..plain(4) };
        let refused = |made: &Settings, shown: &Settings, background: [f32; 3]| {
            let mut resident = Resident::new(gpu, &stage.scene).unwrap();
            let mut igi = Igi::new(gpu, &stage.scene, &resident, made).unwrap();
            let mut graph = Graph::new("igi");
            let pose = Pose::rest(&stage.scene);
            let handles = resident.frame_in(&mut graph, &stage.scene, &pose);
            let all = PictureSettings { igi: shown.clone(), background, ..Default::default() };
            let picture = igi.picture(&mut graph, &stage.scene, &pose, &handles, &seen, &all);
            picture.err().map(|error| (error.exit_code(), error.to_string()))
        };
        let (code, text) = refused(&compute, &query, [0.0; 3]).expect("queries after compute");
        assert!(code == 2 && text.contains("igi.visibility"), "{text}");
        assert_eq!(refused(&compute, &compute, [1.0; 3]), None);
        for channel in [f32::NAN, -0.1, f32::INFINITY] {
            let (code, text) = refused(&compute, &compute, [0.0, channel, 0.0]).expect("a background of no light");
            assert!(code == 2 && text.starts_with("background[1]: "), "{text}");
        }
    });
}

#[test]
fn the_sun_and_a_bright_spot_of_the_sky_shine_from_where_they_stand() {
    with_gpu(|gpu| {
        // A floor and a roof above it. Virtual lights must lie on upper sides only, and on the floor only outside of the roof's shadow.
        let stage = || {
            let mut stage = Stage::new();
            let white = stage.material(Material::diffuse("white", Vec3::splat(0.5)));
            stage.quad(white, vec3(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0);
            stage.quad(white, vec3(-1.0, 1.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0);
            stage
        };
        let wanted = vec3(-0.6, 0.7, 0.35).normalize();
        let mut sun = stage();
        let turned = Mat4::from_quat(Quat::from_rotation_arc(Vec3::NEG_Z, -wanted));
        sun.light(LightKind::Directional, Vec3::ONE, 1.0, turned);
        // The texel in this direction after the rotation of the map. Interpolation spreads a little of its light to its neighbours.
        let mut sky = stage();
        let (width, height, rotation) = (256u32, 128u32, 1.0f32);
        let uv = uv_from_direction(Quat::from_rotation_y(-rotation) * wanted);
        let (x, y) = ((uv.x * width as f32) as u32, (uv.y * height as f32) as u32);
        let mut pixels = vec![Vec3::ZERO; (width * height) as usize];
        pixels[(y * width + x) as usize] = Vec3::splat(1000.0);
        sky.scene.environment =
            Some(Environment { width, height, pixels, rotation, ..Environment::constant(Vec3::ONE) });
        for (name, stage, slack) in [("sun", sun, 1e-3), ("sky", sky, 0.15)] {
            let mut studio = Studio::new(gpu, &stage.scene);
            let shown = studio.render(&view(Vec3::Y * 3.0, Vec3::ZERO, 60.0, [4, 4]), &plain(600), 0);
            let lit = |vpl: &&lucerna::shaders::types::Vpl| vpl.flux[0] > 0.0;
            let (mut floor, mut roof) = (0, 0);
            for vpl in shown.vpls.iter().filter(lit) {
                assert!(vpl.normal[1] > 0.99, "{name}: light from below at {:?}", vpl.position);
                if vpl.position[1] > 0.5 {
                    roof += 1;
                    continue;
                }
                floor += 1;
                let at = Vec3::from(vpl.position) + wanted / wanted.y;
                let inside = at.x.abs() < 1.0 - slack && at.z.abs() < 1.0 - slack;
                assert!(!inside, "{name}: light through the roof at {:?}", vpl.position);
            }
            // The lit share of the floor is its share outside of the roof's shadow.
            let share = f64::from(floor) / f64::from(floor + roof);
            let shadow = f64::from((2.0 - (wanted.x / wanted.y).abs()) * (2.0 - (wanted.z / wanted.y).abs()));
            let expected = (4.0 - shadow) / (8.0 - shadow);
            println!("{name}: {floor} on the floor, {roof} on the roof, share {share:.3} of {expected:.3}");
            assert!((share - expected).abs() < 0.04, "{name}: {share} instead of {expected}");
        }
    });
}

#[test]
fn boxes_hide_what_triangles_hide_turned_thin_and_cut_out() {
    with_gpu(|gpu| {
        let mut stage = room(Vec3::splat(0.7));
        let white = stage.material(Material::diffuse("white", Vec3::splat(0.7)));
        let masked = Material {
            alpha: AlphaMode::Mask { cutoff: 0.5 },
            base_color: vec4(0.7, 0.7, 0.7, 0.2),
            double_sided: true,
            ..Material::diffuse("holes", Vec3::ONE)
        };
        let holes = stage.material(masked);
        stage.sphere(white, vec3(0.4, -0.5, -0.3), 0.3, 16, false);
        // Two instances of a mesh, rotated and stretched; slivers across the room; a card with alpha 0.
        let first = stage.quad(white, vec3(-0.2, 0.0, 0.0), Vec3::X * 0.4, Vec3::Y * 0.4);
        let again = stage.scene.nodes[first].clone();
        let turned = |angle: f32, at: Vec3| Mat4::from_translation(at) * Mat4::from_rotation_y(angle);
        stage.scene.nodes[first].local = Transform::Matrix(turned(0.6, vec3(-0.5, -0.6, -0.2)));
        let stretched = turned(-0.4, vec3(-0.3, 0.2, -0.5)) * Mat4::from_scale(vec3(0.3, 1.5, 1.0));
        stage.scene.nodes.push(lucerna::scene::Node { local: Transform::Matrix(stretched), ..again });
        for k in 0..4 {
            let at = vec3(-0.7 + 0.4 * k as f32, -0.9, -0.6);
            stage.mesh(
                white,
                vec![at, at + vec3(0.02, 0.0, 0.0), at + vec3(0.1, 0.6, 0.1)],
                vec![Vec3::Z; 3],
                vec![0, 1, 2],
            );
        }
        stage.quad(holes, vec3(-0.1, -0.4, 0.2), Vec3::X * 0.2, Vec3::Y * 0.2);
        stage.point(vec3(0.3, 0.7, 0.4), Vec3::ONE);
        let mut studio = Studio::new(gpu, &stage.scene);
        let seen = view(vec3(0.0, 0.1, 0.95), vec3(0.0, -0.3, -1.0), 80.0, [40, 40]);
        let settings = Settings { bound: 0.05, ..plain(80) };
        let exact = studio.render(&seen, &settings, 1).irradiance;
        let boxes = studio.render(&seen, &Settings { imperfect: true, ..settings }, 1).irradiance;
        let brighter = boxes.iter().zip(&exact).filter(|(b, e)| (0..3).any(|c| b[c] > e[c] * 1.00001)).count();
        let share = mean(&boxes) / mean(&exact);
        println!("boxes leave {share:.3} of the light");
        assert_eq!(brighter, 0, "imperfect visibility is brighter somewhere");
        assert!((0.7..0.995).contains(&share), "boxes leave {share} of the light");
    });
}
