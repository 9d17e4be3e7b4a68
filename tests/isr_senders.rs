//! Senders beside the frame's, and numbers of samples that follow the depth.

use crate::isr_lab;
use crate::isr_lab::{gbuffer, lights, read, view};
use crate::scene_kit::{mesh, square};
use glam::{DQuat, DVec3, Mat4, Quat, Vec3, dvec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    passes::gbuffer as layers,
    reference::isr_scene::{Buffers, Eye, Patch},
    resident::Resident,
    scene::{Camera, Material, Pose, Projection, Scene, View},
    techniques::isr::{
        Blur, Inputs, Pattern, Resolution, Settings, frame,
        senders::{SenderView, Senders},
    },
};

/// A floor that reflects everything, and behind it a wall that glows. The camera looks down: the frame shows no wall.
fn floor_and_wall(width: usize, height: usize, yfov: f64) -> (Eye, Vec<Patch>) {
    let eye = Eye::look_at(dvec3(0.0, 2.2, 0.6), dvec3(0.0, 0.0, -0.55), yfov, 10.0, width, height);
    (eye, isr_lab::floor_and_wall(1.0))
}

/// Twice as wide by its tangents.
fn wider(yfov: f64, factor: f64) -> f64 {
    2.0 * ((0.5 * yfov).tan() * factor).atan()
}

/// Indirect light of a frame with these additional views.
fn indirect(
    gpu: &Gpu,
    frame_eye: (&Eye, &Buffers),
    others: &[(&Eye, &Buffers, f32)],
    settings: &Settings,
) -> Vec<[f32; 4]> {
    let mut graph = Graph::new("senders");
    let own = gbuffer(&mut graph, frame_eye.0, frame_eye.1);
    let views: Vec<_> = others
        .iter()
        .map(|(eye, buffers, hole)| {
            let gbuffer = gbuffer(&mut graph, eye, buffers);
            SenderView { gbuffer, color: gbuffer.emission, uniform: view(eye).uniform(), hole: *hole }
        })
        .collect();
    let senders = Senders::pack(&mut graph, &views, None);
    let lights = lights(&mut graph, &[]);
    let inputs = Inputs { gbuffer: own, lights, surroundings: Default::default(), senders };
    let out = frame(&mut graph, &inputs, settings).unwrap();
    let [indirect] = read(gpu, graph, [out.indirect]);
    indirect
}

/// Mean of found over exact red light on the floor, away from its borders.
fn share_of_exact(found: &[[f32; 4]], eye: &Eye, buffers: &Buffers, wall: &Patch) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (i, texel) in found.iter().enumerate() {
        let p = buffers.position(eye, i % eye.width, i / eye.width);
        if buffers.depth[i] < 1.0 && p.y.abs() < 1e-6 && p.x.abs() < 0.8 && p.z > -1.7 {
            sum += f64::from(texel[0]) / wall.reflected_by_white(p, DVec3::Y).x;
            count += 1.0;
        }
    }
    assert!(count > 1000.0, "{count}");
    sum / count
}

#[test]
fn a_wall_beyond_the_picture_lights_the_floor_as_the_closed_form_says() {
    with_gpu(|gpu| {
        let yfov = 0.55;
        let (eye, patches) = floor_and_wall(120, 96, yfov);
        let own = Buffers::cast(&eye, &patches, 1);
        assert!((0..own.depth.len()).all(|i| own.sender[i] == DVec3::ZERO), "the frame shows the wall");
        let settings = Settings { blur_radius: 4, visibility_steps: 0, ..Settings::default() };
        let alone = indirect(gpu, (&eye, &own), &[], &settings);
        assert!(alone.iter().all(|t| t[..3] == [0.0; 3]), "nothing in the frame sends");

        let factor = 4.0;
        let (wide, _) = floor_and_wall(100, 80, wider(yfov, factor));
        let around = Buffers::cast(&wide, &patches, 1);
        // Half width of the frame in the wider picture, a little less.
        let hole = (0.96 / factor) as f32;
        let settings = Settings { sender_samples: 96, ..settings };
        let once =
            share_of_exact(&indirect(gpu, (&eye, &own), &[(&wide, &around, hole)], &settings), &eye, &own, &patches[1]);
        println!("border: {once:.3} of the closed form");
        assert!((once - 1.0).abs() < 0.1, "{once}");
        // The same view again: shared, not doubled. And one from elsewhere.
        let mut aside = Eye::look_at(dvec3(0.4, 1.0, 1.2), dvec3(0.0, 0.4, -2.0), 1.3, 10.0, 100, 80);
        aside.far = 12.0;
        let from_aside = Buffers::cast(&aside, &patches, 1);
        let views = [(&wide, &around, hole), (&wide, &around, hole), (&aside, &from_aside, 0.0)];
        let shared = share_of_exact(&indirect(gpu, (&eye, &own), &views, &settings), &eye, &own, &patches[1]);
        println!("three views: {shared:.3} of the closed form");
        assert!((shared - 1.0).abs() < 0.1, "{shared}");

        // A hole of half the picture, in which there is no wall: samples are the fewer texels each, and send as much together.
        let factor = 2.85;
        let (narrow, _) = floor_and_wall(120, 96, wider(yfov, factor));
        let around = Buffers::cast(&narrow, &patches, 1);
        let hole = 0.48;
        let own_wall = |i: usize| around.sender[i] != DVec3::ZERO;
        let inside = |i: usize| {
            let (u, v) = around.uv(&narrow, i % 120, i / 120);
            (2.0 * u - 1.0).abs().max((2.0 * v - 1.0).abs()) < f64::from(hole)
        };
        assert!((0..around.depth.len()).all(|i| !(own_wall(i) && inside(i))), "a part of the wall lies in the hole");
        let views = [(&narrow, &around, hole)];
        let once = share_of_exact(&indirect(gpu, (&eye, &own), &views, &settings), &eye, &own, &patches[1]);
        println!("border with a hole of half its width: {once:.3} of the closed form");
        assert!((once - 1.0).abs() < 0.1, "{once}");
    });
}

#[test]
fn what_the_frame_shows_is_not_counted_again() {
    with_gpu(|gpu| {
        let (_, patches) = floor_and_wall(8, 8, 1.0);
        let eye = Eye::look_at(dvec3(0.3, 1.8, 2.2), dvec3(0.0, 0.3, -1.3), 0.9, 10.0, 120, 96);
        let own = Buffers::cast(&eye, &patches, 1);
        let settings = Settings { blur_radius: 4, visibility_steps: 0, ..Settings::default() };
        let alone = share_of_exact(&indirect(gpu, (&eye, &own), &[], &settings), &eye, &own, &patches[1]);
        let aside = Eye::look_at(dvec3(-0.4, 1.0, 1.2), dvec3(0.0, 0.4, -2.0), 1.2, 10.0, 100, 80);
        let from_aside = Buffers::cast(&aside, &patches, 1);
        let views = [(&aside, &from_aside, 0.0)];
        let both = share_of_exact(&indirect(gpu, (&eye, &own), &views, &settings), &eye, &own, &patches[1]);
        println!("frame alone {alone:.3}, with another view {both:.3}");
        assert!((both - alone).abs() < 0.03, "{alone} {both}");
        // Normals of one surface in two pictures differ where it is curved or bumpy.
        let mut bent = from_aside;
        for i in (0..bent.depth.len()).filter(|i| bent.sender[*i] != DVec3::ZERO) {
            bent.normal[i] = DQuat::from_rotation_x(0.7) * bent.normal[i];
        }
        let views = [(&aside, &bent, 0.0)];
        let both = share_of_exact(&indirect(gpu, (&eye, &own), &views, &settings), &eye, &own, &patches[1]);
        println!("with a view in which the normals differ by 40° {both:.3}");
        assert!((both - alone).abs() < 0.03, "{alone} {both}");
    });
}

/// Mean share of the closed form of `wall` on those pixels of the floor that `counts` takes.
fn share_where(found: &[[f32; 4]], eye: &Eye, buffers: &Buffers, wall: &Patch, counts: impl Fn(DVec3) -> bool) -> f64 {
    let (mut sum, mut exact) = (0.0, 0.0);
    for (i, texel) in found.iter().enumerate() {
        let p = buffers.position(eye, i % eye.width, i / eye.width);
        if buffers.depth[i] < 1.0 && p.y.abs() < 1e-6 && counts(p) {
            sum += f64::from(texel[0]);
            exact += wall.reflected_by_white(p, DVec3::Y).x;
        }
    }
    assert!(exact > 5.0, "{exact}");
    sum / exact
}

/// A patch that neither reflects nor glows.
fn screen(corner: DVec3, a: DVec3, b: DVec3) -> Patch {
    Patch { corner, a, b, albedo: DVec3::ZERO, radiance: DVec3::ZERO }
}

#[test]
fn a_surface_close_behind_another_or_across_it_is_not_the_one_that_the_frame_shows() {
    with_gpu(|gpu| {
        let settings = Settings { blur_radius: 4, visibility_steps: 0, sender_samples: 96, ..Settings::default() };
        // The wall stands 0.2 m behind a screen, at 4 m.
        let patches = isr_lab::floor_and_wall(1.0);
        let (floor, wall) = (patches[0], patches[1]);
        let eye = Eye::look_at(dvec3(0.0, 1.5, 2.0), dvec3(0.0, 0.3, -1.3), 0.9, 10.0, 120, 96);
        let before = screen(dvec3(-1.5, 0.0, -1.8), 3.0 * DVec3::X, 1.3 * DVec3::Y);
        let (own, layer) = (Buffers::cast(&eye, &[floor, before], 1), Buffers::cast(&eye, &[floor, wall], 1));
        let found = indirect(gpu, (&eye, &own), &[(&eye, &layer, 0.0)], &settings);
        let counts = |p: DVec3| p.x.abs() < 0.8 && (-1.6..-0.2).contains(&p.z);
        let parallel = share_where(&found, &eye, &own, &wall, counts);

        // A wall that the frame would see nearly from its edge, behind a screen that faces the camera.
        let eye = Eye::look_at(dvec3(0.0, 1.0, 2.0), dvec3(0.4, 0.2, -1.0), 1.0, 10.0, 120, 96);
        let white = Patch { corner: dvec3(-0.2, 0.0, 1.0), a: 2.0 * DVec3::X, b: -2.4 * DVec3::Z, ..floor };
        let wall = Patch { corner: dvec3(-0.2, 0.0, -3.0), a: DVec3::Y, b: 1.2 * DVec3::Z, ..wall };
        let before = screen(dvec3(-1.0, 0.0, -1.5), 3.0 * DVec3::X, 1.3 * DVec3::Y);
        let own = Buffers::cast(&eye, &[white, before], 1);
        assert!(own.sender.iter().all(|sent| *sent == DVec3::ZERO), "the frame shows the wall");
        let aside = Eye::look_at(dvec3(2.5, 0.8, -1.2), dvec3(-0.2, 0.4, -2.4), 0.9, 10.0, 100, 80);
        let from_aside = Buffers::cast(&aside, &[white, wall], 1);
        let found = indirect(gpu, (&eye, &own), &[(&aside, &from_aside, 0.0)], &settings);
        let counts = |p: DVec3| (0.1..1.4).contains(&p.x) && (-1.2..0.6).contains(&p.z);
        let across = share_where(&found, &eye, &own, &wall, counts);
        println!("behind {parallel:.3}, across {across:.3} of the closed form");
        assert!((parallel - 1.0).abs() < 0.1 && (across - 1.0).abs() < 0.1, "{parallel} {across}");
    });
}

#[test]
fn a_screen_before_a_wall_takes_its_light_and_the_floor_itself_takes_nothing() {
    with_gpu(|gpu| {
        let settings = Settings { blur_radius: 4, sender_samples: 96, thickness: 0.5, ..Settings::default() };
        let eye = Eye::look_at(dvec3(0.0, 1.5, 2.0), dvec3(0.0, 0.3, -1.3), 0.9, 10.0, 120, 96);
        let patches = isr_lab::floor_and_wall(1.0);
        let (floor, wall) = (patches[0], patches[1]);
        // A tenth nearer to the camera than the wall, and higher than it.
        let before = screen(dvec3(-1.5, 0.0, -1.6), 3.0 * DVec3::X, 1.3 * DVec3::Y);
        let layer = Buffers::cast(&eye, &patches, 1);
        let share = |shown: &[Patch], visibility_steps: u32| {
            let own = Buffers::cast(&eye, shown, 1);
            let settings = Settings { visibility_steps, ..settings.clone() };
            let found = indirect(gpu, (&eye, &own), &[(&eye, &layer, 0.0)], &settings);
            let counts = |p: DVec3| p.x.abs() < 0.8 && (-1.4..-0.2).contains(&p.z);
            share_where(&found, &eye, &own, &wall, counts)
        };
        let (all, open, hidden) = (share(&[floor], 0), share(&[floor], 16), share(&[floor, before], 16));
        println!("{all:.3} of the closed form, {open:.3} by visibility, {hidden:.4} behind a screen");
        assert!((all - 1.0).abs() < 0.15 && (open / all - 1.0).abs() < 0.05, "{all}, {open} by visibility");
        assert!(hidden < 0.02, "{hidden} behind a screen");
    });
}

/// The light that the buffers send, as the mean over two by two texels, weighted by the mask, linear between the means.
fn coarsened(buffers: &Buffers) -> Buffers {
    let (width, height) = (buffers.width / 2, buffers.height / 2);
    let mean = |x: usize, y: usize| {
        let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| (2 * y + j) * buffers.width + 2 * x + i);
        let sum = |f: &dyn Fn(usize) -> DVec3| four.iter().map(|&i| f(i)).sum::<DVec3>();
        (sum(&|i| buffers.sender[i] * buffers.mask[i]), sum(&|i| DVec3::splat(buffers.mask[i])).x)
    };
    let mut blurred = buffers.clone();
    for (i, sent) in blurred.sender.iter_mut().enumerate() {
        let (x, y) = (i % buffers.width, i / buffers.width);
        let pair = |at: usize, end: usize| {
            let next = if at.is_multiple_of(2) { (at / 2).saturating_sub(1) } else { (at / 2 + 1).min(end - 1) };
            [(at / 2, 0.75), (next, 0.25)]
        };
        let (mut sum, mut masks) = (DVec3::ZERO, 0.0);
        for (u, a) in pair(x, width) {
            for (v, b) in pair(y, height) {
                let (light, mask) = mean(u, v);
                sum += a * b * light;
                masks += a * b * mask;
            }
        }
        *sent = if masks > 0.0 { sum / masks } else { DVec3::ZERO };
    }
    blurred
}

/// A frame at full resolution without blur: the light that each of its texels gathers.
fn gathered(gpu: &Gpu, eye: &Eye, own: &Buffers, other: Option<(&Eye, &Buffers)>, settings: &Settings) -> Vec<f64> {
    let mut graph = Graph::new("gathered");
    let gbuffer = gbuffer(&mut graph, eye, own);
    let views: Vec<_> = other
        .iter()
        .map(|(eye, buffers)| {
            let gbuffer = isr_lab::gbuffer(&mut graph, eye, buffers);
            SenderView { gbuffer, color: gbuffer.emission, uniform: view(eye).uniform(), hole: 0.0 }
        })
        .collect();
    let senders = Senders::pack(&mut graph, &views, None);
    let inputs = Inputs { gbuffer, lights: lights(&mut graph, &[]), surroundings: Default::default(), senders };
    let settings = Settings {
        resolution: Resolution::Full,
        blur: Blur::None,
        visibility_steps: 0,
        occlusion: false,
        ..settings.clone()
    };
    let out = frame(&mut graph, &inputs, &settings).unwrap();
    let [gathered] = read(gpu, graph, [out.gathered]);
    gathered.iter().map(|texel| f64::from(texel[0])).collect()
}

/// A cloud of small surfaces that face in random directions.
fn cloud(width: usize, height: usize, seed: u64, radiance: impl Fn(&mut isr_lab::Random) -> f64) -> Buffers {
    let mut random = isr_lab::Random(seed);
    let mut buffers = Buffers { width, height, factor: 1.0, ..Buffers::default() };
    for _ in 0..width * height {
        buffers.depth.push(0.2 + 0.03 * random.next());
        buffers.normal.push((random.vector() + 0.5 * DVec3::Z).normalize());
        buffers.albedo.push(DVec3::ONE);
        buffers.mask.push(1.0);
        buffers.sender.push(DVec3::splat(radiance(&mut random)));
    }
    buffers
}

#[test]
fn with_the_prefilter_a_sample_sends_the_mean_over_a_quarter_of_its_cells_side() {
    with_gpu(|gpu| {
        // 64 texels a sample: the mean is over two by two.
        let eye = Eye::look_at(DVec3::ZERO, -DVec3::Z, 0.9, 10.0, 64, 48);
        let own = cloud(64, 48, 3, |_| 0.0);
        let mut sending = cloud(64, 48, 4, |random| random.next());
        for (i, mask) in sending.mask.iter_mut().enumerate() {
            *mask = [1.0, 0.25, 0.5, 1.0, 0.75][(i / 3) % 5];
        }
        let near = Settings { pattern: Pattern::Grid, jitter: false, samples: 24, reach: 16.0, ..Settings::default() };
        let settings = |prefilter| Settings { prefilter, sender_samples: 48, ..near.clone() };
        for by_view in [false, true] {
            let light = |from: &Buffers, prefilter: bool| {
                let settings = settings(prefilter);
                match by_view {
                    false => gathered(gpu, &eye, from, None, &settings),
                    true => gathered(gpu, &eye, &own, Some((&eye, from)), &settings),
                }
            };
            let (plain, found) = (light(&sending, false), light(&sending, true));
            let expected = light(&coarsened(&sending), false);
            let apart = |a: &[f64]| {
                let squares = a.iter().zip(&expected).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
                (squares / expected.iter().map(|b| b * b).sum::<f64>()).sqrt()
            };
            println!("by view: {by_view}; {:.4} off, {:.4} without the filter", apart(&found), apart(&plain));
            assert!(apart(&plain) > 0.05 && apart(&found) < 0.005, "{by_view}: {}", apart(&found));
        }
    });
}

#[test]
fn estimates_of_what_a_view_sends_sum_to_two_at_most() {
    with_gpu(|gpu| {
        let eye = Eye::look_at(DVec3::ZERO, -DVec3::Z, 0.9, 10.0, 96, 72);
        let (own, sending) = (cloud(96, 72, 5, |_| 0.0), cloud(96, 72, 6, |_| 1.0));
        let settings = Settings { sender_samples: 24, prefilter: false, ..Settings::default() };
        let sums = gathered(gpu, &eye, &own, Some((&eye, &sending)), &settings);
        let [between, most] =
            [1.05..1.95, 1.995..2.005].map(|range| sums.iter().filter(|s| range.contains(*s)).count());
        println!("{between} of {} between one and two, {most} at two", sums.len());
        assert!(between * 20 > sums.len() && most * 100 > sums.len(), "{between} and {most} of {}", sums.len());
        assert!(sums.iter().all(|sum| *sum < 2.005), "{}", sums.iter().fold(0.0, |a: f64, b| a.max(*b)));
    });
}

#[test]
fn samples_follow_the_depth() {
    with_gpu(|gpu| {
        // Columns at three depths; the mean of the picture is 0.35 of far, by powers of two exactly.
        let (width, height) = (64, 32);
        let eye = Eye::look_at(DVec3::ZERO, -DVec3::Z, 0.9, 10.0, width, height);
        let mut random = isr_lab::Random(9);
        let mut buffers = Buffers { width, height, factor: 1.0, ..Buffers::default() };
        for i in 0..width * height {
            buffers.depth.push([0.1, 0.3, 0.9][(i % width / 8) % 4 % 3]);
            buffers.normal.push((DVec3::Z + random.vector() * 0.5).normalize());
            buffers.albedo.push(DVec3::ONE);
            buffers.mask.push(1.0);
            buffers.sender.push(DVec3::splat(random.next()));
        }
        let gathered = |settings: Settings| {
            let mut graph = Graph::new("by depth");
            let gbuffer = gbuffer(&mut graph, &eye, &buffers);
            let lights = lights(&mut graph, &[]);
            let inputs = Inputs { gbuffer, lights, surroundings: Default::default(), senders: None };
            let settings = Settings { resolution: Resolution::Full, blur: Blur::None, ..settings };
            let out = frame(&mut graph, &inputs, &settings).unwrap();
            let [gathered] = read(gpu, graph, [out.gathered]);
            gathered
        };
        let mean = buffers.depth.iter().sum::<f64>() / buffers.depth.len() as f64;
        let plain = [24, 48, 80].map(|samples| gathered(Settings { samples, ..Settings::default() }));
        assert_ne!(plain[0], plain[1]);
        for (base, samples) in [24, 48, 80].into_iter().enumerate() {
            let found = gathered(Settings { samples, samples_by_depth: true, ..Settings::default() });
            let mut classes = [0; 3];
            for (i, texel) in found.iter().enumerate() {
                let relative = buffers.depth[i] / mean;
                let class = match relative {
                    r if r < 0.5 => (base + 1).min(2),
                    r if r > 1.5 => base.saturating_sub(1),
                    _ => base,
                };
                classes[class] += 1;
                assert_eq!(*texel, plain[class][i], "texel {i} at {relative} of the mean depth, {samples} samples");
            }
            assert!(classes.iter().filter(|count| **count > 0).count() >= 2, "{classes:?}");
        }
    });
}

/// Squares of side 2 at 2, 4 and 6 m before the camera; the middle one is turned away.
fn three_squares() -> Scene {
    let mut scene = Scene::default();
    let mesh = mesh(&mut scene, square(), Material::default());
    for (z, towards) in [(-2.0, 1.0), (-4.0, -1.0), (-6.0, 1.0f32)] {
        let turn = Quat::from_rotation_x(towards * 0.5 * std::f32::consts::PI);
        let local = lucerna::scene::Transform::Trs { translation: vec3(0.0, 0.0, z), rotation: turn, scale: Vec3::ONE };
        scene.nodes.push(lucerna::scene::Node { mesh: Some(mesh), local, ..Default::default() });
    }
    scene
}

#[test]
fn layers_are_peeled_in_order_and_backs_keep_the_normal_of_their_front() {
    with_gpu(|gpu| {
        let scene = three_squares();
        let mut resident = Resident::new(gpu, &scene).unwrap();
        let mut graph = Graph::new("peel");
        let handles = resident.frame_in(&mut graph, &scene, &Pose::rest(&scene));
        let projection = Projection::Perspective { yfov: 0.2, aspect: None, znear: 0.1, zfar: Some(16.0) };
        let view = View::new(&Camera { name: String::new(), projection }, Mat4::IDENTITY, [24, 18]);
        let settings = layers::Settings { normals: layers::Normals::Bytes, ..Default::default() };
        let mut images = Vec::new();
        let mut layer = layers::draw(&mut graph, &handles, &view, &settings);
        for _ in 0..3 {
            images.push([graph.read_image(layer.depth), graph.read_image(layer.normal)]);
            layer = layers::draw_behind(&mut graph, &handles, &view, &settings, layer.depth);
        }
        images.push([graph.read_image(layer.depth), graph.read_image(layer.normal)]);
        let frame = Runner::new(gpu).run(&graph).unwrap();
        // Of the second one only the back is to be seen: the frame leaves it out, the layers have it.
        for ((layer, [depth, normal]), (z, n)) in
            images.into_iter().enumerate().zip([(2.0, 1.0), (4.0, -1.0), (6.0, 1.0), (16.0, 0.0)])
        {
            let (depth, normal) = (frame.image(depth).to_f32(), frame.image(normal).to_f32());
            for (d, n_found) in depth.iter().zip(&normal) {
                assert!((d[0] * 16.0 - z).abs() < 1e-4, "layer {layer}: depth {} instead of {z}", d[0] * 16.0);
                assert!((n_found[2] * 2.0 - 1.0 - n).abs() < 0.01, "layer {layer}: normal {n_found:?}");
            }
        }
    });
}
