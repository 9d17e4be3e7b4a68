//! Baked daylight against the path tracer: the light of the sun at several times and of the sky, by the same shared paths.

use crate::{
    daylight_lab::lights,
    tracer_lab::{Stage, render, view},
};
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    scene::{Environment, LightKind, Material, Scene, View},
    techniques::daylight::{Baking, Calendar, Kind, Lit, Plan, Sky, Sources, Transport, Weather, parts, units},
    tracer::{Filter, Settings},
};

/// A white floor between a red and a blue wall, with a hanging board that shades a part.
pub fn stage() -> Scene {
    let mut stage = Stage::new();
    let white = stage.material(Material::diffuse("white", vec3(0.8, 0.8, 0.8)));
    let red = stage.material(Material::diffuse("red", vec3(0.8, 0.2, 0.1)));
    let blue = stage.material(Material::diffuse("blue", vec3(0.1, 0.2, 0.7)));
    stage.quad(white, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    stage.quad(red, vec3(-2.0, 0.0, 2.0), Vec3::Z * -4.0, Vec3::Y * 2.0);
    stage.quad(blue, vec3(2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::Y * 2.0);
    stage.quad(white, vec3(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 2.0);
    stage.cuboid(white, vec3(-0.6, 1.0, -0.6), vec3(0.6, 1.1, 0.6), false);
    stage.scene
}

pub fn eye() -> View {
    view(vec3(0.0, 2.2, 4.5), vec3(0.0, 0.7, 0.0), 45.0, [40, 30])
}

fn suns() -> Vec<Vec3> {
    vec![vec3(0.9, 0.5, 0.3), vec3(0.1, 1.0, 0.2), vec3(-0.8, 0.2, 0.5)].into_iter().map(Vec3::normalize).collect()
}

pub fn plan(scene: &Scene, view: &View, settings: Baking) -> Plan {
    let times = suns().into_iter().enumerate().map(|(i, sun)| Lit { seconds: 3600.0 * i as f64, sun: sun.to_array() });
    Plan {
        scene: "stage".into(),
        parts: parts(scene),
        receivers: Kind::View {
            camera: "eye".into(),
            view_from_world: view.view_from_world.to_cols_array(),
            clip_from_view: view.clip_from_view.to_cols_array(),
        },
        extent: view.extent,
        probes: None,
        lamps: Vec::new(),
        calendar: Calendar {
            date: "2026-06-21".into(),
            zone: "UTC".into(),
            latitude: 0.0,
            longitude: 0.0,
            ..Calendar::default()
        },
        steps: 3,
        times: times.collect(),
        weather: Weather::default(),
        settings,
    }
}

pub fn baking() -> Baking {
    Baking { samples: 256, bounces: 16, roulette: 16, disc: false, diffuse_only: true, ..Baking::default() }
}

/// The picture's mean of the light of a direct sun or of an environment, by the path tracer, each pixel at its centre: radiance without the
/// first scattering of the sun.
fn truth(gpu: &Gpu, mut scene: Scene, view: &View, sun: Option<Vec3>) -> ([f64; 3], Vec<f32>, Vec<f32>) {
    match sun {
        Some(sun) => {
            let rotation = glam::Quat::from_rotation_arc(Vec3::Z, sun);
            let mut stage = Stage { scene };
            stage.light(LightKind::Directional, Vec3::ONE, 1.0, Mat4::from_quat(rotation));
            scene = stage.scene;
        }
        None => scene.environment = Some(Environment::constant(Vec3::ONE)),
    }
    let settings =
        Settings { bounces: 16, roulette: 16, diffuse_only: true, filter: Filter::Centre, ..Settings::default() };
    let layers = render(gpu, &scene, view, &settings, 512);
    let of = |name: &str| layers.layer(name).unwrap().data.clone();
    let (direct, indirect, albedo) = (of("direct"), of("indirect"), of("albedo"));
    let light: Vec<f32> = match sun {
        Some(_) => indirect,
        None => direct.iter().zip(&indirect).map(|(a, b)| a + b).collect(),
    };
    let mean = std::array::from_fn(|c| {
        light.iter().skip(c).step_by(3).map(|v| f64::from(*v)).sum::<f64>() / (light.len() / 3) as f64
    });
    (mean, light, albedo)
}

#[test]
fn shared_paths_have_the_light_of_the_path_tracer_at_each_time_and_of_the_sky() {
    with_gpu(|gpu| {
        let (scene, view) = (stage(), eye());
        let plan = plan(&scene, &view, baking());
        let tiles = lights(gpu, &scene, &plan, Sources::View(Box::new(view)));
        let pixels = (plan.extent[0] * plan.extent[1]) as usize;
        for time in 0..=plan.times.len() {
            let (wanted, _, albedo) = truth(gpu, scene.clone(), &view, suns().get(time).copied());
            let mut found = [0.0; 3];
            for (index, light) in tiles.iter().enumerate() {
                for (number, [x, y]) in plan.covered(index as u32, &light.mask).enumerate() {
                    let pixel = y * plan.extent[0] + x;
                    for (channel, found) in found.iter_mut().enumerate() {
                        let line = 3 * number + channel;
                        let irradiance: f32 = match time < plan.times.len() {
                            true => light.sun[line * plan.times.len() + time],
                            false => light.sky[line * 146..(line + 1) * 146].iter().sum(),
                        };
                        let reflected = irradiance * albedo[3 * pixel as usize + channel] / std::f32::consts::PI;
                        *found += f64::from(reflected) / pixels as f64;
                    }
                }
            }
            for channel in 0..3 {
                let ratio = found[channel] / wanted[channel];
                assert!((ratio - 1.0).abs() < 0.015, "time {time}, channel {channel}: {ratio}");
            }
        }
    });
}

#[test]
fn skies_of_any_haze_are_within_the_tolerance() {
    with_gpu(|gpu| {
        let (scene, view) = (stage(), eye());
        let settings = Baking { samples: 64, filter: 0, noise_floor: false, ..baking() };
        // Half of the suns of the day are those of the guarantee.
        let suns: Vec<[f32; 3]> = (0..48)
            .map(|step| (3.0 + 174.0 * step as f32 / 47.0).to_radians())
            .map(|angle| vec3(-angle.cos(), 0.8 * angle.sin(), 0.6 * angle.sin()).to_array())
            .collect();
        let times = suns.iter().enumerate().map(|(i, sun)| Lit { seconds: 900.0 * i as f64, sun: *sun }).collect();
        let plan = Plan { times, steps: 48, ..plan(&scene, &view, settings) };
        let skies = units::skies(&plan).unwrap();
        let tiles = lights(gpu, &scene, &plan, Sources::View(Box::new(view)));
        let tiles: Vec<_> = tiles.iter().map(|light| (light, units::compress(&plan, light, &skies).unwrap())).collect();
        for turbidity in [1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0] {
            let mut worst = 0.0f64;
            for sun in &suns {
                let weather = Weather::new(turbidity, 0.3, 0.0).unwrap();
                let patches = Sky::new(weather, sun.map(f64::from)).unwrap().patches();
                for (light, tile) in &tiles {
                    let coefficients = tile.sky.mix(patches.iter().copied().enumerate());
                    let texels = light.spots.len();
                    let (mut square, mut sum) = (0.0, 0.0);
                    for texel in 0..texels {
                        let found = tile.sky.decode(texel, &coefficients);
                        for (channel, found) in found.into_iter().enumerate() {
                            let row = &light.sky[146 * (3 * texel + channel)..][..146];
                            let wanted: f32 =
                                row.iter().zip(&patches).map(|(along, patch)| along * patch[channel]).sum();
                            (square, sum) = (square + f64::from(found - wanted).powi(2), sum + f64::from(wanted));
                        }
                    }
                    let count = 3.0 * texels as f64;
                    worst = worst.max((square / count).sqrt() / (sum / count));
                }
            }
            println!("turbidity {turbidity}: worst tile {:.2} %", 100.0 * worst);
            assert!(worst < 1.05 * plan.settings.tolerance, "turbidity {turbidity}: {worst}");
        }
    });
}

#[test]
fn a_tile_has_the_same_bits_whatever_else_is_baked() {
    with_gpu(|gpu| {
        let (scene, view) = (stage(), eye());
        let plan = plan(&scene, &view, Baking { samples: 20, tile: 16, ..baking() });
        let mut transport = Transport::new(gpu, &scene, &plan, Sources::View(Box::new(view))).unwrap();
        let after_others = [0, 1, 3].map(|tile| transport.tile(&plan, tile).unwrap())[2].clone();
        let alone = Transport::new(gpu, &scene, &plan, Sources::View(Box::new(view))).unwrap().tile(&plan, 3).unwrap();
        assert!(alone == after_others);
        let skies = units::skies(&plan).unwrap();
        let tile = units::compress(&plan, &alone, &skies).unwrap();
        let decoded = units::Tile::decode(&tile.encode(), &plan, 16 * 14, None).unwrap();
        assert!(decoded == tile);
        let bytes = tile.encode();
        for length in (0..bytes.len()).step_by(97) {
            assert!(units::Tile::decode(&bytes[..length], &plan, 16 * 14, None).is_err());
        }
    });
}
