//! Light of further layers, further cameras and further bounces, drawn from a scene, beside closed forms on the CPU.

use crate::isr_lab;
use crate::scene_kit;
use glam::{DVec3, Vec2, Vec3, Vec4, dvec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    passes::ambient::Irradiance,
    reference::isr_scene::{Buffers, Eye, Patch},
    scene::{Light, LightKind, Material, Node, Primitive, Scene, Transform},
    techniques::isr::{PictureSettings, Settings, picture},
};

/// Parallelograms that glow, each a mesh of its own.
fn scene_of(patches: &[Patch]) -> Scene {
    let mut scene = Scene::default();
    for patch in patches {
        let corners = [patch.corner, patch.corner + patch.a, patch.corner + patch.a + patch.b, patch.corner + patch.b];
        let primitive = Primitive {
            positions: corners.map(|c| c.as_vec3()).to_vec(),
            normals: vec![patch.normal().as_vec3(); 4],
            tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4],
            uvs: vec![vec![Vec2::ZERO; 4]],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Primitive::default()
        };
        let matt = Material::diffuse("", patch.albedo.as_vec3());
        let mesh = scene_kit::mesh(&mut scene, primitive, Material { emissive: patch.radiance.as_vec3(), ..matt });
        scene_kit::place(&mut scene, mesh, glam::Mat4::IDENTITY);
    }
    scene
}

fn patch(corner: [f64; 3], a: [f64; 3], b: [f64; 3], albedo: f64, radiance: f64) -> Patch {
    let [corner, a, b] = [corner, a, b].map(DVec3::from_array);
    Patch { corner, a, b, albedo: DVec3::splat(albedo), radiance: DVec3::splat(radiance) }
}

/// The floor between z = -2 and 0.
fn floor(albedo: f64) -> Patch {
    patch([-1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0], albedo, 0.0)
}

/// Indirect light of the picture.
fn indirect(gpu: &Gpu, patches: &[Patch], eye: &Eye, settings: Settings) -> Vec<f64> {
    let scene = scene_of(patches);
    let settings = PictureSettings { isr: settings, ..Default::default() };
    let (frame, token) = scene_kit::frame(gpu, &scene, |graph, handles| {
        let out = picture(graph, handles, &isr_lab::view(eye), Irradiance::default(), &settings).unwrap().outputs;
        graph.read_image(out.indirect)
    });
    frame.image(token).to_f32().iter().map(|texel| f64::from(texel[0])).collect()
}

/// Means of what was found and of what `exact` says over the floor's pixels away from its edges.
fn on_the_floor(found: &[f64], eye: &Eye, patches: &[Patch], exact: impl Fn(DVec3) -> f64) -> (f64, f64) {
    let seen = Buffers::cast(eye, patches, 1);
    let (mut sums, mut count) = ((0.0, 0.0), 0.0);
    for (i, found) in found.iter().enumerate() {
        let p = seen.position(eye, i % eye.width, i / eye.width);
        if seen.depth[i] < 1.0 && p.y.abs() < 1e-6 && p.x.abs() < 0.8 && (-1.7..-0.3).contains(&p.z) {
            sums = (sums.0 + found, sums.1 + exact(p));
            count += 1.0;
        }
    }
    assert!(count > 700.0, "{count} pixels of floor");
    (sums.0 / count, sums.1 / count)
}

#[test]
fn a_wall_behind_something_lights_the_floor_as_the_closed_form_says() {
    with_gpu(|gpu| {
        let wall = patch([-1.0, 0.0, -2.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], 0.0, 1.0);
        // Before the wall as the camera sees it, but not between wall and floor.
        let screen = patch([-1.5, 1.12, 1.0], [3.0, 0.0, 0.0], [0.0, 0.9, 0.0], 0.0, 0.0);
        let patches = [floor(1.0), wall, screen];
        let eye = Eye::look_at(dvec3(0.0, 1.5, 2.0), dvec3(0.0, 0.3, -1.3), 0.9, 10.0, 120, 96);
        let seen = Buffers::cast(&eye, &patches, 1);
        assert!(seen.sender.iter().all(|sent| *sent == DVec3::ZERO), "the frame shows the wall");
        let exact = |p| wall.reflected_by_white(p, DVec3::Y).x;
        for (layers, share) in [(1, 0.0), (2, 1.0), (3, 1.0)] {
            let settings = Settings { layers, sender_samples: 96, sender_scale: 1, ..Settings::default() };
            let (found, exact) = on_the_floor(&indirect(gpu, &patches, &eye, settings), &eye, &patches, exact);
            println!("{layers} layers: {:.3} of the closed form", found / exact);
            assert!((found / exact - share).abs() < 0.1 * share + 1e-6, "{layers} layers: {found} of {exact}");
        }
    });
}

#[test]
fn masks_of_materials_scale_received_and_sent_light() {
    with_gpu(|gpu| {
        let wall = patch([-1.0, 0.0, -2.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], 0.5, 1.0);
        let patches = [floor(1.0), wall];
        let eye = Eye::look_at(dvec3(0.0, 1.5, 2.0), dvec3(0.0, 0.3, -1.3), 0.9, 10.0, 120, 96);
        let mut scene = scene_of(&patches);
        let count = scene.materials.len();
        for (material, name) in scene.materials[count - 2..].iter_mut().zip(["floor", "wall"]) {
            material.name = name.into();
        }
        let lamp = scene.lights.len() as u32;
        let kind = LightKind::Directional;
        scene.lights.push(Light { name: String::new(), kind, color: Vec3::ONE, intensity: 0.01 });
        let down = Transform::Matrix(glam::Mat4::from_rotation_x(-1.2));
        scene.nodes.push(Node { light: Some(lamp), local: down, ..Node::default() });
        let light = |mask: &str, base: Settings| {
            let settings = PictureSettings { isr: Settings { mask: mask.into(), ..base }, ..Default::default() };
            let (frame, token) = scene_kit::frame(gpu, &scene, |graph, handles| {
                let view = isr_lab::view(&eye);
                let out = picture(graph, handles, &view, Irradiance::default(), &settings).unwrap().outputs;
                [out.indirect, out.direct].map(|image| graph.read_image(image))
            });
            let [found, direct] = token.map(|token| -> Vec<f64> {
                frame.image(token).to_f32().iter().map(|texel| f64::from(texel[0])).collect()
            });
            (on_the_floor(&found, &eye, &patches, |_| 0.0).0, direct)
        };
        for base in [Settings::default(), Settings { cameras: 1, ..Settings::default() }, Settings::paper()] {
            let (whole, direct) = light("", base.clone());
            assert!(whole > 0.0 && direct.iter().any(|light| *light > 0.0));
            for (mask, share) in [
                ("floor=0.4", 0.4),
                ("wall=0.4", 0.4),
                ("floor=0.4,wall=0.2", 0.08),
                ("wall=0", 0.0),
                ("floor=0", 0.0),
                ("wall=1", 1.0),
            ] {
                let (found, same) = light(mask, base.clone());
                let found = found / whole;
                println!("{mask}: {found:.3} of the light without masks");
                assert!(same == direct, "{mask}: direct light differs");
                // The sun on the floor alone makes some thousandths, and the filter brings some of the wall.
                assert!((found - share).abs() < 0.02 * share + 8e-3, "{mask}: {found}, expected {share}");
            }
        }
        let settings =
            PictureSettings { isr: Settings { mask: "roof=1".into(), ..Settings::default() }, ..Default::default() };
        scene_kit::frame(gpu, &scene, |graph, handles| {
            let made = picture(graph, handles, &isr_lab::view(&eye), Irradiance::default(), &settings);
            assert!(made.unwrap_err().to_string().contains("has no material 'roof'"));
        });
    });
}

/// Floor before the camera, and behind the camera a glowing wall that reflects.
fn wall_behind_the_viewer(albedo: f64) -> (Eye, [Patch; 2]) {
    let wall = patch([1.0, 1.0, 1.5], [-2.0, 0.0, 0.0], [0.0, 1.0, 0.0], albedo, 1.0);
    (Eye::look_at(dvec3(0.0, 1.0, 0.5), dvec3(0.0, 0.0, -0.587), 1.4, 10.0, 120, 96), [floor(albedo), wall])
}

#[test]
fn a_wall_behind_the_viewer_lights_the_floor_as_the_closed_form_says_for_any_number_of_cameras() {
    with_gpu(|gpu| {
        let (eye, patches) = wall_behind_the_viewer(1.0);
        let exact = |p| patches[1].reflected_by_white(p, DVec3::Y).x;
        for cameras in 0..=4 {
            let settings = Settings { cameras, sender_samples: 96, sender_scale: 1, ..Settings::default() };
            let (found, exact) = on_the_floor(&indirect(gpu, &patches, &eye, settings), &eye, &patches, exact);
            println!("{cameras} cameras: {:.3} of the closed form", found / exact);
            let share = if cameras == 0 { 0.0 } else { 1.0 };
            assert!((found / exact - share).abs() < 0.1 * share + 1e-6, "{cameras} cameras: {found} of {exact}");
        }
    });
}

/// Cells of a patch, n by n, that reflect what `arrives` at a white one in their middle.
fn reflecting(patch: &Patch, n: usize, arrives: impl Fn(DVec3) -> f64) -> Vec<Patch> {
    let (a, b) = (patch.a / n as f64, patch.b / n as f64);
    let cell = |i: usize| {
        let corner = patch.corner + a * (i % n) as f64 + b * (i / n) as f64;
        Patch { corner, a, b, radiance: patch.albedo * arrives(corner + 0.5 * (a + b)), ..*patch }
    };
    (0..n * n).map(cell).collect()
}

fn arriving(from: &[Patch], p: DVec3, normal: DVec3) -> f64 {
    from.iter().map(|cell| cell.reflected_by_white(p, normal).x).sum()
}

/// Checks what the floor gets of its own light by a wall that it lights: the second bounce, as the first finds no sender.
#[track_caller]
fn check_second_bounce(gpu: &Gpu, name: &str, eye: &Eye, wall: &Patch, settings: &Settings) {
    let floor = Patch { radiance: DVec3::ONE, ..floor(0.8) };
    let wall = Patch { radiance: DVec3::ZERO, ..*wall };
    let patches = [floor, wall];
    let seen = Buffers::cast(eye, &patches, 1);
    let shown = |i: usize| seen.position(eye, i % eye.width, i / eye.width).y > 1e-6;
    assert!((0..seen.depth.len()).all(|i| seen.depth[i] >= 1.0 || !shown(i)), "{name}: the frame shows the wall");
    let lit_wall = reflecting(&wall, 16, |p| floor.reflected_by_white(p, wall.normal()).x);
    let exact = |p| floor.albedo.x * arriving(&lit_wall, p, DVec3::Y);
    let of = |bounces| {
        let settings = Settings { bounces, ..settings.clone() };
        on_the_floor(&indirect(gpu, &patches, eye, settings), eye, &patches, exact)
    };
    let ((once, _), (twice, exact)) = (of(1), of(2));
    println!("{name}: first bounce {once:.6}, second {:.3} of the closed form, {exact:.6}", (twice - once) / exact);
    // Of what it sends: normals and depth of the views are rounded.
    assert!(once < 0.002, "{name}: a flat floor lights itself: {once}");
    assert!(((twice - once) / exact - 1.0).abs() < 0.1, "{name}: {twice} - {once} of {exact}");
}

#[test]
fn light_that_returns_by_a_wall_out_of_the_picture_counts_in_the_second_bounce() {
    with_gpu(|gpu| {
        let settings = Settings { sender_samples: 96, sender_scale: 1, ..Settings::default() };
        let wall = patch([-1.0, 0.0, -2.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], 0.9, 0.0);
        // From above: the frame ends before the wall.
        let eye = Eye::look_at(dvec3(0.0, 3.4, 0.0), dvec3(0.0, 0.0, -0.95), 0.46, 10.0, 120, 96);
        check_second_bounce(gpu, "border", &eye, &wall, &Settings { border: 1.0, ..settings.clone() });
        // The floor fills this frame, and the wall is behind the viewer.
        let (eye, patches) = wall_behind_the_viewer(0.9);
        for cameras in [1, 3] {
            let settings = Settings { cameras, ..settings.clone() };
            check_second_bounce(gpu, &format!("{cameras} cameras"), &eye, &patches[1], &settings);
        }
    });
}

#[test]
fn coarse_views_of_cameras_err_both_ways_by_the_size_of_their_texels() {
    with_gpu(|gpu| {
        let (eye, patches) = wall_behind_the_viewer(1.0);
        let exact = |p| patches[1].reflected_by_white(p, DVec3::Y).x;
        for cameras in [1, 3] {
            let shares = [1, 2, 3, 4, 6, 8].map(|sender_scale| {
                let settings = Settings { cameras, sender_samples: 24, sender_scale, ..Settings::default() };
                let (found, exact) = on_the_floor(&indirect(gpu, &patches, &eye, settings), &eye, &patches, exact);
                found / exact
            });
            println!("{cameras} cameras, scales 1 to 8: {shares:.3?} of the closed form");
            // The wall is 10 to 80 texels wide: a texel more or less on each side.
            assert!(shares.iter().all(|share| (share - 1.0).abs() < 0.12), "{shares:?}");
            let mean = shares.iter().sum::<f64>() / shares.len() as f64;
            assert!((mean - 1.0).abs() < 0.04, "{shares:?}: not by chance");
        }
    });
}
