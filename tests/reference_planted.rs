//! The comparison of the two path tracers notices errors that are planted into the device's pictures.

use crate::reference_kit::{Task, corner, disagreements_after, eye, panel, point};
use glam::Vec3;
use lucerna::{gpu::testing::with_gpu, image::Layers, scene::Material};
use std::f32::consts::PI;

/// Multiplies a layer and changes the sum of all by as much.
fn scale(layers: &mut Layers, name: &str, factor: impl Fn(usize, &Layers) -> f32) {
    let factors: Vec<f32> = (0..layers.layer("depth").unwrap().data.len()).map(|i| factor(i, layers)).collect();
    let mut added = Vec::new();
    let data = |layers: &mut Layers, name: &str, work: &mut dyn FnMut(usize, &mut f32)| {
        let layer = layers.layers.iter_mut().find(|l| l.name == name).unwrap();
        layer.data.iter_mut().enumerate().for_each(|(i, v)| work(i, v));
    };
    data(layers, name, &mut |i, v| {
        added.push(*v * (factors[i / 3] - 1.0));
        *v *= factors[i / 3];
    });
    data(layers, "", &mut |i, v| *v += added[i]);
}

/// Where the lamp of [`point`] stands.
const LAMP: Vec3 = Vec3::new(0.5, 1.6, 0.4);

fn cosine(pixel: usize, layers: &Layers) -> f32 {
    let at = |name: &str| Vec3::from_slice(&layers.layer(name).unwrap().data[3 * pixel..]);
    at("normal").dot((LAMP - at("position")).normalize()).max(0.05)
}

#[test]
fn planted_errors_are_found() {
    let mut lit = corner(Material::diffuse("floor", Vec3::new(0.6, 0.65, 0.5)));
    point(&mut lit);
    let mut lamp = corner(Material::diffuse("floor", Vec3::new(0.6, 0.65, 0.5)));
    panel(&mut lamp, Vec3::new(5.0, 4.0, 3.0));
    let short = Task { bounces: 1, sample_lamps: true, samples: [600, 32], ..Task::default() };
    let sharp = Task { jitter: false, ..short };
    type Plant<'a> = &'a dyn Fn(&mut Layers);
    let plants: [(&str, Plant<'_>); 6] = [
        ("nothing", &|_| {}),
        ("π forgotten", &|l| scale(l, "direct", |_, _| PI)),
        ("cosine forgotten", &|l| scale(l, "direct", |i, l| 1.0 / cosine(i, l))),
        ("cosine twice", &|l| scale(l, "direct", cosine)),
        ("2 % more direct light", &|l| scale(l, "direct", |_, _| 1.02)),
        ("5 % less indirect light", &|l| scale(l, "indirect", |_, _| 0.95)),
    ];
    with_gpu(|gpu| {
        for (scene, task) in [(&lit.scene, Task { samples: [2500, 96], ..sharp }), (&lamp.scene, short)] {
            let all: Vec<_> = plants.iter().map(|(_, plant)| *plant).collect();
            // With few samples the last one is lost in the noise.
            let all = if task.samples[0] < 2000 { &all[..5] } else { &all };
            for ((name, _), wrong) in plants.iter().zip(disagreements_after(gpu, scene, &eye(), &task, all)) {
                println!("{name}: {} disagreements, {:?}", wrong.len(), wrong.first());
                assert_eq!(wrong.is_empty(), *name == "nothing", "{name}: {wrong:?}");
            }
        }
    });
}
