//! Every sampler draws with the density that it says, and all of it: chi-square over bins, and E[g / density] = ∫ g.

use crate::tracer_lab::{Stage, chi_square, chi_square_tail, sidak};
use glam::{DVec3, Mat4, Vec3};
use lucerna::{
    gpu::{Gpu, ImageDesc, OwnedImage, Region, testing::with_gpu},
    graph::{Graph, Runner},
    reference::brdf::Matter,
    resident,
    scene::{Environment, Light, LightKind, Material, Node, Pose, Scene},
    shaders::{consts, test::samplers as shader, types},
    tracer::{Sources, tables},
};
use lucerna_scenes as builtin;
use std::f64::consts::PI;

const COUNT: u32 = 1 << 17;

/// What the shader is asked for.
#[derive(Clone, Copy, Debug)]
struct Ask {
    push: shader::Push,
    seed: u32,
}

fn ask(which: u32) -> Ask {
    Ask { push: shader::Push { which, count: COUNT, ..Default::default() }, seed: 1 }
}

/// Samples and values of the shader, with the tables of `environment` and `lights`.
fn draw(gpu: &Gpu, ask: Ask, environment: &Environment, lights: &tables::LightTable) -> [Vec<[f32; 4]>; 2] {
    let texels: Vec<[f32; 4]> = environment.pixels.iter().map(|p| p.extend(1.0).to_array()).collect();
    let desc = ImageDesc::new(ash::vk::Format::R32G32B32A32_SFLOAT, environment.width, environment.height);
    let region = Region { mip: 0, layer: 0, bytes: bytemuck::cast_slice(&texels) };
    let map = OwnedImage::with_contents(gpu, "map", desc, &[region]).unwrap();
    let importance = tables::importance(Some(environment));
    let mut graph = Graph::new("samplers");
    let settings = types::PathSettings {
        environment: types::EnvironmentMap {
            size: [environment.width as i32, environment.height as i32],
            cells: importance.cells,
            rotation: environment.rotation,
            scale: environment.scale,
        },
        suns: lights.suns,
        tree: lights.tree.into(),
        // Here: how many lights there are.
        textures: lights.targets.len() as u32,
        seed: ask.seed,
        ..Default::default()
    };
    let bytes = u64::from(ask.push.count) * 16;
    let (drawn, values) = (graph.buffer("drawn", bytes), graph.buffer("values", bytes));
    let args = shader::Args {
        environment_radiance_map: graph.import_image(&map),
        environment_edges: graph.buffer_from("cells", &importance.edges),
        light_columns: graph.buffer_from("columns", &lights.columns),
        light_targets: graph.buffer_from("targets", &lights.targets),
        instance_lights: graph.buffer_from("instances", &lights.instances),
        light_nodes: graph.buffer_from("nodes", &lights.nodes),
        settings: graph.uniform(&settings),
        drawn,
        values,
        push: ask.push,
    };
    graph.compute(args, ask.push.count);
    let tokens = [drawn, values].map(|b| graph.read_buffer(b));
    let frame = Runner::new(gpu).run(&graph).unwrap();
    tokens.map(|t| frame.buffer(t))
}

fn plain(gpu: &Gpu, ask: Ask) -> [Vec<[f32; 4]>; 2] {
    draw(gpu, ask, &Environment::constant(Vec3::ONE), &table(Sources::All))
}

fn table(sources: Sources) -> tables::LightTable {
    let mut scene = builtin::load("cornell-area").unwrap();
    for (i, intensity) in [3.0, 1.0, 0.0].into_iter().enumerate() {
        let kind = LightKind::Directional;
        scene.lights.push(Light { name: format!("sun {i}"), kind, color: Vec3::ONE, intensity });
        scene.nodes.push(Node { light: Some(scene.lights.len() as u32 - 1), ..Node::default() });
    }
    table_of(&scene, sources)
}

fn table_of(scene: &Scene, sources: Sources) -> tables::LightTable {
    let pose = Pose::rest(scene);
    tables::lights(scene, &pose, &resident::lights(scene, &pose), sources)
}

fn direction(sample: &[f32; 4]) -> DVec3 {
    DVec3::new(sample[0].into(), sample[1].into(), sample[2].into())
}

const ROWS: usize = 24;
const COLUMNS: usize = 32;

/// Bin of a direction: cosine to +z and azimuth.
fn bin(d: DVec3) -> usize {
    let row = ((0.5 - 0.5 * d.z.clamp(-1.0, 1.0)) * ROWS as f64) as usize;
    let column = ((d.y.atan2(d.x) / (2.0 * PI) + 0.5) * COLUMNS as f64) as usize;
    row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)
}

/// Expected counts of the bins for a density per steradian.
fn expected(density: impl Fn(DVec3) -> f64) -> Vec<f64> {
    const FINE: usize = 24;
    let mut out = vec![0.0; ROWS * COLUMNS];
    for row in 0..ROWS * FINE {
        for column in 0..COLUMNS * FINE {
            let z = 1.0 - 2.0 * (row as f64 + 0.5) / (ROWS * FINE) as f64;
            let azimuth = 2.0 * PI * ((column as f64 + 0.5) / (COLUMNS * FINE) as f64 - 0.5);
            let s = (1.0 - z * z).sqrt();
            let d = DVec3::new(s * azimuth.cos(), s * azimuth.sin(), z);
            out[row / FINE * COLUMNS + column / FINE] += density(d);
        }
    }
    let each = 4.0 * PI / (ROWS * COLUMNS * FINE * FINE) as f64 * f64::from(COUNT);
    out.iter().map(|v| v * each).collect()
}

/// Chi-square of directions, and the densities that the shader states against the formula.
#[track_caller]
fn check_directions(name: &str, samples: &[[f32; 4]], runs: u32, density: impl Fn(DVec3) -> f64) {
    let mut counts = vec![0.0; ROWS * COLUMNS];
    for sample in samples {
        counts[bin(direction(sample))] += 1.0;
    }
    let p = chi_square(&counts, &expected(&density));
    assert!(p > sidak(runs), "{name}: p = {p:e}");
    for sample in samples.iter().step_by(997) {
        let want = density(direction(sample).normalize());
        assert!(
            (f64::from(sample[3]) - want).abs() <= 2e-3 * want + 1e-6,
            "{name}: density {} at {sample:?}, {want} by formula",
            sample[3]
        );
    }
}

/// ∫ g by the samples against the exact value.
#[track_caller]
fn check_mean(name: &str, terms: impl Iterator<Item = f64> + Clone, exact: f64) {
    let n = terms.clone().count() as f64;
    let mean = terms.clone().sum::<f64>() / n;
    let variance = terms.map(|t| (t - mean) * (t - mean)).sum::<f64>() / (n - 1.0);
    let sigma = (variance / n).sqrt();
    assert!((mean - exact).abs() < 4.5 * sigma + 1e-4 * exact, "{name}: {mean} ± {sigma} instead of {exact}");
}

/// D G1(v) (v·h) / v.z / (4 v·h), in double precision from Heitz 2018, equations 2 and 3.
fn ggx_density(v: DVec3, l: DVec3, alpha: f64) -> f64 {
    let h = (v + l).normalize();
    if h.z <= 0.0 || v.dot(h) <= 0.0 {
        return 0.0;
    }
    let slope = (h.x * h.x + h.y * h.y) / (h.z * h.z * alpha * alpha);
    let d = 1.0 / (PI * alpha * alpha * h.z.powi(4) * (1.0 + slope).powi(2));
    let tan2 = (1.0 - v.z * v.z) / (v.z * v.z);
    let g1 = 2.0 / (1.0 + (1.0 + alpha * alpha * tan2).sqrt());
    d * g1 / (4.0 * v.z)
}

#[test]
fn the_tail_of_chi_square_is_the_tabulated_one() {
    for (x, freedom, p) in [(3.841, 1.0, 0.05), (18.307, 10.0, 0.05), (124.342, 100.0, 0.05), (135.807, 100.0, 0.01)] {
        let found = chi_square_tail(x, freedom);
        assert!((found - p).abs() < 2e-4, "{x} {freedom}: {found}");
    }
}

#[test]
fn random_words_are_even_and_independent() {
    with_gpu(|gpu| {
        for seed in [0, 1, 77] {
            let [drawn, values] = plain(gpu, Ask { seed, ..ask(consts::SAMPLER_NUMBERS) });
            let even = vec![f64::from(COUNT) / 256.0; 256];
            for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                let mut counts = vec![0.0; 256];
                for s in &drawn {
                    counts[(s[a] * 16.0) as usize * 16 + (s[b] * 16.0) as usize] += 1.0;
                }
                let p = chi_square(&counts, &even);
                assert!(p > sidak(24) && drawn.iter().all(|s| s[a] < 1.0 && s[b] < 1.0), "words {a}, {b}: p = {p:e}");
            }
            let mut counts = vec![0.0; 1000];
            values.iter().for_each(|v| counts[v[0] as usize] += 1.0);
            let p = chi_square(&counts, &vec![f64::from(COUNT) / 1000.0; 1000]);
            assert!(p > sidak(24), "whole numbers: p = {p:e}");
            // Neighbouring pixels: pairs that follow each other in a row.
            let mut counts = vec![0.0; 256];
            drawn
                .chunks_exact(2)
                .for_each(|s| counts[(s[0][0] * 16.0) as usize * 16 + (s[1][0] * 16.0) as usize] += 1.0);
            let p = chi_square(&counts, &even.iter().map(|e| e / 2.0).collect::<Vec<_>>());
            assert!(p > sidak(24), "neighbours: p = {p:e}");
        }
    });
}

#[test]
fn shapes_are_sampled_evenly() {
    with_gpu(|gpu| {
        let [cosine, _] = plain(gpu, ask(consts::SAMPLER_COSINE));
        check_directions("cosine", &cosine, 6, |d| d.z.max(0.0) / PI);
        let inverse = cosine.iter().filter(|s| s[3] > 0.0).map(|s| f64::from(s[2]) * f64::from(s[2]) / f64::from(s[3]));
        // ∫ cos² θ dω = 2π/3.
        check_mean("cosine", inverse, 2.0 * PI / 3.0);
        let [sphere, _] = plain(gpu, ask(consts::SAMPLER_SPHERE));
        check_directions("sphere", &sphere, 6, |_| 0.25 / PI);
        for cos_max in [-0.5f32, 0.25] {
            let mut wide = ask(consts::SAMPLER_CONE);
            wide.push.alpha = cos_max;
            let [cone, _] = plain(gpu, wide);
            // The edge of the cone lies on an edge of the bins.
            let within = f64::from(cos_max);
            check_directions("cone", &cone, 6, |d| if d.z >= within { 0.5 / PI / (1.0 - within) } else { 0.0 });
        }
        for (which, area) in [(consts::SAMPLER_DISC, PI), (consts::SAMPLER_TRIANGLE, 0.5)] {
            let [flat, _] = plain(gpu, ask(which));
            let triangle = which == consts::SAMPLER_TRIANGLE;
            const N: usize = 20;
            const FINE: usize = 40;
            let place = |s: f64| if triangle { s } else { 0.5 + 0.5 * s };
            let (mut counts, mut bins) = (vec![0.0; N * N], vec![0.0; N * N]);
            for s in &flat {
                let [x, y] = [s[0], s[1]].map(|v| (place(v.into()) * N as f64).clamp(0.0, N as f64 - 1.0) as usize);
                counts[y * N + x] += 1.0;
                let outside = if triangle {
                    s[0] + s[1] > 1.0 + 1e-6 || s[0] < 0.0 || s[1] < 0.0
                } else {
                    s[0] * s[0] + s[1] * s[1] > 1.0 + 1e-6
                };
                assert!(!outside && (1.0 / f64::from(s[3]) - area).abs() < 1e-5, "{s:?}");
            }
            let mut total = 0.0;
            for y in 0..N * FINE {
                for x in 0..N * FINE {
                    let [x01, y01] = [x, y].map(|v| (v as f64 + 0.5) / (N * FINE) as f64);
                    let inside =
                        if triangle { x01 + y01 < 1.0 } else { (2.0 * x01 - 1.0).hypot(2.0 * y01 - 1.0) < 1.0 };
                    bins[y / FINE * N + x / FINE] += f64::from(u8::from(inside));
                    total += f64::from(u8::from(inside));
                }
            }
            bins.iter_mut().for_each(|b| *b *= f64::from(COUNT) / total);
            // Bins that the edge only touches are estimated too coarsely to be held against anything.
            let full = bins.iter().fold(0.0f64, |a, &b| a.max(b));
            let kept: Vec<usize> = (0..N * N).filter(|&i| bins[i] > 0.02 * full).collect();
            let p = chi_square(
                &kept.iter().map(|&i| counts[i]).collect::<Vec<_>>(),
                &kept.iter().map(|&i| bins[i]).collect::<Vec<_>>(),
            );
            assert!(p > sidak(6), "{which}: p = {p:e}");
        }
    });
}

#[test]
fn visible_normals_of_ggx() {
    with_gpu(|gpu| {
        let views = [Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.5, 0.8, 0.331_662_48)];
        let alphas = [0.3f32, 0.6, 1.0];
        for view in views {
            for alpha in alphas {
                let mut glossy = ask(consts::SAMPLER_GGX);
                (glossy.push.view, glossy.push.alpha) = (view.to_array(), alpha);
                let [drawn, _] = plain(gpu, glossy);
                let v = view.as_dvec3().normalize();
                check_directions(&format!("GGX {alpha} from {view}"), &drawn, 9, |l| ggx_density(v, l, alpha.into()));
            }
        }
    });
}

#[test]
fn the_two_lobes_together() {
    with_gpu(|gpu| {
        for (view, alpha, share) in
            [(Vec3::new(0.6, 0.0, 0.8), 0.4f32, 0.5f32), (Vec3::new(0.0, -0.96, 0.28), 0.7, 0.2)]
        {
            let mut both = ask(consts::SAMPLER_BSDF);
            (both.push.view, both.push.alpha, both.push.share) = (view.to_array(), alpha, share);
            (both.push.albedo, both.push.f0) = ([0.5; 3], [0.3; 3]);
            let [drawn, values] = plain(gpu, both);
            let (v, a, s) = (view.as_dvec3(), f64::from(alpha), f64::from(share));
            // Below the surface the shader says 0, as nothing is reflected there.
            let above: Vec<[f32; 4]> = drawn.iter().copied().filter(|d| d[2] > 0.0).collect();
            let density = |l: DVec3| if l.z > 0.0 { (1.0 - s) * l.z / PI + s * ggx_density(v, l, a) } else { 0.0 };
            let mut counts = vec![0.0; ROWS * COLUMNS];
            above.iter().for_each(|d| counts[bin(direction(d))] += 1.0);
            let p = chi_square(&counts, &expected(density));
            assert!(p > sidak(2), "p = {p:e}");
            for (d, value) in drawn.iter().zip(&values).filter(|(d, _)| d[2] > 1e-3).step_by(499) {
                let want = density(direction(d).normalize());
                assert!((f64::from(d[3]) - want).abs() < 2e-3 * want + 1e-6);
                // In double precision.
                let l = direction(d).normalize();
                let matter = Matter { albedo: DVec3::splat(0.5), f0: DVec3::splat(0.3), roughness: a.sqrt() };
                let exact = matter.response(DVec3::Z, v, l).x;
                assert!((f64::from(value[0]) - exact).abs() < 2e-3 * exact, "{value:?} instead of {exact}");
                // Reciprocity: f(l, v) = f(v, l); the shader gives f cos.
                let (there, back) = (f64::from(value[1]) / l.z, f64::from(value[3]) / v.z);
                assert!((there - back).abs() < 1e-3 * there, "{there} {back}");
            }
        }
    });
}

#[test]
fn the_sky_is_sampled_by_its_light() {
    with_gpu(|gpu| {
        let mut sky = Environment::constant(Vec3::ZERO);
        (sky.width, sky.height, sky.rotation, sky.scale) = (24, 12, 1.0, 2.0);
        sky.pixels = (0..24 * 12).map(|i| Vec3::new(0.2, 0.1, 0.05) * (i % 7) as f32 + Vec3::splat(0.02)).collect();
        sky.pixels[3 * 24 + 20] = Vec3::splat(30.0);
        let map = tables::importance(Some(&sky));
        let [drawn, values] = draw(gpu, ask(consts::SAMPLER_ENVIRONMENT), &sky, &table(Sources::All));
        // Cells as bins: their exact probabilities are known.
        let local = |d: DVec3| glam::DQuat::from_rotation_y(-1.0) * d;
        let mut counts = vec![0.0; 24 * 12];
        for d in &drawn {
            let d = local(direction(d));
            let x = ((d.x.atan2(-d.z) / (2.0 * PI) + 0.5) * 24.0) as usize % 24;
            let y = ((d.x.hypot(d.z).atan2(d.y) / PI) * 12.0) as usize;
            counts[y.min(11) * 24 + x] += 1.0;
        }
        let wanted: Vec<f64> = (0..24 * 12).map(|i| map.probability(i % 24, i / 24) * f64::from(COUNT)).collect();
        let p = chi_square(&counts, &wanted);
        assert!(p > sidak(1), "p = {p:e}");
        // Within a cell directions are uniform in solid angle, which is in the cosine of the polar angle.
        let mut shares = [0.0; 16];
        for d in &drawn {
            let d = direction(d);
            let row = (d.x.hypot(d.z).atan2(d.y) / PI * 12.0).floor().min(11.0);
            let h = |row: f64| (0.5 * PI * row / 12.0).sin().powi(2);
            let share = (0.5 * (1.0 - d.y) - h(row)) / (h(row + 1.0) - h(row));
            shares[((share.max(0.0) * 16.0) as usize).min(15)] += 1.0;
        }
        let p = chi_square(&shares, &[f64::from(COUNT) / 16.0; 16]);
        assert!(p > sidak(1), "within cells p = {p:e}: {shares:?}");
        check_mean("solid angle of the sphere", drawn.iter().map(|d| 1.0 / f64::from(d[3])), 4.0 * PI);
        let light = drawn.iter().zip(&values).map(|(d, v)| f64::from(v[0]) / f64::from(d[3]));
        check_mean("light of the sky", light, {
            // Exactly: the interpolated radiance over the sphere, by a fine grid.
            let (mut sum, n) = (0.0, 720);
            for y in 0..n / 2 {
                let polar = PI * (f64::from(y) + 0.5) / f64::from(n / 2);
                let band = 2.0 * PI / f64::from(n)
                    * ((PI * f64::from(y) / f64::from(n / 2)).cos() - (PI * f64::from(y + 1) / f64::from(n / 2)).cos());
                for x in 0..n {
                    let azimuth = 2.0 * PI * (f64::from(x) + 0.5) / f64::from(n);
                    let d = DVec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos());
                    sum += f64::from(sky.radiance(d.as_vec3()).x) * band;
                }
            }
            sum
        });
        let mut away = 0;
        for (d, v) in drawn.iter().zip(&values).step_by(101) {
            let want = sky.radiance(direction(d).as_vec3());
            assert!((v[0] - want.x).abs() < 2e-4 * want.x + 1e-5, "{v:?} instead of {want} towards {d:?}");
            // At the edge of a cell the direction may be taken for one of the next cell.
            away += u32::from((v[3] - d[3]).abs() > 1e-3 * d[3]);
        }
        assert!(away <= 3, "{away} densities differ from those of looking up the direction");
    });
}

#[test]
fn suns_are_picked_by_their_power() {
    with_gpu(|gpu| {
        let lights = table(Sources::All);
        assert_eq!(lights.suns, 3);
        let [drawn, _] = draw(gpu, ask(consts::SAMPLER_SUN), &Environment::constant(Vec3::ONE), &lights);
        let mut counts = vec![0.0; 3];
        for d in &drawn {
            counts[d[0] as usize] += 1.0;
            assert_eq!(d[3], lights.columns[d[0] as usize].probability);
        }
        let p = chi_square(&counts, &[0.75, 0.25, 0.0].map(|share| share * f64::from(COUNT)));
        assert!(p > sidak(1), "p = {p:e}");
        check_mean("number of suns", drawn.iter().map(|d| 1.0 / f64::from(d[3])), 2.0);
    });
}

/// Lamps of every kind: points, spots, some with a range, a lit ball, a panel that shines to both sides, one that is black.
fn many_lamps() -> Scene {
    let mut stage = Stage::new();
    for i in 0..40 {
        let at = Vec3::new((i % 8) as f32, 1.0 + 0.1 * (i % 3) as f32, (i / 8) as f32);
        let turned = Mat4::from_translation(at) * Mat4::from_rotation_x(-1.2) * Mat4::from_rotation_y(i as f32);
        let kind = match i % 4 {
            0 => LightKind::Point { range: None },
            1 => LightKind::Point { range: Some(2.5) },
            2 => LightKind::Spot { range: None, inner: 0.2, outer: 0.6 },
            _ => LightKind::Spot { range: Some(4.0), inner: 0.0, outer: 1.2 },
        };
        stage.light(kind, Vec3::new(1.0, 0.5, 0.25), if i == 7 { 0.0 } else { 1.0 + (i % 5) as f32 }, turned);
    }
    let ball = stage.emitter(Vec3::new(2.0, 3.0, 4.0));
    stage.sphere(ball, Vec3::new(2.0, 0.5, 7.0), 0.5, 6, false);
    let panel = stage.material(Material { double_sided: true, ..Material::emitter("panel", Vec3::splat(3.0)) });
    stage.quad(panel, Vec3::new(9.0, 0.0, 0.0), Vec3::Y, Vec3::Z);
    let black = stage.emitter(Vec3::ZERO);
    stage.quad(black, Vec3::new(9.0, 2.0, 0.0), Vec3::Y, Vec3::Z);
    stage.scene
}

#[test]
fn lamps_are_picked_as_often_as_stated_wherever_one_stands() {
    with_gpu(|gpu| {
        let scene = many_lamps();
        let lights = table_of(&scene, Sources::All);
        let count = lights.targets.len();
        let places = [
            (Vec3::new(3.2, 0.0, 2.1), Vec3::Y),
            (Vec3::new(0.1, 0.9, 0.1), Vec3::new(0.6, 0.0, 0.8)),
            (Vec3::new(8.9, 0.5, 0.5), Vec3::X),
            // On a lamp, and far away.
            (Vec3::new(0.0, 1.0, 0.0), Vec3::Y),
            (Vec3::new(300.0, 20.0, -40.0), Vec3::NEG_X),
            // Everything is behind.
            (Vec3::new(0.0, -1.0, 0.0), Vec3::NEG_Y),
        ];
        for (at, normal) in places {
            let mut here = ask(consts::SAMPLER_LIGHT);
            (here.push.albedo, here.push.view) = (at.to_array(), normal.to_array());
            let [drawn, values] = draw(gpu, here, &Environment::constant(Vec3::ONE), &lights);
            let mut stated = vec![0.0; count];
            values.iter().for_each(|v| stated[v[1] as usize] = f64::from(v[2]));
            let sum: f64 = stated.iter().sum();
            assert!((sum - 1.0).abs() < 1e-5, "densities sum to {sum} at {at}");
            let mut counts = vec![0.0; count];
            for (d, v) in drawn.iter().zip(&values) {
                counts[d[0] as usize] += 1.0;
                // Drawn and looked up are the same function of the same numbers, up to how compilers round.
                assert!((d[3] - v[0]).abs() <= 1e-4 * d[3], "{} drawn, {} looked up at {at}", d[3], v[0]);
            }
            let p = chi_square(&counts, &stated.iter().map(|s| s * f64::from(COUNT)).collect::<Vec<_>>());
            assert!(p > sidak(places.len() as u32), "p = {p:e} at {at}");
            // Whatever sends light here can be drawn; what is black cannot.
            for (number, target) in lights.targets.iter().enumerate() {
                let sends = irradiance(&scene, target, at, normal);
                assert!(sends == 0.0 || stated[number] > 0.0, "light {number} shines on {at} and is never drawn");
            }
            assert_eq!(stated[7], 0.0);
        }
    });
}

/// What a light sends to a surface, shadows aside, in double precision; triangles by their corners and centre.
fn irradiance(scene: &Scene, target: &types::LightTarget, at: Vec3, normal: Vec3) -> f64 {
    let (at, normal) = (at.as_dvec3(), normal.as_dvec3());
    let pose = Pose::rest(scene);
    if target.instance == consts::TARGET_PUNCTUAL {
        let light = &resident::lights(scene, &pose)[target.index as usize];
        let way = Vec3::from(light.position).as_dvec3() - at;
        let (distance, to) = (way.length(), way.normalize_or_zero());
        let outside = light.range > 0.0 && distance >= f64::from(light.range);
        let cone = f64::from(light.spot_scale) * -to.dot(Vec3::from(light.direction).as_dvec3())
            + f64::from(light.spot_offset);
        let shines = !outside && light.intensity[0] > 0.0 && cone > 1e-6;
        return if shines && distance > 0.0 { normal.dot(to).max(0.0) / (distance * distance) } else { 0.0 };
    }
    let primitive = &scene.meshes[target.instance as usize].primitives[0];
    let material = &scene.materials[primitive.material as usize];
    let corners =
        [0, 1, 2].map(|i| primitive.positions[primitive.indices[3 * target.index as usize + i] as usize].as_dvec3());
    let area = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
    if material.emissive == Vec3::ZERO {
        return 0.0;
    }
    let each = corners.iter().chain([&middle]).map(|corner| {
        let way = *corner - at;
        let facing = -area.dot(way);
        let facing = if material.double_sided { facing.abs() } else { facing.max(0.0) };
        if way.length() > 1e-6 { normal.dot(way).max(0.0) * facing / way.length().powi(4) } else { 0.0 }
    });
    // Grazing light may be lost to rounding.
    each.sum::<f64>().max(1e-9) - 1e-9
}
