//! Probes of baked daylight: closed forms, the path tracer, solids and bytes.

use std::f64::consts::PI;

use crate::tracer_lab::{Stage, render, view};
use glam::{DVec3, Mat4, Quat, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    scene::{LightKind, Material, Scene, View},
    techniques::daylight::{
        Baking, Calendar, Day, Kind, Lit, Plan, Sources, Stored, Transport, Weather, finish,
        gathered::Gathered,
        lightmap::Corners,
        parts,
        probes::{Brick, DIRECTIONS, Field, Grid, Moment, harmonics, irradiance},
        units,
    },
    tracer::{Filter, Settings},
};

const PATCHES: usize = 146;

pub fn eye() -> View {
    view(vec3(0.0, 2.2, 4.5), vec3(0.0, 0.7, 0.0), 45.0, [40, 30])
}

pub fn baking() -> Baking {
    Baking {
        samples: 64,
        probe_samples: 1024,
        bounces: 16,
        roulette: 16,
        disc: false,
        diffuse_only: true,
        ..Baking::default()
    }
}

pub fn day() -> Day {
    Day::new("2026-06-21", "UTC", 0.0, 0.0).unwrap()
}

/// Two hours of a day at the equator.
pub fn plan(scene: &Scene, grid: Grid, settings: Baking) -> Plan {
    let lit = |hour: f64| {
        let seconds = 3600.0 * hour;
        Lit { seconds, sun: day().sun(seconds).direction(0.0) }
    };
    let eye = eye();
    Plan {
        scene: "stage".into(),
        parts: parts(scene),
        receivers: Kind::View {
            camera: "eye".into(),
            view_from_world: eye.view_from_world.to_cols_array(),
            clip_from_view: eye.clip_from_view.to_cols_array(),
        },
        extent: eye.extent,
        probes: Some(grid),
        lamps: Vec::new(),
        calendar: Calendar {
            date: "2026-06-21".into(),
            zone: "UTC".into(),
            latitude: 0.0,
            longitude: 0.0,
            ..Calendar::default()
        },
        steps: 2,
        times: vec![lit(9.0), lit(15.0)],
        weather: Weather::default(),
        settings,
    }
}

/// Eight probes in a cube around a point.
fn around(middle: Vec3, apart: f32) -> Grid {
    Grid { origin: (middle - 0.5 * apart).to_array(), spacing: [apart; 3], counts: [2; 3] }
}

fn transport(gpu: &Gpu, scene: &Scene, plan: &Plan) -> Transport {
    Transport::new(gpu, scene, plan, Sources::View(Box::new(eye()))).unwrap()
}

/// Harmonics of the irradiance of a probe under rows of light for the twelve normals; `of`: the light of a row.
fn terms(probe: usize, channel: usize, of: impl Fn(usize) -> f64) -> [f64; 9] {
    let mut terms = [0.0; 9];
    for direction in 0..DIRECTIONS {
        let e = of(3 * (probe * DIRECTIONS + direction) + channel);
        // The order of the bake.
        let y = harmonics(normal(direction));
        terms.iter_mut().zip(y).for_each(|(term, y)| *term += 4.0 * PI / DIRECTIONS as f64 * y * e);
    }
    terms
}

/// The twelve normals, written down independently of the engine.
pub fn normal(i: usize) -> DVec3 {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let (a, b) = ([1.0, -1.0][i % 2], [golden, -golden][i / 2 % 2]);
    [DVec3::new(0.0, a, b), DVec3::new(b, 0.0, a), DVec3::new(a, b, 0.0)][i / 4].normalize()
}

fn axes() -> [DVec3; 6] {
    [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z]
}

/// The mean irradiance of the eight probes of a grid under a sky of radiance 1, for any normal.
fn under_an_even_sky(gpu: &Gpu, scene: &Scene, grid: Grid) -> impl Fn(DVec3) -> f64 {
    let plan = plan(scene, grid, baking());
    let gathered = transport(gpu, scene, &plan).brick(&plan, 0).unwrap();
    let sky = gathered.light.sky;
    let light = |row: usize| sky[row * PATCHES..(row + 1) * PATCHES].iter().map(|v| f64::from(*v)).sum::<f64>();
    let all: Vec<[f64; 9]> = (0..8).map(|probe| terms(probe, 0, light)).collect();
    move |normal| all.iter().map(|terms| irradiance(terms, normal)).sum::<f64>() / 8.0
}

#[test]
fn a_probe_by_a_white_body_under_an_even_sky_has_an_irradiance_of_pi_for_all_normals() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let white = stage.material(Material::diffuse("white", Vec3::ONE));
        stage.cuboid(white, vec3(-1.0, -1.0, -1.0), Vec3::ZERO, false);
        let e = under_an_even_sky(gpu, &stage.scene, around(Vec3::splat(0.6), 0.5));
        for normal in axes() {
            assert!((e(normal) / PI - 1.0).abs() < 0.01, "{normal}: {}", e(normal) / PI);
        }
    });
}

#[test]
fn a_grey_floor_under_an_even_sky_reflects_its_albedo() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let grey = stage.material(Material::diffuse("grey", Vec3::splat(0.5)));
        stage.quad(grey, vec3(-500.0, 0.0, -500.0), Vec3::Z * 1000.0, Vec3::X * 1000.0);
        let e = under_an_even_sky(gpu, &stage.scene, around(Vec3::Y * 1.0, 0.5));
        // Irradiance is π/2 ((1 + ρ) + (1 - ρ) n.y), which has no bands above the first.
        for normal in axes() {
            let wanted = 0.5 * PI * (1.5 + 0.5 * normal.y);
            assert!((e(normal) / wanted - 1.0).abs() < 0.02, "{normal}: {} {wanted}", e(normal));
        }
    });
}

#[test]
fn a_sphere_with_an_opening_has_the_light_of_an_integrating_sphere() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let albedo = 0.6;
        let wall = stage.material(Material::diffuse("wall", Vec3::splat(albedo)));
        stage.sphere(wall, Vec3::ZERO, 1.0, 64, true);
        // The first ten of 64 rings are the opening.
        let primitive = &mut stage.scene.meshes[0].primitives[0];
        let edge = (std::f32::consts::PI * 10.0 / 64.0).cos();
        let positions = primitive.positions.clone();
        let open = |t: &[u32]| t.iter().all(|i| positions[*i as usize].y > edge - 1e-4);
        let kept: Vec<u32> = primitive.indices.chunks(3).filter(|t| !open(t)).flatten().copied().collect();
        assert!(kept.len() < primitive.indices.len());
        primitive.indices = kept;
        let e = under_an_even_sky(gpu, &stage.scene, around(Vec3::ZERO, 1e-3));
        // A patch of a sphere lights all of the sphere alike: the wall has E = π f / (1 - ρ (1 - f)).
        let (opening, albedo) = (0.5 * (1.0 - f64::from(edge)), f64::from(albedo));
        let wall = albedo * opening / (1.0 - albedo * (1.0 - opening));
        let mean = axes().map(&e).iter().sum::<f64>() / 6.0;
        let wanted = PI * (opening + (1.0 - opening) * wall);
        assert!((mean / wanted - 1.0).abs() < 0.02, "{mean}, not {wanted}");
    });
}

/// A white floor between a red and a blue wall, with a hanging board that shades a part.
pub fn room() -> Scene {
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

pub fn sunny(scene: Scene, sun: Vec3, irradiance: Vec3) -> Scene {
    let mut stage = Stage { scene };
    let turn = Quat::from_rotation_arc(Vec3::Z, sun.normalize());
    stage.light(LightKind::Directional, irradiance, 1.0, Mat4::from_quat(turn));
    stage.scene
}

/// Irradiance at a point by the path tracer after at least one scattering: on a small white square that the scene hardly notices.
fn truth(gpu: &Gpu, scene: &Scene, at: Vec3, normal: Vec3) -> [f64; 3] {
    let mut stage = Stage { scene: scene.clone() };
    let white = stage.material(Material::diffuse("white", Vec3::ONE));
    let a = normal.any_orthonormal_vector();
    let b = normal.cross(a);
    stage.quad(white, at - 1e-3 * (a + b), a * 2e-3, b * 2e-3);
    // Many pixels with few samples, because each pass costs time in the validation layer.
    let eye = view(at + 0.01 * normal, at, 5.0, [64, 64]);
    let settings = Settings {
        bounces: 16,
        roulette: 16,
        diffuse_only: true,
        filter: Filter::Centre,
        planned: 8,
        ..Settings::default()
    };
    let layers = render(gpu, &stage.scene, &eye, &settings, 8);
    crate::tracer_lab::mean(&layers, "indirect").map(|radiance| PI * radiance)
}

#[test]
fn probes_have_the_irradiance_of_the_path_tracer() {
    with_gpu(|gpu| {
        let scene = room();
        let middle = vec3(0.4, 0.5, 0.3);
        let plan = plan(&scene, around(middle, 1e-3), Baking { probe_samples: 1024, ..baking() });
        let gathered = transport(gpu, &scene, &plan).brick(&plan, 0).unwrap();
        for (time, lit) in plan.times.iter().enumerate() {
            let lit = sunny(scene.clone(), Vec3::from(lit.sun), Vec3::ONE);
            let (mut sums, mut worst) = ([[0.0; 2]; 3], 0.0f64);
            for normal in axes() {
                let wanted = truth(gpu, &lit, middle, normal.as_vec3());
                for channel in 0..3 {
                    let light = |row: usize| f64::from(gathered.light.sun[row * plan.times.len() + time]);
                    let found: f64 =
                        (0..8).map(|probe| irradiance(&terms(probe, channel, light), normal)).sum::<f64>() / 8.0;
                    sums[channel][0] += found;
                    sums[channel][1] += wanted[channel];
                    worst = worst.max((found - wanted[channel]).abs());
                }
            }
            let mean = sums[1][1] / 6.0;
            eprintln!("time {time}: sums {sums:?}, worst normal {worst:.4} of a mean of {mean:.4}");
            for [found, wanted] in sums {
                assert!((found / wanted - 1.0).abs() < 0.03, "time {time}: {sums:?}");
            }
            // Bands above the second are missing.
            assert!(worst < 0.2 * mean, "time {time}: {worst} of {mean}");
        }
    });
}

#[test]
fn probes_leave_solids_or_have_no_light() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let white = stage.material(Material::diffuse("white", Vec3::splat(0.5)));
        stage.cuboid(white, vec3(-2.0, -2.0, -2.0), vec3(2.0, 2.0, 2.0), false);
        // The first probe is far inside, the last one is outside by a corner; the one at +x is 0.1 m under the surface.
        let grid = Grid { origin: [0.0, 0.0, 0.0], spacing: [1.9, 3.0, 3.0], counts: [2; 3] };
        let plan = plan(&stage.scene, grid.clone(), Baking { probe_samples: 64, ..baking() });
        let brick = Brick::compress(
            &plan,
            transport(gpu, &stage.scene, &plan).brick(&plan, 0).unwrap(),
            &units::skies(&plan).unwrap(),
        )
        .unwrap();
        let valid: Vec<bool> = (0..8).map(|probe| brick.valid(probe)).collect();
        assert!(!valid[0] && valid[1] && valid[7], "{valid:?}");
        assert!(
            brick.positions[1].x > 2.0 && (brick.positions[1].x - 1.9).abs() <= 0.45 * 1.9,
            "{:?}",
            brick.positions
        );
        assert_eq!(brick.positions[7], grid.position([1, 1, 1]));
    });
}

pub fn stored(gpu: &Gpu, scene: &Scene, grid: Option<Grid>, settings: Baking) -> Stored {
    stored_of(
        gpu,
        scene,
        Plan { probes: grid.clone(), ..plan(scene, grid.unwrap_or(around(Vec3::ZERO, 1.0)), settings) },
    )
}

/// A whole bake of a plan.
pub fn stored_of(gpu: &Gpu, scene: &Scene, plan: Plan) -> Stored {
    let skies = units::skies(&plan).unwrap();
    let mut transport = transport(gpu, scene, &plan);
    let unit = |transport: &mut Transport, index: u32| units::unit(&plan, transport, index, &skies).unwrap();
    let gathered: Vec<Gathered> = (0..plan.tile_count())
        .map(|index| {
            let [_, _, columns, rows] = plan.tile(index);
            let bytes = unit(&mut transport, index);
            Gathered::decode(&bytes, (columns * rows) as usize, plan.dimensions()).unwrap()
        })
        .collect();
    let tiles = finish::tiles(&plan, &gathered, |_| Ok(())).unwrap();
    let probes = (0..plan.brick_count()).map(|brick| {
        let count = plan.probes.as_ref().unwrap().brick(brick).len();
        Brick::decode(&unit(&mut transport, plan.tile_count() + brick), &plan, count).unwrap()
    });
    let probes = probes.collect();
    Stored { plan, tiles, probes, corners: Corners::default() }
}

#[test]
fn probes_have_the_same_bits_whatever_else_is_baked_and_come_back_from_a_file() {
    with_gpu(|gpu| {
        let scene = room();
        let grid = Grid { origin: [-1.5, 0.3, -1.5], spacing: [0.7, 0.7, 0.7], counts: [5, 2, 2] };
        let settings = Baking { samples: 2, probe_samples: 40, bounces: 3, ..baking() };
        let whole = stored(gpu, &scene, Some(grid), settings);
        let plan = &whole.plan;
        assert_eq!((plan.brick_count(), whole.probes.len()), (2, 2));
        let skies = units::skies(plan).unwrap();
        let last = plan.tile_count() + 1;
        let alone = units::unit(plan, &mut transport(gpu, &scene, plan), last, &skies).unwrap();
        assert!(alone == whole.probes[1].encode());
        for length in (0..alone.len()).step_by(211) {
            assert!(Brick::decode(&alone[..length], plan, 4).is_err());
        }
        let bytes = whole.encode().unwrap();
        assert!(Stored::decode(&bytes).unwrap() == whole);
        let summary = whole.probe_summary().unwrap();
        assert!(summary.probes == 20 && summary.valid > 10 && summary.bytes > 0, "{summary:?}");
        assert!(summary.worst <= plan.settings.tolerance, "{summary:?}");
        for length in (0..bytes.len()).step_by(4099) {
            assert!(Stored::decode(&bytes[..length]).is_err());
        }
        let fewer = Stored { probes: whole.probes[..1].to_vec(), ..whole.clone() };
        let error = Stored::decode(&fewer.encode().unwrap()).unwrap_err();
        assert!(error.to_string().contains("1 bricks of probes"), "{error}");
    });
}

#[test]
fn the_device_decodes_probes_as_the_processor_does_and_without_negative_light() {
    with_gpu(|gpu| {
        let scene = room();
        let grid = Grid { origin: [-1.5, 0.3, -1.5], spacing: [0.7, 0.7, 0.7], counts: [5, 2, 2] };
        let stored =
            stored(gpu, &scene, Some(grid.clone()), Baking { samples: 2, probe_samples: 32, bounces: 3, ..baking() });
        let weights = [(0, 0.25), (1, 0.75)];
        // Light from a part of the sky alone comes from few directions, so harmonics swing below zero.
        let patches: Vec<[f32; 3]> = (0..PATCHES).map(|i| if i < 20 { [3.0, 2.0, 1.0] } else { [0.0; 3] }).collect();
        for sun in [[1.0, 0.9, 0.5], [0.0; 3]] {
            let field = Field::new(gpu, &stored).unwrap().unwrap();
            let mut graph = Graph::new("probes");
            let tiles = stored.probes.iter().map(|brick| &brick.light);
            let light =
                field.decode(&mut graph, tiles, Moment { weights: &weights, sun, patches: &patches, lamps: &[] });
            let read = graph.read_buffer(light);
            let light: Vec<[f32; 3]> = Runner::new(gpu).run(&graph).unwrap().buffer(read);
            let mut weakened = 0;
            for (index, brick) in stored.probes.iter().enumerate() {
                let of_sun = brick.light.sun.mix(weights.iter().map(|(time, w)| (*time, sun.map(|c| c * w))));
                let of_sky = brick.light.sky.mix(patches.iter().copied().enumerate());
                for (inside, at) in grid.brick(index as u32).into_iter().enumerate() {
                    assert!(brick.valid(inside), "{at:?}");
                    let found = &light[9 * grid.number(at) as usize..][..9];
                    for channel in 0..3 {
                        let wanted = terms(0, channel, |row| {
                            let texel = inside * DIRECTIONS + row / 3;
                            let [a, b] =
                                [brick.light.sun.decode(texel, &of_sun), brick.light.sky.decode(texel, &of_sky)];
                            f64::from(a[channel]) + f64::from(b[channel])
                        });
                        let found: [f64; 9] = std::array::from_fn(|k| f64::from(found[k][channel]));
                        // A sky that the bake does not guarantee may come back with less than no light.
                        if wanted[0] <= 0.0 {
                            assert_eq!(found, [0.0; 9], "{at:?}");
                            continue;
                        }
                        let close = |a: f64, b: f64| (a - b).abs() < 1e-4 * wanted[0].abs().max(1e-6);
                        assert!(close(found[0], wanted[0]), "{at:?}: {found:?}, not {wanted:?}");
                        // One factor for all harmonics above the first.
                        let (up, down) = found[1..]
                            .iter()
                            .zip(&wanted[1..])
                            .fold((0.0, 0.0), |(up, down), (a, b)| (up + a * b, down + b * b));
                        let factor: f64 = if down > 0.0 { up / down } else { 1.0 };
                        assert!((-1e-4..1.0001).contains(&factor), "{at:?}: {factor}");
                        assert!(
                            (1..9).all(|k| close(found[k], factor * wanted[k])),
                            "{at:?}: {found:?}, not {wanted:?}"
                        );
                        weakened += u32::from(factor < 0.999);
                        for normal in axes().into_iter().chain((0..DIRECTIONS).map(normal)) {
                            assert!(irradiance(&found, normal) > -0.1 * wanted[0], "{at:?} {normal}");
                        }
                    }
                }
            }
            eprintln!("{weakened} of {} weakened", 3 * grid.probes());
        }
    });
}
