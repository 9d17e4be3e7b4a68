//! Precomputed transfer: glossy surfaces reflect transferred light by its directions.

use crate::{
    prt_lab::{baked, diffuse, picture, small, walls},
    tracer_lab::{Stage, mean, render, view},
};
use glam::{DVec3, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    image::Layers,
    reference::brdf::Matter,
    scene::{Material, Scene, View},
    shaders::{consts::PRT_LOBES, test::prt_lobe},
    techniques::prt::{Baking, Mode, PictureSettings, Spread, Stored},
    tracer::{Filter, Settings},
};
use std::f64::consts::PI;

/// Zernike's polynomials of first and second degree, as `prt/lobe.glsl` has them.
fn zernike([x, y]: [f64; 2]) -> [f64; PRT_LOBES as usize] {
    [2.0 * x, 2.0 * y, 3f64.sqrt() * (2.0 * (x * x + y * y) - 1.0), 24f64.sqrt() * x * y, 6f64.sqrt() * (x * x - y * y)]
}

/// Mean of a function of directions over the lobe of GGX around a direction: facets have the density D cos θ, and light turns by twice their angle.
fn over_lobe(main: DVec3, alpha: f64, function: impl Fn(DVec3) -> f64) -> f64 {
    let across = main.any_orthonormal_vector();
    let (steps, turns) = (4000, 16);
    let mut sum = 0.0;
    for i in 0..steps {
        // The share of facets within the angle θ is u = tan²θ / (α² + tan²θ).
        let u = (f64::from(i) + 0.5) / f64::from(steps);
        let angle = 2.0 * (alpha * (u / (1.0 - u)).sqrt()).atan();
        for turn in 0..turns {
            let around = DVec3::cross(main, across);
            let phi = 2.0 * PI * f64::from(turn) / f64::from(turns);
            let way = across * phi.cos() + around * phi.sin();
            sum += function(main * angle.cos() + way * angle.sin());
        }
    }
    sum / f64::from(steps * turns)
}

#[test]
fn polynomials_are_orthonormal_over_a_disc() {
    let steps = 400;
    let at = |i: i32| (f64::from(i) + 0.5) / f64::from(steps) * 2.0 - 1.0;
    let mut sums = [[0.0; 6]; 6];
    let mut count = 0.0;
    for (i, j) in (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j))) {
        if at(i).hypot(at(j)) < 1.0 {
            let [a, b, c, d, e] = zernike([at(i), at(j)]);
            let all = [1.0, a, b, c, d, e];
            sums.iter_mut().zip(all).for_each(|(row, a)| row.iter_mut().zip(all).for_each(|(sum, b)| *sum += a * b));
            count += 1.0;
        }
    }
    for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
        let wanted = f64::from(u8::from(i == j));
        assert!((sums[i][j] / count - wanted).abs() < 5e-3, "{i} {j}: {}", sums[i][j] / count);
    }
}

#[test]
fn radiance_over_a_lobe_is_that_of_its_integral() {
    with_gpu(|gpu| {
        let mut asked = Vec::new();
        for alpha in [0.002, 0.04, 0.2, 0.5, 0.8, 0.89, 0.95, 1.0] {
            for cosine in [0.05f32, 0.4, 0.8, 1.0] {
                let sine = (1.0 - cosine * cosine).sqrt();
                asked.push([0.6 * sine, -0.8 * sine, cosine, alpha]);
            }
        }
        // Small enough that the radiance is never below 0, and different in all colours.
        let terms: [Vec3; PRT_LOBES as usize] = [
            vec3(0.1, 0.0, 0.02),
            vec3(-0.05, 0.1, 0.0),
            vec3(0.02, 0.1, -0.1),
            vec3(0.07, 0.0, 0.1),
            vec3(-0.1, 0.1, 0.05),
        ];
        let mut graph = Graph::new("prt.lobe");
        let count = asked.len() as u32;
        let found = graph.buffer("found", 32 * u64::from(count));
        let args = prt_lobe::Args {
            asked: graph.buffer_from("asked", &asked),
            terms: graph.buffer_from("terms", &terms.map(|term| term.to_array())),
            found,
            push: prt_lobe::Push { count },
        };
        graph.compute(args, count);
        let read = graph.read_buffer(found);
        let found: Vec<[f32; 8]> = Runner::new(gpu).run(&graph).unwrap().buffer(read);
        for (asked, found) in asked.iter().zip(found) {
            let alpha = f64::from(asked[3]);
            let main = DVec3::new(found[0].into(), found[1].into(), found[2].into());
            assert!((main.length() - 1.0).abs() < 1e-5 && main.z > 0.0, "{asked:?} {main}");
            if alpha < 0.01 {
                let mirrored = DVec3::new(-f64::from(asked[0]), -f64::from(asked[1]), asked[2].into());
                assert!(main.distance(mirrored) < 0.01, "{asked:?} {main}");
            }
            let [cosine, square] = [1, 2].map(|power| over_lobe(main, alpha, |way| way.dot(main).powi(power)));
            assert!((f64::from(found[3]) - cosine).abs() < 5e-3, "{asked:?}: {} {cosine}", found[3]);
            assert!((f64::from(found[4]) - square).abs() < 5e-3, "{asked:?}: {} {square}", found[4]);
            // The frame of the z axis has the axes x and y.
            for channel in 0..3 {
                let radiance = |way: DVec3| {
                    let along =
                        zernike([way.x, way.y]).into_iter().zip(&terms).map(|(at, term)| at * f64::from(term[channel]));
                    1.0 + along.sum::<f64>()
                };
                let (wanted, found) = (over_lobe(main, alpha, radiance), f64::from(found[5 + channel]));
                assert!((found - wanted).abs() < 5e-3, "{asked:?} {channel}: {found} {wanted}");
            }
        }
    });
}

/// A room of two colours, with a floor of rough metal, lit from one side.
fn hall() -> Scene {
    let mut stage = Stage::new();
    let white = stage.material(Material::diffuse("white", Vec3::splat(0.6)));
    let red = stage.material(Material::diffuse("red", vec3(0.8, 0.1, 0.1)));
    let blue = stage.material(Material::diffuse("blue", vec3(0.1, 0.1, 0.8)));
    let metal = Material { metallic: 1.0, roughness: 0.5, ..Material::diffuse("metal", Vec3::splat(0.8)) };
    let metal = stage.material(metal);
    walls(&mut stage, [red, blue, metal, white, white, white]);
    stage.point(vec3(-1.0, 1.6, 0.2), Vec3::splat(5.0));
    stage.scene
}

fn evenly() -> PictureSettings {
    let mut settings = PictureSettings::default();
    settings.prt.directional = false;
    settings
}

/// Root mean square of the difference of the indirect light of blocks of 6×6 pixels, as a share of the mean of the second picture.
fn apart(ours: &Layers, theirs: &Layers) -> f32 {
    let [ours, theirs] = [ours, theirs].map(|layers| layers.layer("indirect").unwrap());
    let blocks = |data: &[f32]| -> Vec<f32> {
        let block = |at: usize| {
            let pixels = (0..36).map(|i| ((6 * (at / 8) + i / 6) * 48 + 6 * (at % 8) + i % 6) * 3);
            pixels.flat_map(|pixel| &data[pixel..pixel + 3]).sum::<f32>()
        };
        (0..48).map(block).collect()
    };
    let (ours, theirs) = (blocks(&ours.data), blocks(&theirs.data));
    let square: f32 = ours.iter().zip(&theirs).map(|(a, b)| (a - b).powi(2)).sum();
    (48.0 * square).sqrt() / theirs.iter().sum::<f32>()
}

fn floor_of(gpu: &Gpu, scene: &Scene, stored: &Stored, settings: &PictureSettings) -> Layers {
    picture(gpu, scene, stored, &over_the_floor(), settings, Mode::Total)
}

fn over_the_floor() -> View {
    view(vec3(1.6, 1.1, 0.3), vec3(-0.9, 0.0, -0.1), 60.0, [48, 36])
}

#[test]
fn a_metal_floor_shows_the_wall_behind_it_as_the_path_tracer_does() {
    with_gpu(|gpu| {
        let scene = hall();
        let stored = baked(gpu, &scene, &Baking { samples: 6000, cluster: 500, ..small() });
        let traced = Settings { bounces: 16, filter: Filter::Centre, ..Default::default() };
        let truth = render(gpu, &scene, &over_the_floor(), &traced, 512);
        let of = |settings: &PictureSettings| floor_of(gpu, &scene, &stored, settings);
        let (by_directions, by_none) = (of(&PictureSettings::default()), of(&evenly()));
        let [errors, evenly] = [&by_directions, &by_none].map(|found| apart(found, &truth));
        assert!(errors < 0.5 * evenly && errors < 0.12, "{errors}, {evenly} without directions");
        for (found, wanted) in mean(&by_directions, "indirect").into_iter().zip(mean(&truth, "indirect")) {
            assert!((found / wanted - 1.0).abs() < 0.08, "{found} {wanted}");
        }
        // Splats and vertices carry no directions, and take them from the samples.
        for spread in [Spread::Splats, Spread::Vertices] {
            let mut settings = PictureSettings::default();
            settings.prt.spread = spread;
            // A wall of four vertices has hardly any irradiance of its own.
            let most = if spread == Spread::Splats { 0.02 } else { 0.5 };
            let off = apart(&of(&settings), &by_directions);
            assert!(off < most, "{spread:?}: {off}");
        }
    });
}

#[test]
fn surfaces_without_gloss_and_bakes_without_directions_look_as_before() {
    with_gpu(|gpu| {
        let scene = hall();
        let few = Baking { samples: 1500, rays: 64, examples: 60, directional: 32, ..small() };
        let stored = baked(gpu, &scene, &few);
        let none = baked(gpu, &scene, &Baking { directional: 0, ..few.clone() });
        let of = |stored: &Stored, settings: &PictureSettings| {
            floor_of(gpu, &scene, stored, settings).layer("indirect").unwrap().data.clone()
        };
        let wanted = of(&stored, &evenly());
        assert_eq!(wanted, of(&none, &PictureSettings::default()));
        assert_ne!(wanted, of(&stored, &PictureSettings::default()));
        let mut matt = diffuse();
        let without = of(&stored, &matt);
        matt.prt.directional = false;
        assert_eq!(without, of(&stored, &matt));
        // 4 bytes for each kept ray, no more rays than there are.
        let count = stored.samples.len() as u64;
        assert_eq!((stored.summary().directional_bytes, none.summary().directional_bytes), (4 * 32 * count, 0));
        let all = baked(gpu, &scene, &Baking { directional: 1000, ..few });
        assert_eq!(all.summary().directional_bytes, 4 * 64 * all.samples.len() as u64);
    });
}

#[test]
fn even_light_has_no_direction() {
    with_gpu(|gpu| {
        // A lamp in the middle of a ball lights all of the ball alike.
        let mut stage = Stage::new();
        let metal = Material { metallic: 1.0, roughness: 0.4, ..Material::diffuse("metal", Vec3::splat(0.5)) };
        let metal = stage.material(metal);
        stage.sphere(metal, Vec3::ZERO, 1.0, 32, true);
        stage.point(Vec3::ZERO, Vec3::splat(3.0));
        let scene = stage.scene;
        let stored = baked(gpu, &scene, &Baking { samples: 2000, ..small() });
        // Seen from above, so that all pixels have the same share of light from everywhere alike.
        let eye = view(vec3(0.001, 0.0, 0.0), vec3(-0.4, -0.6, -0.5), 40.0, [24, 18]);
        let layers = picture(gpu, &scene, &stored, &eye, &PictureSettings::default(), Mode::Total);
        let matter = Matter { albedo: DVec3::ZERO, f0: DVec3::splat(0.5), roughness: 0.4 };
        let share = (matter.reflected(1.0, 64).x / PI) as f32;
        let [found, arriving] = ["indirect", "irradiance"].map(|name| &layers.layer(name).unwrap().data);
        let wanted: Vec<f32> = arriving.iter().map(|irradiance| irradiance * share).collect();
        let sum: f32 = wanted.iter().sum();
        let (mean, off) = found
            .iter()
            .zip(&wanted)
            .fold((0.0, 0.0), |(mean, off), (found, wanted)| (mean + found / sum, off + (found - wanted).abs() / sum));
        // The directional coefficients have the noise of 64 rays.
        assert!((mean - 1.0).abs() < 0.01 && off < 0.02, "{mean} {off}");
    });
}
