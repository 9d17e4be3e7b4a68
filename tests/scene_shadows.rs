//! Shadow maps against analytic shadows, and the exponential test against its closed form.

use crate::scene_kit::*;
use ash::vk;
use glam::{Mat4, Quat, Vec3};
use lucerna::{
    gpu::{ImageDesc, OwnedImage, Region, testing::with_gpu},
    graph::{Extent, Format, Graph, Runner},
    passes::{
        direct::{self, Direct, Lights},
        gbuffer,
        shadow::{self, Kind, Settings},
    },
    resident::Resident,
    scene::{AlphaMode, LightKind, Material, MipFilter, Sampler, Scene, Texture, TextureRef, View, Wrap},
    shaders::{passes::shadow_blur, test::exponential, test::shadow as shadow_probe, types},
};

const KINDS: [Kind; 3] = [Kind::Plain, Kind::Pcf, Kind::Exponential];

fn camera() -> View {
    view(Vec3::new(0.0, 6.0, 8.0), Vec3::ZERO, [64, 48])
}

/// Shadow factors of light 0 at points with normals.
fn factors(gpu: &lucerna::gpu::Gpu, scene: &Scene, settings: &Settings, at: &[(Vec3, Vec3)]) -> Vec<f32> {
    let probes: Vec<types::ShadowProbe> = at
        .iter()
        .map(|(world, normal)| types::ShadowProbe { world: world.to_array(), normal: normal.to_array(), factor: -1.0 })
        .collect();
    let (frame, read) = frame(gpu, scene, |graph, handles| {
        let maps = shadow::draw(graph, handles, &camera(), settings);
        assert!(maps.notes.is_empty());
        let probes = graph.buffer_from("probes", &probes);
        let args = shadow_probe::Args { probes, lights: maps.lights, shadows: maps.shadows, shadow_maps: maps.maps };
        graph.compute(args, at.len() as u32);
        graph.read_buffer(probes)
    });
    frame.buffer::<types::ShadowProbe>(read).iter().map(|p| p.factor).collect()
}

/// A square of side 1 at height 1 over a plane of side 8.
fn square_over_plane(material: Material) -> Scene {
    let mut scene = Scene::default();
    let ground = mesh(&mut scene, square(), Material::diffuse("", Vec3::ONE));
    let roof = mesh(&mut scene, square(), material);
    place(&mut scene, ground, Mat4::from_scale(Vec3::splat(4.0)));
    let lifted = Mat4::from_scale_rotation_translation(Vec3::splat(0.5), Quat::IDENTITY, Vec3::Y);
    place(&mut scene, roof, lifted);
    scene
}

const LIGHT_AT: Vec3 = Vec3::new(0.4, 3.0, -0.3);

fn lights() -> [(&'static str, LightKind); 4] {
    [
        ("directional", LightKind::Directional),
        ("point", LightKind::Point { range: None }),
        ("spot", LightKind::Spot { range: Some(20.0), inner: 0.5, outer: 1.1 }),
        ("wide spot", LightKind::Spot { range: None, inner: 0.5, outer: 1.5 }),
    ]
}

/// Where the segment from `point` to the light passes the height of the square.
fn crossing(kind: LightKind, point: Vec3) -> Vec3 {
    let to_light = match kind {
        LightKind::Directional => LIGHT_AT,
        _ => LIGHT_AT - point,
    };
    point + to_light / to_light.y
}

fn ground_points() -> Vec<(Vec3, Vec3)> {
    (0..900).map(|i| (Vec3::new((i % 30) as f32 * 0.1 - 1.5, 0.0, (i / 30) as f32 * 0.1 - 1.5), Vec3::Y)).collect()
}

#[test]
fn a_square_throws_its_analytic_shadow() {
    for (name, kind) in lights() {
        let mut scene = square_over_plane(Material::diffuse("", Vec3::ONE));
        light(&mut scene, kind, look(LIGHT_AT, Vec3::ZERO));
        with_gpu(|gpu| {
            for shadows in KINDS {
                let settings = Settings { kind: shadows, size: 512, ..Settings::default() };
                let points = ground_points();
                let got = factors(gpu, &scene, &settings, &points);
                let (mut dark, mut bright) = (0, 0);
                for ((point, _), factor) in points.iter().zip(got) {
                    let at = crossing(kind, *point);
                    let outside = at.x.abs().max(at.z.abs()) - 0.5;
                    let label = || format!("{name}, {shadows:?} at {point}: {factor}");
                    if outside < -0.07 {
                        assert!(factor < 0.01, "{}", label());
                        dark += 1;
                    } else if outside > 0.07 {
                        assert!(factor > 0.99, "{}", label());
                        bright += 1;
                    }
                    assert!((0.0..=1.0).contains(&factor), "{}", label());
                }
                assert!(dark > 40 && bright > 200, "{name}: {dark} dark, {bright} bright");
            }
        });
    }
}

#[test]
fn holes_in_masked_casters_let_light_through() {
    let mut material = Material::diffuse("", Vec3::ONE);
    material.alpha = AlphaMode::Mask { cutoff: 0.5 };
    let sampler = Sampler {
        wrap_u: Wrap::ClampToEdge,
        wrap_v: Wrap::ClampToEdge,
        mag_linear: false,
        min_linear: false,
        mip: MipFilter::None,
    };
    material.base_color_texture = Some(TextureRef { sampler, ..TextureRef::new(0) });
    let mut scene = square_over_plane(material);
    // The half with u < 1/2, that is x < 0, is open.
    let rgba = vec![[255, 255, 255, 0], [255, 255, 255, 255]];
    scene.textures.push(Texture { name: String::new(), width: 2, height: 1, rgba });
    let kind = LightKind::Spot { range: None, inner: 0.5, outer: 1.1 };
    light(&mut scene, kind, look(LIGHT_AT, Vec3::ZERO));
    with_gpu(|gpu| {
        let points = ground_points();
        let got = factors(gpu, &scene, &Settings { size: 512, ..Settings::default() }, &points);
        let mut seen = [0, 0];
        for ((point, _), factor) in points.iter().zip(got) {
            let at = crossing(kind, *point);
            if at.x.abs().max(at.z.abs()) < 0.43 && at.x.abs() > 0.07 {
                let open = at.x < 0.0;
                seen[usize::from(open)] += 1;
                assert!((factor - if open { 1.0 } else { 0.0 }).abs() < 0.01, "{point}: {factor}");
            }
        }
        assert!(seen[0] > 20 && seen[1] > 20);
    });
}

#[test]
fn a_filter_over_the_picture_smooths_shadows_and_stops_at_silhouettes() {
    let mut scene = square_over_plane(Material::diffuse("", Vec3::ONE));
    let lamps = [(LightKind::Point { range: None }, LIGHT_AT), (LightKind::Directional, Vec3::new(-0.6, 3.0, 0.8))];
    with_gpu(|gpu| {
        for (kind, at) in lamps {
            light(&mut scene, kind, look(at, Vec3::ZERO));
        }
        let few = usize::MAX;
        // `few`: nodes of the largest scene all of whose lights are filtered.
        let picture = |scene: &Scene, settings: &Settings, few: usize| {
            let (frame, (lit, depth)) = frame(gpu, scene, |graph, handles| {
                let surfaces = gbuffer::draw(graph, handles, &camera(), &gbuffer::Settings::default());
                let maps = shadow::draw(graph, handles, &camera(), settings);
                let told = maps.notes.iter().filter(|note| note.place == "shadow.screen_blur").count();
                assert_eq!(told, usize::from(settings.screen_blur > 0 && scene.nodes.len() > few));
                let choices = Direct { specular: false, ..Direct::default() };
                let lit = direct::light(graph, &surfaces, Lights::from(&maps), &choices).direct;
                (graph.read_image(lit), graph.read_image(surfaces.depth))
            });
            let values = |token| -> Vec<f32> { frame.image(token).to_f32().iter().map(|texel| texel[0]).collect() };
            (values(lit), values(depth))
        };
        for kind in [Kind::Plain, Kind::Pcf] {
            let hard = Settings { kind, size: 512, cascades: 1, ..Settings::default() };
            let soft = Settings { screen_blur: 4, ..hard };
            let ((before, depth), (after, _)) = (picture(&scene, &hard, few), picture(&scene, &soft, few));
            let sum = |light: &[f32]| light.iter().sum::<f32>();
            assert!((sum(&after) / sum(&before) - 1.0).abs() < 0.01, "{}", sum(&after) / sum(&before));
            let changed = before.iter().zip(&after).filter(|(a, b)| (*a - *b).abs() > 0.02 * **a).count();
            // The edges of two shadows, eight pixels wide.
            assert!((40..900).contains(&changed), "{kind:?}: {changed} pixels change");
            // The square is lit all over, and no shadow comes onto it from the ground behind its edges.
            let roof = (0..depth.len()).filter(|i| {
                let seen = scene_position(&camera(), *i, depth[*i]);
                (seen.y - 1.0).abs() < 0.01
            });
            let roof: Vec<usize> = roof.collect();
            assert!(roof.len() > 8, "{} pixels of the square", roof.len());
            for i in roof {
                assert!((after[i] / before[i] - 1.0).abs() < 2e-3, "{kind:?}, pixel {i}: {} {}", before[i], after[i]);
            }
        }
        // Without shadows there is nothing to filter.
        let off = Settings { kind: Kind::Off, ..Settings::default() };
        assert!(picture(&scene, &off, few) == picture(&scene, &Settings { screen_blur: 9, ..off }, few));
        // Seventeen lights with a map each. Their light is the sum of single ones, of which all but the last are filtered.
        let spot = LightKind::Spot { range: None, inner: 0.5, outer: 1.1 };
        let place = |k: u32| look(Vec3::new(0.1 * k as f32 - 0.8, 3.0, 0.05 * k as f32 - 0.4), Vec3::ZERO);
        let hard = Settings { kind: Kind::Plain, size: 128, ..Settings::default() };
        let soft = Settings { screen_blur: 4, ..hard };
        let mut all = square_over_plane(Material::diffuse("", Vec3::ONE));
        let mut sum = vec![0.0; 64 * 48];
        for k in 0..17 {
            light(&mut all, spot, place(k));
            let mut one = square_over_plane(Material::diffuse("", Vec3::ONE));
            light(&mut one, spot, place(k));
            let (single, _) = picture(&one, if k < 16 { &soft } else { &hard }, few);
            sum.iter_mut().zip(single).for_each(|(sum, one)| *sum += one);
        }
        let (found, _) = picture(&all, &soft, all.nodes.len() - 1);
        for (i, (found, sum)) in found.iter().zip(&sum).enumerate() {
            // Images of 16-bit floats.
            assert!((found - sum).abs() < 5e-3 * sum + 1e-4, "pixel {i}: {found} instead of {sum}");
        }
    });
}

/// Place of a pixel of linear depth `z`, world space.
fn scene_position(view: &View, pixel: usize, z: f32) -> Vec3 {
    let [width, height] = view.extent;
    let at = [(pixel as u32 % width, width), (pixel as u32 / width, height)]
        .map(|(p, n)| (p as f32 + 0.5) / n as f32 * 2.0 - 1.0);
    let through = view.clip_from_world.inverse().project_point3(Vec3::new(at[0], -at[1], 0.5)) - view.position;
    let [_, _, forward] = view.axes();
    view.position + through * (z * view.far / through.dot(forward))
}

#[test]
fn an_empty_room_has_no_shadow_on_its_walls() {
    // Neither at the seams of the six maps nor from the walls themselves.
    let mut scene = Scene::default();
    let wall = mesh(&mut scene, square(), Material::diffuse("", Vec3::ONE));
    let turns = [
        Quat::IDENTITY,
        Quat::from_rotation_x(PI),
        Quat::from_rotation_x(PI / 2.0),
        Quat::from_rotation_x(-PI / 2.0),
        Quat::from_rotation_z(PI / 2.0),
        Quat::from_rotation_z(-PI / 2.0),
    ];
    let mut points = Vec::new();
    for turn in turns {
        let wall_at = Mat4::from_rotation_translation(turn, turn * Vec3::NEG_Y * 2.0);
        place(&mut scene, wall, wall_at * Mat4::from_scale(Vec3::splat(2.0)));
        for i in 0..400 {
            let (x, z) = ((i % 20) as f32 * 0.2 - 1.9, (i / 20) as f32 * 0.2 - 1.9);
            points.push((wall_at.transform_point3(Vec3::new(x, 0.0, z)), turn * Vec3::Y));
        }
    }
    light(&mut scene, LightKind::Point { range: None }, Mat4::from_translation(Vec3::new(0.3, 0.8, -0.5)));
    with_gpu(|gpu| {
        for kind in KINDS {
            let settings = Settings { kind, size: 256, ..Settings::default() };
            for ((point, normal), factor) in points.iter().zip(factors(gpu, &scene, &settings, &points)) {
                assert!(factor > 0.97, "{kind:?} at {point} ({normal}): {factor}");
            }
        }
    });
}

#[test]
fn a_lamp_that_grazes_a_plane_leaves_no_stripes_of_its_own_shadow() {
    // The filter reaches two texels from the receiver, where the plane is nearer to the lamp by up to twenty times as much. A corner of the
    // filter reaches farther, where the plane falls along the diagonal of the map.
    for (turn, least) in [(Quat::IDENTITY, 0.999), (Quat::from_rotation_y(PI / 4.0) * Quat::from_rotation_x(0.6), 0.95)]
    {
        let mut scene = Scene::default();
        let ground = mesh(&mut scene, square(), Material::diffuse("", Vec3::ONE));
        place(&mut scene, ground, Mat4::from_quat(turn) * Mat4::from_scale(Vec3::splat(20.0)));
        light(&mut scene, LightKind::Point { range: None }, Mat4::from_translation(turn * Vec3::Y));
        let points: Vec<(Vec3, Vec3)> = (0..3600)
            .map(|i| Vec3::new((i % 60) as f32 * 0.631 - 18.7, 0.0, (i / 60) as f32 * 0.627 - 18.3))
            .map(|point| (turn * point, turn * Vec3::Y))
            .collect();
        with_gpu(|gpu| {
            for kind in [Kind::Plain, Kind::Pcf] {
                let settings = Settings { kind, ..Settings::default() };
                for ((point, _), factor) in points.iter().zip(factors(gpu, &scene, &settings, &points)) {
                    assert!(factor > least, "{kind:?} at {point}: {factor}");
                }
            }
        });
    }
}

#[test]
fn without_shadows_everything_is_lit_and_late_lights_are_named() {
    let mut scene = square_over_plane(Material::diffuse("", Vec3::ONE));
    for _ in 0..11 {
        light(&mut scene, LightKind::Point { range: None }, Mat4::from_translation(LIGHT_AT));
    }
    with_gpu(|gpu| {
        let off = Settings { kind: Kind::Off, ..Settings::default() };
        assert!(factors(gpu, &scene, &off, &ground_points()).iter().all(|f| *f == 1.0));
        let mut resident = Resident::new(gpu, &scene).unwrap();
        let mut graph = Graph::new("notes");
        let handles = resident.frame(&mut graph, &scene, 0.0);
        let maps = shadow::draw(&mut graph, &handles, &camera(), &Settings { size: 32, ..Settings::default() });
        let places: Vec<&str> = maps.notes.iter().map(|n| n.place.as_str()).collect();
        assert_eq!(places, ["lights[10]"], "ten cubes of six faces fit into 64 maps");
        Runner::new(gpu).run(graph).unwrap();
    });
}

/// A block `Shadows` of one slot.
fn shadows(graph: &mut Graph, size: u32, exponent: f32) -> lucerna::graph::Buffer {
    let header = types::ShadowSettings { size: size as f32, ..Default::default() };
    let mut words: Vec<u32> = bytemuck::cast_slice(&[header]).to_vec();
    words.extend_from_slice(bytemuck::cast_slice(&[types::ShadowSlot { exponent, ..Default::default() }; 64]));
    words.extend_from_slice(&[0, 1]);
    graph.buffer_from("shadows", &words)
}

#[test]
fn the_exponential_test_is_one_at_the_occluder_and_falls_to_zero() {
    let probes: Vec<types::DepthProbe> = (0..=200)
        .map(|i| types::DepthProbe { receiver: 0.2 + 0.004 * i as f32, occluder: 0.5, visibility: -1.0 })
        .collect();
    with_gpu(|gpu| {
        let mut graph = Graph::new("exponential");
        let buffer = graph.buffer_from("probes", &probes);
        let lights = graph.buffer_from("lights", &[0_u32; 64]);
        let maps = graph.image("maps", Format::R32F, Extent::square(1));
        graph.clear(maps, [0.0; 4]);
        let shadows = shadows(&mut graph, 1, 90.0);
        let args = exponential::Args { probes: buffer, lights, shadows, shadow_maps: maps.nearest() };
        graph.compute(args, probes.len() as u32);
        let read = graph.read_buffer(buffer);
        let frame = Runner::new(gpu).run(graph).unwrap();
        let got = frame.buffer::<types::DepthProbe>(read);
        for probe in &got {
            let behind = f64::from(probe.receiver) - f64::from(probe.occluder);
            let expected = if behind <= 0.0 { 1.0 } else { (-90.0 * behind).exp() };
            assert!((f64::from(probe.visibility) - expected).abs() < 1e-4, "{probe:?}, expected {expected}");
        }
        assert!(got.windows(2).all(|w| w[0].visibility >= w[1].visibility), "monotone");
        assert!(got[200].visibility < 1e-15, "far behind: nothing");
    });
}

/// Both directions of the prefilter on an image of `size`² linear depths.
fn prefiltered(image: &[f32], size: u32, deviation: f32) -> Vec<f32> {
    let mut out = Vec::new();
    with_gpu(|gpu| {
        let desc = ImageDesc::new(vk::Format::R32_SFLOAT, size, size);
        let bytes = bytemuck::cast_slice(image);
        let owned = OwnedImage::with_contents(gpu, "depths", desc, &[Region { mip: 0, layer: 0, bytes }]).unwrap();
        let mut graph = Graph::new("prefilter");
        let from = graph.import_image(&owned);
        let across = graph.image("across", Format::R32F, Extent::square(size));
        let filtered = graph.image("filtered", Format::R32F, Extent::square(size));
        let lights = graph.buffer_from("lights", &[0_u32; 64]);
        let shadows = shadows(&mut graph, size, 90.0);
        for (from, to, step) in [(from, across, [1, 0]), (across, filtered, [0, 1])] {
            let args = shadow_blur::Args {
                filtered: to,
                lights,
                shadows,
                shadow_maps: from.nearest(),
                push: shadow_blur::Push { step, radius: (2.0 * deviation).ceil() as i32, deviation, slots: 1 },
                spec: shadow_blur::Spec::default(),
            };
            graph.compute(args, [size, size, 1]);
        }
        let read = graph.read_image(filtered);
        let frame = Runner::new(gpu).run(graph).unwrap();
        out = frame.image(read).to_f32().iter().map(|p| p[0]).collect();
    });
    out
}

#[test]
fn the_prefilter_keeps_a_constant_and_is_the_logarithm_of_a_gaussian_of_exponentials() {
    for value in [0.0, 0.37, 1.0] {
        for got in prefiltered(&[value; 144], 12, 1.5) {
            assert!((got - value).abs() < 1e-6, "{got} is not {value}");
        }
    }
    // Depths from 0 to 1: exp(90) is beyond 32-bit floats, the twin in 64 bits is not.
    let size = 12_i32;
    let image: Vec<f32> = (0..size * size).map(|i| ((i * 37 + i * i * 11) % 101) as f32 / 100.0).collect();
    let (deviation, radius) = (1.5_f64, 3);
    let pass = |image: &[f64], dx: i32, dy: i32| -> Vec<f64> {
        (0..size * size)
            .map(|i| {
                let (x, y) = (i % size, i / size);
                let (mut sum, mut total) = (0.0, 0.0);
                for k in -radius..=radius {
                    let w = (-0.5 * (f64::from(k) / deviation).powi(2)).exp();
                    let (sx, sy) = ((x + k * dx).clamp(0, size - 1), (y + k * dy).clamp(0, size - 1));
                    sum += w * (90.0 * image[(sy * size + sx) as usize]).exp();
                    total += w;
                }
                (sum / total).ln() / 90.0
            })
            .collect()
    };
    let wide: Vec<f64> = image.iter().map(|v| f64::from(*v)).collect();
    let twin = pass(&pass(&wide, 1, 0), 0, 1);
    for (got, expected) in prefiltered(&image, size as u32, deviation as f32).iter().zip(twin) {
        assert!((f64::from(*got) - expected).abs() < 1e-4, "{got} {expected}");
    }
}
