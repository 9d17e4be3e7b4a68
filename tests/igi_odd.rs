//! Instant global illumination of unusual scenes: every picture must be finite (the studio checks each pixel), and must agree with a closed
//! form if there is one.

use crate::igi_lab::{Studio, flux, mean, plain, room};
use crate::tracer_lab::{Stage, flat_view, view};
use glam::{Mat4, Quat, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{Environment, LightKind, Material, Pose, Scene, Transform, View},
    techniques::igi::Settings,
};
use lucerna_scenes as builtin;

/// The default settings with fewer lights and rays.
fn small() -> Settings {
    Settings { vpls: 40, bounces: 2, candidates: 2, direct_samples: 4, ..Settings::default() }
}

fn fast() -> Settings {
    Settings { imperfect: true, downsample: 4, interleave: 3, bounces: 3, ..small() }
}

#[test]
fn an_environment_alone_lights_what_it_reaches() {
    with_gpu(|gpu| {
        // A convex object under a constant sky reflects ρ L everywhere and does not light itself.
        let mut stage = Stage::new();
        let matt = stage.material(Material { ior: 1.0, ..Material::diffuse("matt", vec3(0.5, 0.25, 0.1)) });
        stage.sphere(matt, Vec3::ZERO, 1.0, 24, false);
        stage.scene.environment = Some(Environment::constant(Vec3::splat(2.0)));
        let seen = view(vec3(0.0, 0.2, 1.6), Vec3::ZERO, 20.0, [12, 12]);
        for settings in [small(), fast()] {
            let settings = Settings { direct_samples: 256, specular: false, ..settings };
            let shown = Studio::new(gpu, &stage.scene).render(&seen, &settings, 0);
            for channel in 0..3 {
                let sum: f32 = shown.direct.iter().map(|p| p[channel]).sum::<f32>() / shown.direct.len() as f32;
                let exact = [1.0, 0.5, 0.2][channel];
                assert!((sum / exact - 1.0).abs() < 0.02, "channel {channel}: {sum} instead of {exact}");
            }
            assert!(mean(&shown.indirect) < 1e-3 * mean(&shown.direct), "a ball lights itself");
        }
        // No light of the sky enters a closed box.
        let mut dark = room(Vec3::splat(0.8));
        dark.scene.environment = Some(Environment::constant(Vec3::splat(2.0)));
        let shown = Studio::new(gpu, &dark.scene).render(&view(Vec3::ZERO, Vec3::X, 60.0, [12, 12]), &small(), 0);
        assert_eq!(mean(&shown.total), 0.0);
    });
}

#[test]
fn emissive_surfaces_alone_light_a_room() {
    with_gpu(|gpu| {
        // In a closed room with constant emission L and albedo ρ the radiance after all bounces is L / (1 - ρ), after two bounces
        // L (1 + ρ + ρ²). Virtual lights give all but the first two terms.
        let (radiance, rho) = (1.5f32, 0.5f32);
        let mut stage = Stage::new();
        let glow =
            Material { emissive: Vec3::splat(radiance), ior: 1.0, ..Material::diffuse("glow", Vec3::splat(rho)) };
        let glow = stage.material(glow);
        stage.sphere(glow, Vec3::ZERO, 1.0, 20, true);
        let seen = view(vec3(0.2, 0.1, 0.0), Vec3::X, 90.0, [16, 16]);
        let settings = Settings { vpls: 4000, candidates: 1, bounces: 1, bound: 0.0, ..small() };
        let settings = Settings { direct_samples: 64, specular: false, ..settings };
        let shown = Studio::new(gpu, &stage.scene).render(&seen, &settings, 0);
        let (direct, indirect) = (mean(&shown.direct), mean(&shown.indirect));
        let (l, r) = (f64::from(radiance), f64::from(rho));
        println!("direct {direct}, indirect {indirect}");
        assert!((direct / (l * (1.0 + r)) - 1.0).abs() < 0.02, "{direct} instead of {}", l * (1.0 + r));
        assert!((indirect / (l * r * r) - 1.0).abs() < 0.03, "{indirect} instead of {}", l * r * r);
    });
}

/// The scene `scale` times as large, with lamps that light it as before, and the view of its first camera.
fn scaled(scene: &Scene, scale: f32) -> (Scene, View) {
    let mut scene = scene.clone();
    for node in &mut scene.nodes {
        // The scale is applied to the meshes, because scaled nodes would change cameras and lamps.
        let matrix = node.local.matrix();
        node.local = Transform::Matrix(Mat4::from_cols(
            matrix.x_axis,
            matrix.y_axis,
            matrix.z_axis,
            (matrix.w_axis.truncate() * scale).extend(1.0),
        ));
    }
    for primitive in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.primitives) {
        primitive.positions.iter_mut().for_each(|p| *p *= scale);
    }
    for light in &mut scene.lights {
        // Intensities (W/sr) grow with the square of the scale.
        light.intensity *= scale * scale;
    }
    let pose = Pose::rest(&scene);
    let mut camera = scene.cameras[0].clone();
    if let lucerna::scene::Projection::Perspective { znear, zfar, .. } = &mut camera.projection {
        *znear *= scale;
        *zfar = zfar.map(|far| far * scale);
    }
    let node = scene.nodes.iter().position(|node| node.camera == Some(0)).unwrap();
    let view = View::new(&camera, pose.world[node], [32, 32]);
    (scene, view)
}

#[test]
fn a_room_looks_the_same_at_every_size() {
    with_gpu(|gpu| {
        let cornell = builtin::load("cornell").unwrap();
        let mut pictures = Vec::new();
        // GPUs round otherwise at sizes that are no powers of two, and a number on the border of two virtual lights then draws the other one.
        let exact = gpu.describe().device.contains("llvmpipe");
        let scales = if exact { [1.0, 1e-3, 1e4] } else { [1.0, 1.0 / 1024.0, 16384.0] };
        for scale in scales {
            let (scene, view) = scaled(&cornell, scale);
            let mut studio = Studio::new(gpu, &scene);
            pictures.push((scale, studio.render(&view, &small(), 0), studio.render(&view, &fast(), 0)));
        }
        let (_, plain, quick) = &pictures[0];
        assert!(mean(&plain.indirect) > 0.02 * mean(&plain.total));
        for (scale, other, other_quick) in &pictures[1..] {
            for (one, other, most) in [(plain, other, 50), (quick, other_quick, 8)] {
                let differ =
                    |a: &[f32; 4], b: &[f32; 4]| (0..3).any(|c| (a[c] - b[c]).abs() > 0.01 * b[c].abs() + 1e-4);
                let count = one.total.iter().zip(&other.total).filter(|(a, b)| differ(a, b)).count();
                let ratio = mean(&other.total) / mean(&one.total);
                println!("scale {scale}: {count} of {} pixels differ, ratio {ratio:.5}", one.total.len());
                // Rounding changes hits along edges, and the sizes of boxes.
                assert!(count * most <= one.total.len(), "scale {scale}: {count} pixels differ");
                assert!((ratio - 1.0).abs() < 0.01, "scale {scale}: {ratio}");
            }
        }
    });
}

#[test]
fn unlit_surfaces_change_neither_light_nor_what_shares_of_the_scene_are_of() {
    with_gpu(|gpu| {
        // The room is open at the front, so that sun and sky light it. The view is orthographic, because its far plane does not depend on the
        // scene.
        let mut stage = room(vec3(0.7, 0.5, 0.2));
        stage.scene.nodes.retain(|node| node.mesh != Some(5));
        stage.point(vec3(0.2, 0.3, -0.1), vec3(1.0, 2.0, 3.0));
        let sun = Quat::from_rotation_arc(Vec3::NEG_Z, vec3(0.3, -0.4, -1.0).normalize());
        stage.light(LightKind::Directional, Vec3::ONE, 2.0, Mat4::from_quat(sun));
        stage.scene.environment = Some(Environment::constant(Vec3::splat(0.5)));
        let room = stage.scene.clone();
        let painted = stage.material(Material { unlit: true, ..Material::diffuse("painted", Vec3::ONE) });
        stage.quad(painted, vec3(-300.0, -200.0, -500.0), 600.0 * Vec3::X, 400.0 * Vec3::Y);
        let seen = flat_view(vec3(0.0, 0.0, 1.5), Vec3::ZERO, 1.8, [24, 24]);
        let settings = Settings { bound: 0.1, candidates: 2, ..small() };
        let [without, with] = [&room, &stage.scene].map(|scene| Studio::new(gpu, scene).render(&seen, &settings, 0));
        let lights = without.vpls.iter().filter(|v| v.flux != [0.0; 3]).count();
        assert!(lights > 20 && mean(&without.irradiance) > 0.1, "{lights} virtual lights");
        assert!(bytemuck::cast_slice::<_, u8>(&without.vpls) == bytemuck::cast_slice::<_, u8>(&with.vpls));
        assert!(without.irradiance == with.irradiance);
    });
}

#[test]
fn what_hides_light_on_any_side_of_a_lamp_is_seen_at_once() {
    with_gpu(|gpu| {
        // More virtual lights than the probes of the history use. A black plate appears in front of the lamp, on one side or on the other.
        let mut stage = room(vec3(0.7, 0.6, 0.5));
        let black = stage.material(Material { double_sided: true, ..Material::diffuse("black", Vec3::ZERO) });
        let plate = stage.quad(black, vec3(-0.6, -0.6, 0.0), 1.2 * Vec3::X, 1.2 * Vec3::Y);
        stage.point(Vec3::ZERO, Vec3::splat(2.0));
        // The floor below the lamp.
        let seen = flat_view(vec3(0.0, -0.65, 0.0), vec3(0.0, -1.0, 0.0), 1.8, [32, 24]);
        for z in [0.15, -0.15] {
            // Light in the last frame without the plate and in the first frame with it; without and with a history.
            let [[before, after], [_, found]] = [1, 32].map(|history| {
                let mut studio = Studio::new(gpu, &stage.scene);
                let settings = Settings { history, direct_samples: 1, ..plain(512) };
                let light: Vec<f64> = (0..9)
                    .map(|frame| {
                        let at = if frame < 8 { vec3(50.0, 0.0, 0.0) } else { vec3(0.0, 0.0, z) };
                        studio.pose.world[plate] = Mat4::from_translation(at);
                        studio.frame = frame;
                        mean(&studio.render(&seen, &settings, 0).irradiance)
                    })
                    .collect();
                [light[7], light[8]]
            });
            println!(
                "plate at {z}: {:.3} of what was there is left, shown {:.3} of that",
                after / before,
                found / after
            );
            assert!(after < 0.75 * before, "{after} {before}");
            assert!((found / after - 1.0).abs() < 0.2, "{} of the light", found / after);
        }
    });
}

#[test]
fn triangles_without_area_change_nothing() {
    with_gpu(|gpu| {
        let build = |degenerate: bool| {
            let mut stage = room(vec3(0.7, 0.6, 0.5));
            let glow = stage.emitter(Vec3::splat(3.0));
            stage.quad(glow, vec3(-0.2, 0.9, -0.2), Vec3::X * 0.4, Vec3::Z * 0.4);
            stage.point(vec3(0.3, 0.2, 0.1), Vec3::ONE);
            if degenerate {
                let at = vec3(0.1, -0.2, 0.3);
                for material in [0, glow] {
                    // Degenerate triangles: a point, a line to and fro, and three points on a line.
                    stage.mesh(material, vec![at; 3], vec![Vec3::Y; 3], vec![0, 1, 2]);
                    stage.mesh(material, vec![at, at + Vec3::X, at], vec![Vec3::Y; 3], vec![0, 1, 2]);
                    stage.mesh(material, vec![at, at + Vec3::X, at + 0.5 * Vec3::X], vec![Vec3::Y; 3], vec![0, 1, 2]);
                }
            }
            stage.scene
        };
        let seen = view(vec3(0.0, 0.0, 0.9), Vec3::NEG_Z, 80.0, [24, 24]);
        let settings = Settings { direct_samples: 64, ..small() };
        let [without, with] = [false, true].map(|degenerate| {
            let scene = build(degenerate);
            Studio::new(gpu, &scene).render(&seen, &settings, 0)
        });
        // The light tree may differ, and so the samples of direct light.
        let ratio = mean(&with.total) / mean(&without.total);
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
        let ratio = mean(&with.indirect) / mean(&without.indirect);
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    });
}

#[test]
fn a_lamp_in_a_closed_box_lights_nothing_outside() {
    with_gpu(|gpu| {
        let mut stage = room(Vec3::splat(0.7));
        let card = stage.material(Material::diffuse("card", Vec3::splat(0.7)));
        stage.cuboid(card, Vec3::splat(-0.3), Vec3::splat(0.3), false);
        stage.point(vec3(0.05, 0.1, -0.05), Vec3::ONE);
        let out = view(vec3(0.0, 0.0, 0.95), vec3(0.2, 0.1, -1.0), 80.0, [24, 24]);
        let within = view(vec3(-0.2, 0.0, 0.2), vec3(0.3, 0.0, -0.3), 80.0, [16, 16]);
        let mut studio = Studio::new(gpu, &stage.scene);
        for settings in [small(), fast(), Settings { bounces: 8, vpls: 400, ..small() }] {
            let shown = studio.render(&out, &settings, 0);
            assert_eq!((mean(&shown.direct), mean(&shown.indirect)), (0.0, 0.0), "light through walls: {settings:?}");
        }
        // The inner faces are back faces. The camera does not see them, but light paths hit them.
        assert!(studio.render(&within, &small(), 0).vpls.iter().any(|vpl| vpl.flux[0] > 0.0));
    });
}

#[test]
fn lamps_in_walls_and_in_corners_give_no_more_than_they_have() {
    with_gpu(|gpu| {
        // Lamps on a wall, on an edge, in a corner, outside, and at the camera; strong, weak, and without intensity.
        for at in [vec3(0.0, 1.0, 0.0), vec3(1.0, 1.0, 0.2), Vec3::ONE, vec3(3.0, 0.0, 0.0), vec3(0.0, 0.0, 0.5)] {
            for strength in [1e-12, 1.0, 1e9] {
                let mut stage = room(vec3(0.9, 0.5, 1.0));
                stage.point(at, Vec3::splat(strength));
                stage.point(vec3(0.2, 0.2, 0.2), Vec3::ZERO);
                let seen = view(vec3(0.0, 0.0, 0.5), vec3(0.3, 0.2, -1.0), 80.0, [9, 7]);
                let shown = Studio::new(gpu, &stage.scene).render(&seen, &Settings { candidates: 1, ..small() }, 0);
                // Not more than the lamp's flux is reflected. A lamp outside lights the outer sides of the closed room.
                let sent = flux(&shown.vpls, 0);
                let most = vec3(0.9, 0.5, 1.0) * (4.0 * std::f32::consts::PI * strength * 1.0001);
                assert!(sent.cmple(most).all(), "{at} {strength}: {sent} of {most}");
                if at.x > 2.0 {
                    assert!(sent != Vec3::ZERO && mean(&shown.total) == 0.0, "light through walls");
                }
            }
        }
        // Spot lights without width emit no light. Otherwise the intensity is the square of a ramp in the cosine between the outer and the inner
        // cone.
        for (inner, outer, least, most) in [
            (0.0, 0.0, 0.0, 0.0),
            (0.0, 1e-4, 0.0, 0.0),
            (0.0, 0.05, 4.1e-4, 4.2e-4),
            (0.0, 1.57, 0.33, 0.335),
            (1.5, 1.57, 0.95, 0.955),
        ] {
            let mut stage = room(Vec3::splat(0.5));
            stage.light(LightKind::Spot { range: None, inner, outer }, Vec3::ONE, 2.0, Mat4::IDENTITY);
            let seen = view(vec3(0.0, 0.0, 0.5), Vec3::NEG_Z, 80.0, [9, 7]);
            let shown = Studio::new(gpu, &stage.scene).render(&seen, &Settings { candidates: 1, ..fast() }, 0);
            // Relative to the flux of a hemisphere with full intensity.
            let share = flux(&shown.vpls, 0) / (0.5 * 2.0 * 2.0 * std::f32::consts::PI);
            println!("cone from {inner} to {outer}: {share}");
            assert!(
                share.cmpge(Vec3::splat(least)).all() && share.cmple(Vec3::splat(most)).all(),
                "{inner} {outer}: {share}"
            );
            let behind = shown.vpls.iter().any(|vpl| vpl.depth == 0 && vpl.flux[0] > 0.0 && vpl.position[2] > 0.0);
            assert!(!behind, "{inner} {outer}: light behind the spot");
        }
    });
}

#[test]
fn a_lamp_of_two_sides_lights_the_eight_corners_of_a_room_alike() {
    with_gpu(|gpu| {
        // Far from the origin, where the step off a surface is larger than the least part of a shadow ray.
        let middle = vec3(20.0, -10.0, 0.0);
        let mut stage = Stage::new();
        let wall = stage.material(Material { ior: 1.0, ..Material::diffuse("wall", Vec3::splat(0.5)) });
        stage.cuboid(wall, middle - Vec3::ONE, middle + Vec3::ONE, true);
        let lamp = Material { double_sided: true, ..Material::emitter("lamp", Vec3::splat(5.0)) };
        let lamp = stage.material(lamp);
        stage.quad(lamp, middle - vec3(0.2, 0.0, 0.2), Vec3::X * 0.4, Vec3::Z * 0.4);
        let mut studio = Studio::new(gpu, &stage.scene);
        let settings = Settings { direct_samples: 16, ..plain(4000) };
        let shown = [1.0f32, -1.0].map(|up| {
            let seen = view(middle + vec3(0.0, 0.5 * up, 0.0), middle + up * Vec3::Y, 90.0, [16, 16]);
            studio.render(&seen, &settings, 0)
        });
        let mut corners = [0.0; 8];
        for vpl in &shown[0].vpls {
            let at = Vec3::from(vpl.position) - middle;
            corners[usize::from(at.x > 0.0) + 2 * usize::from(at.y > 0.0) + 4 * usize::from(at.z > 0.0)] += vpl.flux[0];
        }
        // Half of the light that the lamp sends to both sides.
        let each = 0.5 * 2.0 * 5.0 * std::f32::consts::PI * 0.16 / 8.0;
        println!("corners {corners:?}, each {each}");
        assert!(corners.iter().all(|flux| (flux / each - 1.0).abs() < 0.02), "{corners:?} instead of {each}");
        let [ceiling, floor] = shown.map(|shown| mean(&shown.direct));
        println!("ceiling {ceiling}, floor {floor}");
        assert!(floor > 0.01 && (ceiling / floor - 1.0).abs() < 0.02, "ceiling {ceiling}, floor {floor}");
    });
}

#[test]
fn a_leaning_normal_receives_by_its_own_cosine_but_four_times_what_arrives_at_most() {
    with_gpu(|gpu| {
        // A plate under a sun that stands low, with normals that lean towards the sun.
        for (sun, lean) in [(0.5f32, 0.4f32), (1.2, 0.5), (1.5, 0.3), (1.45, 1.4)] {
            let mut stage = Stage::new();
            let matt = stage.material(Material::diffuse("plate", Vec3::splat(0.5)));
            let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)].map(|(x, z)| vec3(x, 0.0, z));
            let normal = vec3(lean.sin(), lean.cos(), 0.0);
            stage.mesh(matt, corners.to_vec(), vec![normal; 4], vec![0, 1, 2, 0, 2, 3]);
            let from = vec3(sun.sin(), sun.cos(), 0.0);
            let turn = Quat::from_rotation_arc(Vec3::NEG_Z, -from);
            stage.light(LightKind::Directional, Vec3::ONE, 3.0, Mat4::from_quat(turn));
            let seen = view(vec3(0.0, 1.0, 1.0), Vec3::ZERO, 60.0, [2, 2]);
            let found = flux(&Studio::new(gpu, &stage.scene).render(&seen, &plain(500), 0).vpls, 0).x;
            let arrives = 3.0 * 4.0 * sun.cos();
            let exact = 0.5 * (3.0 * 4.0 * normal.dot(from)).min(4.0 * arrives);
            println!("sun at {sun}, normals at {lean}: {found} instead of {exact}");
            assert!((found / exact - 1.0).abs() < 2e-3, "sun at {sun}, normals at {lean}: {found} instead of {exact}");
        }
    });
}

#[test]
fn pictures_smaller_than_tiles_and_few_lights() {
    with_gpu(|gpu| {
        let scene = builtin::load("cornell").unwrap();
        let pose = Pose::rest(&scene);
        let mut studio = Studio::new(gpu, &scene);
        for extent in [[1, 1], [3, 1], [3, 5], [17, 9]] {
            let mut lit = false;
            let seen = View::of_camera(&scene, &pose, 0, extent).unwrap();
            // The same rays as those through the middle of every ninth pixel of a larger picture.
            let [width, height] = extent.map(|side| 9 * side as usize);
            let large = View::of_camera(&scene, &pose, 0, [width as u32, height as u32]).unwrap();
            let settings = Settings { vpls: 400, candidates: 1, direct_samples: 64, ..small() };
            let large = studio.render(&large, &settings, 0);
            let places = (4..height).step_by(9).flat_map(|y| (4..width).step_by(9).map(move |x| (x, y)));
            let (direct, total): (Vec<_>, Vec<_>) =
                places.map(|(x, y)| (large.direct[y * width + x], large.total[y * width + x])).unzip();
            for (vpls, bounces) in [(1, 1), (8, 8), (7, 3)] {
                for (downsample, interleave, fused) in [(4, 4, false), (4, 4, true), (3, 2, false)] {
                    let settings = Settings { vpls, bounces, downsample, interleave, fused, ..small() };
                    let shown = studio.render(&seen, &settings, 0);
                    let [first, all] =
                        [(&shown.direct, &direct), (&shown.total, &total)].map(|(a, b)| mean(a) / mean(b));
                    println!("{extent:?}, {vpls} virtual lights: {first} of the direct light, {all} of all");
                    assert!((0.8..1.25).contains(&first), "{extent:?}, {vpls}: {first} of the direct light");
                    // A single virtual light may be visible from no pixel, or represent all lights of its tile.
                    assert!(mean(&shown.total) > 0.9 * mean(&direct) && all < 20.0, "{extent:?}, {vpls}: {all} of all");
                    // There is indirect light, unless no pixel sees a virtual light.
                    lit |= mean(&shown.indirect) > 0.0;
                }
            }
            assert!(lit || extent[0] < 10, "{extent:?}: no indirect light at all");
        }
    });
}

#[test]
fn nothing_but_glass_and_mirrors() {
    with_gpu(|gpu| {
        // Light paths hit no diffuse surface: there is no virtual light and no indirect light, and the paths end.
        let mut stage = Stage::new();
        let mirror =
            stage.material(Material { metallic: 1.0, roughness: 0.0, ..Material::diffuse("mirror", Vec3::ONE) });
        let glass =
            stage.material(Material { transmission: 1.0, roughness: 0.0, ..Material::diffuse("glass", Vec3::ONE) });
        stage.cuboid(mirror, Vec3::splat(-1.0), Vec3::ONE, true);
        stage.sphere(glass, vec3(0.2, 0.0, -0.3), 0.4, 12, false);
        stage.point(vec3(-0.5, 0.4, 0.3), Vec3::ONE);
        let seen = view(vec3(0.0, 0.0, 0.8), Vec3::NEG_Z, 80.0, [16, 16]);
        for settings in [Settings { specular_depth: 16, ..small() }, fast(), Settings { specular: false, ..plain(300) }]
        {
            let shown = Studio::new(gpu, &stage.scene).render(&seen, &settings, 0);
            if settings.specular {
                assert!(shown.vpls.iter().all(|vpl| vpl.flux == [0.0; 3]) && mean(&shown.indirect) == 0.0);
                continue;
            }
            // Without specular, glass is white and diffuse, and mirrors are black.
            let lit: Vec<Vec3> =
                shown.vpls.iter().filter(|vpl| vpl.flux[0] > 0.0).map(|vpl| vpl.position.into()).collect();
            assert!(
                !lit.is_empty() && lit.iter().all(|p| (p.distance(vec3(0.2, 0.0, -0.3)) - 0.4).abs() < 0.02),
                "{lit:?}"
            );
            let (mut ball, mut walls) = (0, 0);
            for (total, albedo) in shown.total.iter().zip(&shown.albedo) {
                let white = albedo[..3] != [0.0; 3];
                *(if white { &mut ball } else { &mut walls }) += 1;
                // The lamp is on the camera's side of the ball, so the visible half is lit, except for its rim.
                assert!(white || total[..3] == [0.0; 3], "{total:?} of a mirror");
            }
            assert!(
                ball > 10 && walls > 100 && mean(&shown.direct) > 0.0,
                "{ball} pixels of the ball, {walls} of walls"
            );
        }
    });
}

#[test]
fn surfaces_that_can_show_no_indirect_light_trace_no_rays_for_it() {
    with_gpu(|gpu| {
        let mut stage = room(Vec3::splat(0.7));
        let screen = stage.material(Material { unlit: true, ..Material::diffuse("screen", Vec3::ONE) });
        let black = stage.material(Material::diffuse("black", Vec3::ZERO));
        stage.quad(screen, vec3(-0.8, -0.5, -0.9), Vec3::X * 0.7, Vec3::Y);
        stage.quad(black, vec3(0.1, -0.5, -0.9), Vec3::X * 0.7, Vec3::Y);
        stage.point(vec3(0.0, 0.6, 0.5), Vec3::ONE);
        let mut studio = Studio::new(gpu, &stage.scene);
        let seen = view(vec3(0.0, 0.0, 0.9), Vec3::NEG_Z, 80.0, [24, 24]);
        // With filters, the texels of these surfaces gather for their neighbours.
        for (interleave, traced) in [(1, false), (2, true)] {
            let shown = studio.render(&seen, &Settings { interleave, ..plain(64) }, 0);
            let (mut counts, mut rays) = ([0; 3], [0.0; 3]);
            for (albedo, gathered) in shown.albedo.iter().zip(&shown.gathered) {
                let kind = if albedo[3] < 0.5 { 0 } else { usize::from(albedo[..3] != [0.0; 3]) + 1 };
                counts[kind] += 1;
                rays[kind] += gathered[3];
            }
            println!("interleave {interleave}: {rays:?} rays of {counts:?} pixels, unlit, black and others");
            assert!(counts.iter().all(|count| *count > 20) && rays[2] > 0.0);
            assert!(rays[..2].iter().all(|rays| (*rays > 0.0) == traced), "interleave {interleave}");
        }
    });
}
