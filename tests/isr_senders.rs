//! Senders beside the frame's, and numbers of samples that follow the depth.

mod isr_lab;
mod scene_kit;

use glam::{DVec3, Mat4, Quat, Vec3, dvec3, vec3};
use isr_lab::{gbuffer, lights, read, view};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    passes::{ambient::Irradiance, gbuffer as layers},
    reference::isr_scene::{Buffers, Eye, Patch},
    scene::{Camera, Material, Pose, Projection, Scene, View, resident::Resident},
    techniques::isr::{
        Blur, Inputs, Settings, frame,
        senders::{SenderView, Senders},
    },
};
use scene_kit::{mesh, square};

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
    let inputs = Inputs { gbuffer: own, lights, ambient: Irradiance::default(), senders };
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
            let inputs = Inputs { gbuffer, lights, ambient: Irradiance::default(), senders: None };
            let settings =
                Settings { resolution: lucerna::techniques::isr::Resolution::Full, blur: Blur::None, ..settings };
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
