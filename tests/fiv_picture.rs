//! Pictures by fullsphere irradiance vectors against brute force, closed forms and symmetries.

use std::f64::consts::PI;

use crate::fiv_lab::{Studio, ball, colourful, ground, nrmse, thing};
use crate::tracer_lab::flat_view;
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    reference::fiv as twin,
    resident::Resident,
    scene::{Environment, Light, LightKind, Node, Pose, Scene, View},
    techniques::fiv::{Cut, Extent, Fiv, Interpolation, Method, SelfSamples, Settings, Shared, Sky},
};

fn coarse() -> Settings {
    Settings { size: 16, azimuths: 32, polars: 17, radii: 15, largest: 1.0, ..Settings::default() }
}

fn by(method: Method) -> Settings {
    Settings { method, ..coarse() }
}

/// A ground with balls of radius 0.5 over it.
fn stage(environment: Environment, balls: &[Vec3]) -> Scene {
    let mut scene = Scene { environment: Some(environment), ..Scene::default() };
    ground(&mut scene, 20.0);
    for (i, at) in balls.iter().enumerate() {
        let (positions, indices) = ball(0.5, 12);
        thing(&mut scene, &format!("ball {i}"), positions, indices, Mat4::from_translation(*at));
    }
    scene
}

/// The ground from under the balls: 3 m around the origin, looked at from close above.
fn under(extent: u32) -> View {
    flat_view(vec3(0.0, 0.2, 0.0), Vec3::ZERO, 3.0, [extent; 2])
}

#[test]
fn without_occluders_light_is_the_table_and_brute_force_agrees() {
    with_gpu(|gpu| {
        let scene = stage(colourful(), &[]);
        let sky = Sky::new(scene.environment.as_ref(), 16).unwrap();
        let exact = twin::irradiance(&sky, glam::DVec3::Y).as_vec3();
        for method in [Method::Vectors, Method::Unshadowed, Method::BruteForce] {
            let mut studio = Studio::new(gpu, &scene, &by(method), None);
            let (irradiance, total) = studio.shot(&Pose::rest(&scene), &under(8), &by(method));
            for (e, l) in irradiance.iter().zip(&total) {
                // The irradiance map is interpolated.
                assert!((*e - exact).length() < 5e-3 * exact.length(), "{method:?}: {e} instead of {exact}");
                // Albedo is stored in eight bits.
                let reflected = 0.5 * *e / PI as f32;
                assert!((*l - reflected).length() < 0.01 * reflected.length(), "{l} {reflected}");
            }
        }
    });
}

/// Hidden occluders darken the ground as shown ones do, and ground behind them is seen.
#[test]
fn hidden_occluders_cast_shadows_and_hide_nothing() {
    with_gpu(|gpu| {
        let scene = stage(colourful(), &[vec3(0.0, 0.8, 0.0)]);
        // From above the ball, so that it covers the middle of the picture.
        let over = flat_view(vec3(0.0, 4.0, 0.0), Vec3::ZERO, 3.0, [24; 2]);
        for method in [Method::Vectors, Method::BruteForce, Method::Online] {
            let settings = by(method);
            let hidden = Settings { hide_occluders: true, ..settings.clone() };
            let mut studio = Studio::new(gpu, &scene, &settings, None);
            let from_below = studio.irradiance(&under(24), &settings);
            let shown = studio.irradiance(&over, &settings);
            let bare = studio.irradiance(&over, &hidden);
            let middle = 12 * 24 + 12;
            assert!(
                (shown[middle] - bare[middle]).length() > 0.05 * bare[middle].length(),
                "{method:?}: the ball is hidden"
            );
            for (i, (ground, bare)) in from_below.iter().zip(&bare).enumerate() {
                assert!((*ground - *bare).length() < 2e-3 * ground.length(), "{method:?}, pixel {i}: {ground} {bare}");
            }
        }
    });
}

#[test]
fn vectors_come_close_to_brute_force() {
    with_gpu(|gpu| {
        let scene = stage(colourful(), &[vec3(0.2, 0.9, 0.1)]);
        let mut truth = Studio::new(gpu, &scene, &by(Method::BruteForce), None);
        let reference = truth.irradiance(&under(24), &by(Method::BruteForce));
        let error = |settings: &Settings| {
            let found = Studio::new(gpu, &scene, settings, None).irradiance(&under(24), settings);
            nrmse(&reference, &found)
        };
        let mut studio = Studio::new(gpu, &scene, &coarse(), None);
        let [coarse, nearest] = [true, false]
            .map(|trilinear| nrmse(&reference, &studio.irradiance(&under(24), &Settings { trilinear, ..coarse() })));
        let fine = error(&Settings { size: 16, ..Settings::default() });
        let unshadowed = error(&by(Method::Unshadowed));
        eprintln!("NRMSE: coarse {coarse:.4}, fine {fine:.4}, nearest {nearest:.4}, unshadowed {unshadowed:.4}");
        assert!(coarse < 0.06 && fine < coarse && coarse < nearest && nearest < 0.5 * unshadowed);
    });
}

#[test]
fn shadows_of_disjoint_occluders_add_and_their_order_is_nothing() {
    with_gpu(|gpu| {
        let places = [vec3(-0.8, 0.9, 0.2), vec3(0.9, 1.1, -0.6), vec3(0.1, 1.5, 0.9)];
        // Pictures by vectors are held against each other, so few samples are enough.
        let few = || Settings { azimuths: 16, polars: 9, radii: 8, ..coarse() };
        let settings = Settings { overlap: false, ..few() };
        let render = |balls: &[Vec3], settings: &Settings| {
            Studio::new(gpu, &stage(colourful(), balls), settings, None).irradiance(&under(12), settings)
        };
        let open = render(&[], &settings);
        let each = places.map(|p| render(&[p], &settings));
        let all = render(&places, &settings);
        for (i, e) in all.iter().enumerate() {
            let left = open[i] - each.iter().map(|single| open[i] - single[i]).sum::<Vec3>();
            assert!((*e - left.max(Vec3::ZERO)).length() < 1e-4 * open[i].length(), "{e} instead of {left}");
        }
        // With the overlap correction the order of occluders has no effect.
        let settings = few();
        let (one, other) = (render(&places, &settings), render(&[places[2], places[0], places[1]], &settings));
        for (i, (a, b)) in one.iter().zip(&other).enumerate() {
            assert!((*a - *b).length() < 1e-5 * open[i].length(), "{a} {b}");
            assert!(a.cmpge(all[i] - 1e-4 * open[i]).all(), "the correction never darkens: {a} {}", all[i]);
        }
        // With filled discs, several occluders at one place hide as much as a single one.
        let settings = Settings { shared: Shared::Discs, ..few() };
        // The same holds for occluders whose distances are roundings.
        let (one, many) = (render(&places[..1], &settings), render(&[places[0]; 5], &settings));
        let roundings = [0.0, 1e-7, -2e-7, 4e-7, -1e-6].map(|d| places[0] + d * vec3(1.0, 0.7, -0.4));
        let near = render(&roundings, &settings);
        for (i, (a, b)) in one.iter().zip(&many).chain(one.iter().zip(&near)).enumerate() {
            let (a, b, open) = (*a, *b, open[i % one.len()].length());
            assert!((a - b).length() < 2e-3 * open, "{a} {b} of {open}");
        }
    });
}

#[test]
fn an_occluder_that_sinks_into_the_ground_fades_without_a_step() {
    with_gpu(|gpu| {
        let scene = stage(colourful(), &[vec3(0.0, 1.0, 0.0)]);
        let settings = coarse();
        let mut studio = Studio::new(gpu, &scene, &settings, None);
        let view = flat_view(vec3(0.9, 0.05, 0.2), vec3(0.9, 0.0, 0.2), 0.2, [2, 2]);
        let mut pose = Pose::rest(&scene);
        let mut last: Option<Vec3> = None;
        let open =
            Studio::new(gpu, &scene, &by(Method::Unshadowed), None).irradiance(&view, &by(Method::Unshadowed))[0];
        for step in 0..=60 {
            let height = 0.8 - 0.025 * step as f32;
            pose.world[1].w_axis.y = height;
            let e = studio.shot(&pose, &view, &settings).0[0];
            if let Some(before) = last {
                assert!((e - before).length() < 0.06 * open.length(), "{height}: {before} to {e}");
            }
            if height <= -0.5 {
                assert!((e - open).length() < 1e-5 * open.length(), "{height}: {e} instead of {open}");
            }
            last = Some(e);
        }
    });
}

#[test]
fn a_convex_body_does_not_shadow_itself() {
    with_gpu(|gpu| {
        let mut scene = stage(colourful(), &[Vec3::ZERO]);
        scene.nodes.remove(0);
        let ball = &mut scene.meshes[1].primitives[0];
        ball.normals = ball.positions.iter().map(|p| p.normalize()).collect();
        let view = flat_view(vec3(0.0, 3.0, 0.0), Vec3::ZERO, 0.7, [16, 16]);
        let picture = |settings: &Settings| Studio::new(gpu, &scene, settings, None).irradiance(&view, settings);
        let open = picture(&by(Method::Unshadowed));
        let found = picture(&coarse());
        // Near the horizon of the sun the shadow is coarse, because vertices are a seventh of a right angle apart.
        let ratios: Vec<f32> = found.iter().zip(&open).map(|(e, o)| (*e / *o).min_element()).collect();
        let mean_ratio = ratios.iter().sum::<f32>() / ratios.len() as f32;
        assert!(mean_ratio > 0.98 && ratios.iter().all(|r| (0.85..1.0001).contains(r)), "{mean_ratio} {ratios:?}");
        // The method of the thesis: a sample above the surface sees a part of the environment behind the surface, and
        // this light is subtracted. Under constant radiance the share is 1 - (R / ρ)².
        let spheres = Settings { self_samples: SelfSamples::Spheres, ..coarse() };
        let mean = |p: &[Vec3]| p.iter().copied().sum::<Vec3>() / p.len() as f32;
        let ratio =
            |radii: u32, reach: f32| mean(&picture(&Settings { radii, reach, ..spheres.clone() })) / mean(&open);
        let (far, near) = (ratio(15, 16.0), ratio(60, 4.0));
        eprintln!("self-shadowed over unshadowed, a ball: {far}, with spheres closer together {near}");
        assert!(far.min_element() > 0.6 && near.min_element() > 0.9 && near.max_element() <= 1.0001, "{far} {near}");
        assert!(near.cmpge(far).all());
        let off = picture(&Settings { self_shadow: false, ..coarse() });
        for (a, b) in off.iter().zip(&open) {
            assert!((*a - *b).length() < 1e-5 * b.length(), "{a} {b}");
        }
    });
}

#[test]
fn a_body_with_a_hollow_shadows_itself_as_by_brute_force() {
    with_gpu(|gpu| {
        // A ball over a wide bowl, one mesh; and its mirror image.
        for local in [Mat4::IDENTITY, Mat4::from_scale(vec3(-1.0, 1.0, 1.0))] {
            let (mut positions, mut indices) = ball(0.25, 16);
            positions.iter_mut().for_each(|p| p.y += 0.1);
            let (bowl, triangles) = ball(0.6, 24);
            let first = positions.len() as u32;
            let low = |i: &u32| bowl[*i as usize].y < -0.02;
            positions.extend(bowl.iter().copied());
            for corner in triangles.chunks_exact(3).filter(|c| c.iter().all(low)) {
                indices.extend(corner.iter().map(|i| i + first));
            }
            let mut scene = Scene { environment: Some(colourful()), ..Scene::default() };
            thing(&mut scene, "bowl", positions, indices, local);
            scene.materials[0].double_sided = true;
            let view = flat_view(vec3(0.4, 2.0, 0.5), Vec3::ZERO, 1.3, [24, 24]);
            let picture = |settings: &Settings| Studio::new(gpu, &scene, settings, None).irradiance(&view, settings);
            let truth = picture(&by(Method::BruteForce));
            let error = |settings: &Settings| nrmse(&truth, &picture(settings));
            let (surface, online) = (error(&coarse()), error(&by(Method::Online)));
            eprintln!("NRMSE of a body's shadow on itself: {surface:.4}, in the frame {online:.4}");
            // A ray that touches an edge may pass on the other side of it.
            assert!(surface < 0.05 && online < 0.005, "{local}: {surface} {online}");
            let none = error(&Settings { self_shadow: false, ..coarse() });
            assert!(surface < 0.5 * none, "{local}: {surface} {none}");
            if local == Mat4::IDENTITY {
                let spheres = error(&Settings { self_samples: SelfSamples::Spheres, ..coarse() });
                eprintln!("from spheres {spheres:.4}, without {none:.4}");
                assert!(surface < 0.5 * spheres, "{surface} {spheres}");
            }
        }
    });
}

/// A box with its own vertices for each side.
fn box_of(low: Vec3, high: Vec3) -> (Vec<Vec3>, Vec<u32>) {
    let (mut positions, mut indices) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        for upper in [false, true] {
            let first = positions.len() as u32;
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (a, b) in [(false, false), (true, false), (true, true), (false, true)] {
                let mut corner = if upper { high } else { low };
                corner[u] = if a { high[u] } else { low[u] };
                corner[v] = if b { high[v] } else { low[v] };
                positions.push(corner);
            }
            let order = if upper { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
            indices.extend(order.map(|k| first + k));
        }
    }
    (positions, indices)
}

#[test]
fn a_corner_inside_another_part_leaves_the_light_of_the_surface_as_it_is() {
    with_gpu(|gpu| {
        // A slab, and a low post around one of its corners: the light there is not known.
        let (mut positions, mut indices) = box_of(vec3(-1.0, -0.1, -1.0), vec3(1.0, 0.0, 1.0));
        let (post, triangles) = box_of(vec3(0.9, -0.2, 0.9), vec3(1.1, 0.1, 1.1));
        indices.extend(triangles.iter().map(|i| i + positions.len() as u32));
        positions.extend(post);
        let mut scene = Scene { environment: Some(Environment::constant(vec3(1.0, 0.8, 0.6))), ..Scene::default() };
        thing(&mut scene, "slab", positions, indices, Mat4::IDENTITY);
        let view = flat_view(vec3(0.0, 3.0, 0.0), Vec3::ZERO, 1.6, [16, 16]);
        let picture = |settings: &Settings| Studio::new(gpu, &scene, settings, None).irradiance(&view, settings);
        let open = picture(&by(Method::Unshadowed));
        let found = picture(&coarse());
        for (e, o) in found.iter().zip(&open) {
            let share = *e / *o;
            assert!(share.min_element() > 0.97 && share.max_element() < 1.001, "{share} of the open light");
        }
    });
}

#[test]
fn light_that_a_bowl_keeps_from_itself_is_hidden_less_by_what_stands_beside_it() {
    with_gpu(|gpu| {
        let (bowl, triangles) = ball(0.6, 24);
        let low = |i: &u32| bowl[*i as usize].y < 0.15;
        let triangles = triangles.chunks_exact(3).filter(|c| c.iter().all(low)).flatten().copied().collect();
        let mut scene = Scene { environment: Some(colourful()), ..Scene::default() };
        thing(&mut scene, "bowl", bowl, triangles, Mat4::IDENTITY);
        scene.materials[0].double_sided = true;
        let (positions, indices) = ball(0.3, 16);
        thing(&mut scene, "ball", positions, indices, Mat4::from_translation(vec3(0.95, -0.1, 0.0)));
        let settings = Settings { largest: 1.0, ..coarse() };
        let view = flat_view(vec3(0.0, 0.3, 0.0), Vec3::ZERO, 0.7, [20, 20]);
        let picture = |settings: &Settings| Studio::new(gpu, &scene, settings, None).irradiance(&view, settings);
        let sum = |pixels: &[Vec3]| pixels.iter().map(|p| f64::from(p.element_sum())).sum::<f64>();
        let truth = sum(&picture(&Settings { method: Method::BruteForce, ..settings.clone() }));
        let open = sum(&picture(&Settings { method: Method::Unshadowed, ..settings.clone() }));
        let once = sum(&picture(&settings));
        let twice = sum(&picture(&Settings { overlap: false, ..settings }));
        println!("open {:.3}, once {:.3}, twice {:.3} of the truth", open / truth, once / truth, twice / truth);
        assert!(truth - once < 0.75 * (truth - twice), "{once} and {twice} of {truth}");
    });
}

#[test]
fn what_stands_on_the_ground_is_not_cut_by_it() {
    with_gpu(|gpu| {
        // A cone on its base: its bounding sphere reaches far below the ground.
        let mut scene = Scene { environment: Some(colourful()), ..Scene::default() };
        ground(&mut scene, 20.0);
        let ring = |i: u32| glam::Vec2::from_angle(i as f32 * std::f32::consts::TAU / 24.0).extend(0.0) * 0.6;
        let mut positions: Vec<Vec3> = (0..24).map(|i| vec3(ring(i).x, 0.001, ring(i).y)).collect();
        positions.extend([vec3(0.0, 1.4, 0.0), vec3(0.0, 0.001, 0.0)]);
        let indices = (0..24).flat_map(|i| [i, 24, (i + 1) % 24, (i + 1) % 24, 25, i]).collect();
        thing(&mut scene, "cone", positions, indices, Mat4::IDENTITY);
        scene.materials[1].double_sided = true;
        let view = flat_view(vec3(-1.5, 2.0, 1.3), vec3(-0.9, 0.0, 0.7), 0.8, [16, 16]);
        let picture = |settings: &Settings| Studio::new(gpu, &scene, settings, None).irradiance(&view, settings);
        let truth = picture(&by(Method::BruteForce));
        let error = |extent: Extent| {
            // Only `Cut::Height` depends on the extent. With `Cut::Light` the bounding sphere does nearly as well.
            let settings = Settings { azimuths: 64, polars: 33, extent, cut: Cut::Height, ..coarse() };
            nrmse(&truth, &picture(&settings))
        };
        let (hull, sphere) = (error(Extent::Hull), error(Extent::Sphere));
        eprintln!("NRMSE beside a cone on the ground: {hull:.4}, by its bounding sphere {sphere:.4}");
        assert!(hull < 0.2 && hull < 0.7 * sphere);
    });
}

#[test]
fn pictures_are_what_the_twin_looks_up() {
    with_gpu(|gpu| {
        let places = [vec3(0.0, 1.6, 0.0), vec3(0.0, 1.6, 0.0), vec3(0.9, 0.8, 0.4), vec3(3.0, 0.2, 2.0)];
        let default = coarse().reach;
        // With the smaller reach most points lie beyond the last sphere of samples.
        let ways =
            [(Interpolation::SolidAngle, default), (Interpolation::Linear, default), (Interpolation::SolidAngle, 2.0)];
        for (interpolation, reach) in ways {
            let scene = stage(colourful(), &places);
            let adaptive = interpolation == Interpolation::SolidAngle;
            let cut = if adaptive { Cut::Light } else { Cut::Height };
            let settings = Settings { interpolation, adaptive, extent: Extent::Sphere, cut, reach, ..coarse() };
            let sky = Sky::new(scene.environment.as_ref(), 16).unwrap();
            let mut studio = Studio::new(gpu, &scene, &settings, None);
            let (plan, kinds) = (studio.fiv.plan().clone(), studio.fiv.occluders().kinds.clone());
            let mut fivs = vec![];
            let light = lucerna::techniques::fiv::Light::new(gpu, &sky).unwrap();
            plan.compute(gpu, &light, &kinds, 0..plan.samples(), |_, new| {
                fivs.extend_from_slice(new);
                Ok(true)
            })
            .unwrap();
            let kind = &plan.occluders[0];
            let solid = (interpolation == Interpolation::SolidAngle).then_some(f64::from(kind.radius));
            let set = twin::Set { grid: plan.grid, shells: kind.shells, spacing: &kind.spacing, solid, fivs: &fivs };
            let (up, fill) = (glam::DVec3::Y, lucerna::techniques::fiv::fill::fill(&kinds[0]));
            let centres = studio.fiv.occluders().placed.iter().map(|p| p.centre).collect::<Vec<_>>();
            // Points on both sides of the seam, straight below, where discs overlap in part, and where the ground cuts
            // the lower ball.
            for at in [
                vec3(0.0, 0.0, 0.0),
                vec3(1e-3, 0.0, 1.0),
                vec3(-1e-3, 0.0, 1.0),
                vec3(1.5, 0.0, 0.2),
                vec3(1.6, 0.0, -0.2),
                vec3(2.3, 0.0, 1.5),
                vec3(-9.0, 0.0, 3.0),
            ] {
                let view = flat_view(at + vec3(0.0, 0.02, 0.0), at, 1e-3, [1, 1]);
                let found = studio.irradiance(&view, &settings)[0].as_dvec3();
                let seen: Vec<_> = places
                    .iter()
                    .zip(&centres)
                    .map(|(place, centre)| ((*place + *centre - at).as_dvec3(), f64::from(kind.radius)))
                    .collect();
                let shares = twin::shares(up, &seen);
                let mut exact = twin::irradiance(&sky, up);
                for ((offset, radius), share) in seen.iter().zip(shares) {
                    let along = twin::dot(&set.lookup(*offset).0, up);
                    let hidden = match cut {
                        Cut::Height => along * twin::front(offset.y, *radius),
                        _ if offset.y >= *radius => along,
                        _ if offset.y <= -*radius => glam::DVec3::ZERO,
                        Cut::Light => {
                            let open = (twin::irradiance(&sky, up), twin::irradiance(&sky, -up));
                            twin::cut(along, open, (offset.y, offset.length(), *radius), fill.into())
                        }
                    };
                    exact -= hidden.max(glam::DVec3::ZERO) * share;
                }
                let exact = exact.max(glam::DVec3::ZERO);
                // The twin assumes filled discs.
                assert!(
                    (found - exact).length() < 5e-3 * twin::irradiance(&sky, up).length(),
                    "{at}: {found} instead of {exact}"
                );
            }
        }
    });
}

#[test]
fn occluders_turn_between_samples_of_turns() {
    with_gpu(|gpu| {
        // A bar on a foot, at a distance from its node's origin.
        let body = |turn: f32, at: f32| {
            let mut scene = Scene { environment: Some(colourful()), ..Scene::default() };
            ground(&mut scene, 20.0);
            let (mut positions, indices) = ball(0.5, 10);
            let turned = glam::Mat3::from_rotation_y(turn);
            positions.iter_mut().for_each(|p| *p = turned * (*p * vec3(1.2, 0.3, 0.25) + vec3(0.2, 0.9, 0.0)));
            thing(&mut scene, "bar", positions, indices, Mat4::from_rotation_y(at));
            scene
        };
        let from = vec3(0.8, 3.0, 0.6);
        let view = flat_view(from, vec3(0.0, 0.3, 0.0), 3.0, [24, 24]);
        let settings = Settings { turns: 8, extent: Extent::Hull, ..coarse() };
        let still = body(0.0, 0.0);
        let mut studio = Studio::new(gpu, &still, &settings, None);
        let mut turned = |angle: f32| {
            let mut pose = Pose::rest(&still);
            pose.world[1] = Mat4::from_rotation_y(angle);
            studio.shot(&pose, &view, &settings).0
        };
        let baked = |angle: f32, settings: &Settings| {
            Studio::new(gpu, &body(angle, 0.0), settings, None).irradiance(&view, settings)
        };
        let one = Settings { turns: 1, adaptive: false, ..settings.clone() };
        for (angle, slack) in [(PI as f32 * 0.75, 0.02), (-0.5 * PI as f32, 0.02), (1.2, 0.08)] {
            let truth = baked(angle, &by(Method::BruteForce));
            let (found, exact) = (turned(angle), baked(angle, &one));
            let (apart, error) = (nrmse(&exact, &found), nrmse(&truth, &found));
            let rest = nrmse(&truth, &turned(0.0));
            eprintln!(
                "turned by {angle}: {apart:.4} from a mesh that is turned, {error:.4} from brute force, {rest:.4} at rest"
            );
            assert!(apart < slack && error < 0.6 * rest, "{angle}");
        }
    });
}

#[test]
fn the_light_on_a_body_turns_between_samples_of_turns() {
    with_gpu(|gpu| {
        // A bowl that opens to the side: its own shadow turns with it.
        let body = |turn: f32| {
            let (bowl, triangles) = ball(0.6, 16);
            let open = |i: &u32| bowl[*i as usize].x < 0.2;
            let triangles = triangles.chunks_exact(3).filter(|c| c.iter().all(open)).flatten().copied().collect();
            let turned = glam::Mat3::from_rotation_y(turn);
            let mut scene = Scene { environment: Some(colourful()), ..Scene::default() };
            thing(&mut scene, "bowl", bowl.iter().map(|p| turned * *p).collect(), triangles, Mat4::IDENTITY);
            scene.materials[0].double_sided = true;
            scene
        };
        // Halfway between two samples, whose bowls open to both sides of the view.
        let angle = 2.5 * PI as f32 / 4.0;
        let settings = Settings { turns: 8, ..coarse() };
        let one = Settings { turns: 1, adaptive: false, ..settings.clone() };
        let (still, made) = (body(0.0), body(angle));
        let mut pose = Pose::rest(&still);
        pose.world[0] = Mat4::from_rotation_y(angle);
        let mut studio = Studio::new(gpu, &still, &settings, None);
        let mut other = Studio::new(gpu, &made, &one, None);
        for from in [vec3(0.3, 1.0, -2.0), vec3(2.0, 0.8, 0.3), vec3(-0.4, 2.0, 0.2)] {
            let view = flat_view(from, Vec3::ZERO, 1.1, [24, 24]);
            let found = studio.shot(&pose, &view, &settings).0;
            let exact = other.irradiance(&view, &one);
            let apart = nrmse(&exact, &found);
            eprintln!("seen from {from}: {apart:.4} from a mesh that is turned");
            assert!(apart < 0.05, "{from}: {apart}");
        }
    });
}

#[test]
fn what_cannot_be_served_is_refused_and_named() {
    with_gpu(|gpu| {
        let refused = |scene: &Scene, settings: &Settings| {
            let resident = Resident::new(gpu, scene).unwrap();
            Fiv::new(gpu, scene, &resident, settings, None, |_, _| true).unwrap_err()
        };
        let mut scene = stage(colourful(), &[]);
        scene.environment = None;
        let error = refused(&scene, &coarse());
        assert!(error.exit_code() == 2 && error.to_string().contains("--environment"), "{error}");
        let mut scene = stage(colourful(), &[]);
        let kind = LightKind::Point { range: None };
        scene.lights.push(Light { name: "lamp".into(), kind, color: Vec3::ONE, intensity: 1.0 });
        scene.nodes.push(Node { light: Some(0), ..Node::default() });
        let error = refused(&scene, &coarse());
        assert!(error.exit_code() == 2 && error.to_string().contains("`lamp` (point)"), "{error}");
        let error = refused(&stage(colourful(), &[]), &Settings { reach: 0.0, ..coarse() });
        assert!(error.to_string().contains("fiv.reach"), "{error}");
        let scene = stage(colourful(), &[Vec3::Y]);
        let resident = Resident::new(gpu, &scene).unwrap();
        let stopped = Fiv::new(gpu, &scene, &resident, &coarse(), None, |_, _| false).unwrap_err();
        assert!(stopped.to_string().contains("stopped"), "{stopped}");
    });
}
