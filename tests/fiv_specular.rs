//! Glossy reflection of an environment with the shadows of occluders: against closed forms, the slow twin, and brute
//! force.

use crate::fiv_lab::{Studio, ball, cap, colourful, ground, hierarchy, nrmse, occluder, one_ball, painted, thing};
use crate::tracer_lab::flat_view;
use glam::{DVec3, Mat3, Mat4, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::Runner,
    reference::fiv_specular::{self as twin, Surface},
    resident::Resident,
    scene::{Environment, Pose, Scene, View, ground as grounds},
    techniques::fiv::{
        Fiv, Method, Settings, Sky, Specular,
        cover::Cover,
        specular::{Cells, masks, words},
    },
};
use lucerna_scenes as builtin;

fn by(method: Method) -> Settings {
    Settings { method, specular: Specular::Summed, ..coarse() }
}

fn coarse() -> Settings {
    Settings { size: 16, azimuths: 32, polars: 17, radii: 15, largest: 1.0, ..Settings::default() }
}

/// A ground of this material with balls of radius 0.5 over it.
fn stage(environment: Environment, balls: &[Vec3], (roughness, metallic): (f32, f32)) -> Scene {
    let mut scene = Scene { environment: Some(environment), ..Scene::default() };
    ground(&mut scene, 20.0);
    for (i, at) in balls.iter().enumerate() {
        let (positions, indices) = ball(0.5, 12);
        thing(&mut scene, &format!("ball {i}"), positions, indices, Mat4::from_translation(*at));
    }
    shine(&mut scene, roughness, metallic);
    scene
}

/// Gives the ground, the first material, this gloss.
fn shine(scene: &mut Scene, roughness: f32, metallic: f32) {
    scene.materials[0].roughness = roughness;
    scene.materials[0].metallic = metallic;
    scene.materials[0].base_color = glam::Vec4::ONE;
}

/// Radiance of one point of the ground seen from a direction. The surface has the precision of the G-buffer.
fn glance(at: Vec3, eye: Vec3, (roughness, f0): (f32, f32)) -> (View, Surface) {
    let eye = eye.normalize();
    let kept = |x: f32| f64::from((x * 255.0).round() / 255.0);
    let view = flat_view(at + 0.3 * eye, at, 0.05, [1, 1]);
    let (point, normal, roughness) = (at + Vec3::Y * 1e-5, DVec3::Y, kept(roughness));
    (view, Surface { point, normal, eye: eye.as_dvec3().normalize(), f0: DVec3::splat(kept(f0)), roughness })
}

const EYES: [Vec3; 3] = [vec3(0.05, 1.0, 0.02), vec3(0.6, 0.7, 0.3), vec3(-0.9, 0.35, 0.1)];

/// Radiance of a pixel, and its glossy part.
fn pixel(gpu: &Gpu, scene: &Scene, view: &View, settings: &Settings) -> DVec3 {
    Studio::new(gpu, scene, settings, None).gloss(&Pose::rest(scene), view, settings)[0].as_dvec3()
}

#[test]
fn without_occluders_even_light_is_reflected_by_the_albedo_of_the_lobe() {
    with_gpu(|gpu| {
        for (roughness, metallic) in [(0.15f32, 1.0f32), (0.4, 1.0), (0.4, 0.0), (1.0, 1.0)] {
            let scene = stage(Environment::constant(vec3(2.0, 1.0, 0.0)), &[], (roughness, metallic));
            for method in [Method::Vectors, Method::Unshadowed, Method::BruteForce] {
                let settings = Settings { size: 32, ..by(method) };
                let mut studio = Studio::new(gpu, &scene, &settings, None);
                for eye in EYES {
                    let f0 = 0.04 + 0.96 * metallic;
                    let (view, surface) = glance(Vec3::ZERO, eye, (roughness, f0));
                    let found = studio.gloss(&Pose::rest(&scene), &view, &settings)[0].as_dvec3();
                    let exact = twin::albedo(&surface, 96).x;
                    let (red, green) = (found.x / (2.0 * exact), found.y / exact);
                    // Texels are wider than the lobe of the smoothest surface. At grazing view some of their light
                    // falls behind the surface.
                    let smooth = if surface.eye.y < 0.5 { 0.12 } else { 0.04 };
                    let slack = if roughness < 0.3 { smooth } else { 0.025 };
                    assert!(
                        (red - 1.0).abs() < slack && (green - 1.0).abs() < slack && found.z == 0.0,
                        "{method:?} {roughness} {metallic} {eye}: {found}, albedo {exact}"
                    );
                }
            }
        }
    });
}

#[test]
fn a_mirror_shows_the_environment() {
    with_gpu(|gpu| {
        // Radiance in the direction of the reflected ray: linear in the direction, so that the size of a texel changes
        // it little.
        let slopes = [vec3(0.5, 0.1, 0.0), vec3(0.0, 0.3, 0.4), vec3(-0.4, 0.3, 0.2)];
        let linear = painted(256, |d| Vec3::from_array(slopes.map(|a| 1.0 + a.dot(d.as_vec3()))));
        let scene = stage(linear, &[], (0.0, 1.0));
        for eye in &EYES[..2] {
            let (view, surface) = glance(Vec3::ZERO, *eye, (0.0, 1.0));
            let found = pixel(gpu, &scene, &view, &Settings { size: 64, ..by(Method::Unshadowed) });
            let there = (2.0 * surface.eye.y * DVec3::Y - surface.eye).as_vec3();
            for (channel, slope) in slopes.iter().enumerate() {
                let exact = f64::from(1.0 + slope.dot(there));
                assert!((found[channel] / exact - 1.0).abs() < 0.05, "{eye}: {found} instead of {exact}");
            }
        }
    });
}

#[test]
fn the_device_reflects_and_shades_as_the_twin_does() {
    with_gpu(|gpu| {
        let places = [vec3(0.3, 0.9, 0.0), vec3(-0.6, 0.7, 0.5)];
        // A roughness that eight bits represent exactly.
        let scene = stage(colourful(), &places, (0.4, 1.0));
        let sky = Sky::new(scene.environment.as_ref(), 16).unwrap();
        let truth = Studio::new(gpu, &scene, &by(Method::BruteForce), None);
        let geometry = lucerna::scene::bvh::Bvh::build(&scene, &Pose::rest(&scene));
        let (cells, mut truth) = (Cells::of(&sky), truth);
        // With the smaller reach most points lie beyond the last sphere of samples.
        let reaches = [by(Method::Vectors).reach, 2.0];
        for reach in reaches {
            let settings = Settings { reach, ..by(Method::Vectors) };
            let mut studio = Studio::new(gpu, &scene, &settings, None);
            let (plan, occluders) = (studio.fiv.plan().clone(), studio.fiv.occluders().clone());
            let (kind, shape) = (&plan.occluders[0], &occluders.kinds[0]);
            let points: Vec<Vec3> = (0..plan.grid.count()).map(|i| -kind.offset(&plan.grid, i).as_vec3()).collect();
            let mut cover = Cover::new(gpu, shape).unwrap();
            let mut runner = Runner::new(gpu);
            let shares =
                masks(&mut cover, &mut runner, &cells.weights, 16, &points, (Mat3::IDENTITY, shape.radius)).unwrap();
            let mut fivs = vec![];
            let light = lucerna::techniques::fiv::Light::new(gpu, &sky).unwrap();
            plan.compute(gpu, &light, &occluders.kinds, 0..u64::from(plan.grid.count()), |_, new| {
                fivs.extend_from_slice(new);
                Ok(true)
            })
            .unwrap();
            let (grid, shells, spacing) = (plan.grid, kind.shells, &kind.spacing);
            let set = twin::Masks { grid, shells, spacing, words: words(16) as usize, shares: &shares, fivs: &fivs };
            for at in [Vec3::ZERO, vec3(0.4, 0.0, 0.3), vec3(-1.1, 0.0, 0.2), vec3(6.0, 0.0, -5.0)] {
                for eye in EYES {
                    let (view, surface) = glance(at, eye, (0.4, 1.0));
                    let open = twin::reflected(&sky, &surface, None);
                    // Brute force has no samples.
                    if reach == reaches[0] {
                        let found = truth.gloss(&Pose::rest(&scene), &view, &by(Method::BruteForce))[0].as_dvec3();
                        let exact = twin::reflected(&sky, &surface, Some(&geometry));
                        assert!(
                            (found - exact).length() < 0.02 * open.length(),
                            "truth {at} {eye}: {found} instead of {exact}"
                        );
                    }
                    let hidden: Vec<Vec<f64>> = occluders
                        .placed
                        .iter()
                        .zip(&places)
                        .map(|(placed, place)| set.lookup((*place + placed.centre - at).as_dvec3()))
                        .collect();
                    let (whole, left) = twin::left(&cells.lobes, &surface, &hidden);
                    let exact = open * left / whole;
                    let found = studio.gloss(&Pose::rest(&scene), &view, &settings)[0].as_dvec3();
                    assert!((found - exact).length() < 5e-3 * open.length(), "{at} {eye}: {found} instead of {exact}");
                }
            }
        }
    });
}

#[test]
fn masks_of_cells_are_those_of_the_cpus_hierarchy() {
    with_gpu(|gpu| {
        let (scene, sky) = (one_ball(0.7, 10), Sky::new(Some(&colourful()), 24).unwrap());
        let (shape, _) = occluder(&scene);
        let cells = Cells::of(&sky);
        // The weights of each cell sum to one, and the cells contain all light.
        let mut sums = vec![0.0; cells.lobes.len()];
        for (i, weight) in cells.weights.iter().enumerate() {
            sums[lucerna::techniques::fiv::specular::cell(24, i as u32) as usize] += f64::from(*weight);
        }
        let used = 6 * 6 * 6;
        assert!(sums[..used].iter().all(|s| (s - 1.0).abs() < 1e-6) && sums[used..].iter().all(|s| *s == 0.0));
        let power: DVec3 = cells.lobes.iter().map(|l| Vec3::from(l.power).as_dvec3()).sum();
        let whole: DVec3 = sky
            .radiance
            .iter()
            .enumerate()
            .map(|(i, r)| {
                let (_, x, y) = lucerna::techniques::fiv::sky::place(24, i as u32);
                r.as_dvec3() * lucerna::techniques::fiv::sky::solid_angle(24, x, y)
            })
            .sum();
        assert!((power - whole).length() < 1e-5 * whole.length());
        let points = [vec3(0.0, -1.2, 0.1), vec3(2.0, 1.0, -0.5), vec3(-0.8, 0.1, 0.4), vec3(0.0, 9.0, 1.0)];
        let mut runner = Runner::new(gpu);
        for turn in [Mat3::IDENTITY, Mat3::from_rotation_x(0.8) * Mat3::from_rotation_z(2.0)] {
            let mut cover = Cover::new(gpu, &shape).unwrap();
            let found = masks(&mut cover, &mut runner, &cells.weights, 24, &points, (turn, shape.radius)).unwrap();
            assert_eq!(found.len(), points.len() * words(24) as usize);
            let mut turned = scene.clone();
            turned.nodes[0].local = lucerna::scene::Transform::Matrix(Mat4::from_mat3(turn));
            let exact_shape = occluder(&turned).0;
            for (point, found) in points.iter().zip(found.chunks_exact(words(24) as usize)) {
                let exact = twin::hidden(24, &cells.weights, cells.lobes.len(), &hierarchy(&exact_shape), *point);
                let apart = exact
                    .iter()
                    .enumerate()
                    .map(|(cell, exact)| (f64::from(found[cell / 4].to_le_bytes()[cell % 4]) / 255.0 - exact).abs());
                // A ray that touches an edge may pass on the other side of it.
                let (most, sum) = apart.fold((0.0, 0.0), |(m, s): (f64, f64), a| (m.max(a), s + a));
                assert!(most < 0.3 && sum < 1.0, "{point}: {most} {sum}");
                assert!(exact.iter().sum::<f64>() > 0.5 || point.y > 5.0);
            }
        }
    });
}

#[test]
fn occluders_take_light_and_never_more_than_there_is() {
    with_gpu(|gpu| {
        let places = [vec3(0.0, 0.8, 0.0), vec3(0.1, 0.9, 0.1), vec3(1.2, 0.3, 0.4), vec3(-0.5, 2.0, -0.8)];
        for (roughness, environment) in [(0.2, colourful()), (0.7, colourful()), (0.4, cap(60, 20.0).0)] {
            let scene = stage(environment, &places, (roughness, 1.0));
            let view = flat_view(vec3(3.0, 2.0, 4.0), Vec3::ZERO, 6.0, [24, 24]);
            let [open, found] = [Method::Unshadowed, Method::Vectors].map(|method| {
                Studio::new(gpu, &scene, &by(method), None).gloss(&Pose::rest(&scene), &view, &by(method))
            });
            let mut less = 0;
            for (open, found) in open.iter().zip(&found) {
                assert!(found.is_finite() && found.min_element() >= 0.0 && (*found - *open).max_element() <= 0.0);
                less += u32::from(found.max_element() < 0.9 * open.max_element());
            }
            assert!(less > 10, "{less}");
        }
    });
}

#[test]
fn where_all_light_is_hidden_nothing_shines() {
    with_gpu(|gpu| {
        // A light of 10 degrees around the zenith, which a ball hides from below.
        let scene = stage(cap(28, 50.0).0, &[vec3(0.0, 1.0, 0.0)], (0.5, 1.0));
        let settings = by(Method::Vectors);
        let mut studio = Studio::new(gpu, &scene, &settings, None);
        let mut open = Studio::new(gpu, &scene, &by(Method::Unshadowed), None);
        for eye in EYES {
            let (view, _) = glance(vec3(0.02, 0.0, 0.01), eye, (0.5, 1.0));
            let dark = studio.gloss(&Pose::rest(&scene), &view, &settings)[0].x;
            let lit = open.gloss(&Pose::rest(&scene), &view, &by(Method::Unshadowed))[0].x;
            assert!(lit > 0.0 && dark < 1e-3 * lit, "{eye}: {dark} of {lit}");
            let (view, _) = glance(vec3(4.0, 0.0, 1.0), eye, (0.5, 1.0));
            let beside = studio.gloss(&Pose::rest(&scene), &view, &settings)[0].x;
            let lit = open.gloss(&Pose::rest(&scene), &view, &by(Method::Unshadowed))[0].x;
            assert!((beside / lit - 1.0).abs() < 1e-3, "{eye}: {beside} of {lit}");
        }
    });
}

/// Emission that marks objects other than the ground.
const BRIGHT: f32 = 1e4;

/// NRMSE of the glossily reflected light where the ground is visible: by vectors, and without shadows. And the sum of
/// both lights.
fn errors(gpu: &Gpu, scene: &Scene, view: &View, base: &Settings) -> (f64, f64, f64) {
    let gloss = |method: Method| {
        let settings = Settings { method, specular: Specular::Summed, ..base.clone() };
        let mut studio = Studio::new(gpu, scene, &settings, None);
        studio.gloss(&Pose::rest(scene), view, &settings)
    };
    let truth = gloss(Method::BruteForce);
    let plain = Settings { method: Method::Unshadowed, ..base.clone() };
    let shown = Studio::new(gpu, scene, &plain, None).shot(&Pose::rest(scene), view, &plain).1;
    let open = gloss(Method::Unshadowed);
    let seen: Vec<bool> = open.iter().zip(shown).map(|(p, s)| p.max_element() > 0.0 && s.x < BRIGHT).collect();
    let only = |p: Vec<Vec3>| -> Vec<Vec3> { p.into_iter().zip(&seen).filter(|(_, s)| **s).map(|(p, _)| p).collect() };
    let (truth, found, open) = (only(truth), only(gloss(Method::Vectors)), only(open));
    let sum = |p: &[Vec3]| p.iter().map(|p| f64::from(p.element_sum())).sum::<f64>();
    (nrmse(&truth, &found), nrmse(&truth, &open), sum(&found) / sum(&truth))
}

#[test]
fn shadows_in_reflections_come_close_to_brute_force() {
    with_gpu(|gpu| {
        for (name, light, most, roughness) in [("queen", "areas", 0.03, 0.7), ("hare", "grove", 0.06, 0.2)] {
            let mut scene = grounds::on_ground(&[builtin::load(name).unwrap()], &Default::default()).unwrap();
            scene.environment = Some(builtin::environment(light).unwrap());
            // Objects are recognised by their emission, so only the ground is compared.
            let camera = scene.cameras.iter().position(|c| c.name == "front").unwrap();
            let view = View::of_camera(&scene, &Pose::rest(&scene), camera, [24, 24]).unwrap();
            for material in scene.materials.iter_mut().skip(1) {
                material.emissive = Vec3::splat(2.0 * BRIGHT);
            }
            shine(&mut scene, roughness, 1.0);
            let (error, open, energy) = errors(gpu, &scene, &view, &coarse());
            eprintln!(
                "{name}, {light}, roughness {roughness}: NRMSE {error:.4}, unshadowed {open:.4}, light {energy:.3}"
            );
            assert!(error < most && error < 0.7 * open && (energy - 1.0).abs() < 0.1, "{error} {open} {energy}");
        }
    });
}

#[test]
fn occluders_that_turn_shade_reflections_as_those_that_are_made_turned() {
    with_gpu(|gpu| {
        let body = |turn: Mat3, at: Mat4| {
            let mut scene = Scene { environment: Some(colourful()), ..Scene::default() };
            ground(&mut scene, 20.0);
            let (mut positions, indices) = ball(0.5, 10);
            positions.iter_mut().for_each(|p| *p = turn * (*p * vec3(1.2, 0.3, 0.25) + vec3(0.2, 0.0, 0.0)));
            thing(&mut scene, "bar", positions, indices, Mat4::from_translation(vec3(0.0, 0.9, 0.0)) * at);
            shine(&mut scene, 0.3, 1.0);
            scene
        };
        let axis = lucerna::techniques::fiv::occluder_rotation::Axis::new(vec3(0.3, 0.2, 1.0)).unwrap();
        let direction = axis.direction().as_vec3();
        let settings = Settings { turns: 8, turn_axis: axis, adaptive: false, ..by(Method::Vectors) };
        let view = flat_view(vec3(3.0, 0.7, 0.0), Vec3::ZERO, 2.0, [24, 16]);
        let resting = body(Mat3::IDENTITY, Mat4::IDENTITY);
        let mut studio = Studio::new(gpu, &resting, &settings, None);
        for (angle, slack) in [(0.75 * std::f32::consts::PI, 0.01), (1.2, 0.06)] {
            let turn = Mat3::from_axis_angle(direction, angle);
            let made = body(turn, Mat4::IDENTITY);
            let one = Settings { turns: 1, ..settings.clone() };
            let mut other = Studio::new(gpu, &made, &one, None);
            let exact = other.gloss(&Pose::rest(&made), &view, &one);
            let exact_light = other.shot(&Pose::rest(&made), &view, &one).0;
            let mut pose = Pose::rest(&resting);
            pose.world[1] *= Mat4::from_mat3(turn);
            let (found, rest) =
                (studio.gloss(&pose, &view, &settings), studio.gloss(&Pose::rest(&resting), &view, &settings));
            let (error, other) = (nrmse(&exact, &found), nrmse(&exact, &rest));
            eprintln!("turned by {angle}: {error:.4} from one made so, {other:.4} at rest");
            assert!(error < slack && error < 0.5 * other, "{angle}: {error} {other}");
            // The irradiance must be equal too, with the bar's shadow on itself.
            let light = studio.shot(&pose, &view, &settings).0;
            let still = studio.shot(&Pose::rest(&resting), &view, &settings).0;
            let (error, other) = (nrmse(&exact_light, &light), nrmse(&exact_light, &still));
            eprintln!("irradiance: {error:.4}, {other:.4} at rest");
            assert!(error < slack && error < 0.5 * other, "{angle}: {error} {other}");
        }
    });
}

#[test]
fn what_cannot_be_had_is_refused() {
    let wrong = Settings { method: Method::Online, specular: Specular::Summed, ..coarse() };
    let error = wrong.validate().unwrap_err();
    assert!(error.exit_code() == 2 && error.to_string().contains("specular"), "{error}");
}

#[test]
fn more_occluders_than_can_be_reflected_are_refused_before_anything_is_computed() {
    with_gpu(|gpu| {
        let mut scene = Scene { environment: Some(colourful()), ..Scene::default() };
        let (positions, indices) = ball(0.1, 3);
        let node = thing(&mut scene, "ball", positions, indices, Mat4::IDENTITY);
        let first = scene.nodes[node as usize].clone();
        scene.nodes.extend(vec![first.clone(); 829]);
        let settings = Settings { size: 8, azimuths: 3, polars: 2, radii: 2, ..by(Method::Vectors) };
        // The largest number of occluders that can be drawn.
        let view = flat_view(Vec3::Y * 10.0, Vec3::ZERO, 3.0, [2, 2]);
        Studio::new(gpu, &scene, &settings, None).gloss(&Pose::rest(&scene), &view, &settings);
        scene.nodes.push(first);
        let resident = Resident::new(gpu, &scene).unwrap();
        let error = Fiv::new(gpu, &scene, &resident, &settings, None, |_, _| panic!("computed")).unwrap_err();
        assert!(
            error.exit_code() == 1 && error.to_string().contains("831 occluders; fiv.specular allows at most 830"),
            "{error}"
        );
    });
}

#[test]
fn what_is_told_of_vectors_and_reflections_goes_to_one_end() {
    with_gpu(|gpu| {
        let mut scene = Scene { environment: Some(colourful()), ..Scene::default() };
        let (positions, indices) = ball(0.5, 6);
        thing(&mut scene, "ball", positions, indices, Mat4::IDENTITY);
        let resident = Resident::new(gpu, &scene).unwrap();
        let settings = Settings { size: 8, azimuths: 8, polars: 5, radii: 4, ..by(Method::Vectors) };
        let mut told = Vec::new();
        Fiv::new(gpu, &scene, &resident, &settings, None, |done, all| {
            told.push((done, all));
            true
        })
        .unwrap();
        let (end, all) = *told.last().unwrap();
        assert!(end == all && told.len() > 1, "{told:?}");
        assert!(told.windows(2).all(|pair| pair[0].0 < pair[1].0) && told.iter().all(|t| t.1 == all), "{told:?}");
    });
}
