//! The environment's sums and the vectors of occluders on the device, against closed forms and the slow twins.

use std::f64::consts::PI;

use crate::fiv_lab::{apart, ball, cap, colourful, hierarchy, length, occluder, one_ball, painted, thing, vectors};
use glam::{DMat3, DVec2, DVec3, Mat4, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::Runner,
    reference::fiv as twin,
    scene::{Environment, Scene},
    shaders::consts::FIV_INSIDE,
    techniques::fiv::{Light, Occluder, Plan, Settings, Sky, cover::Cover, samples::Grid, sky},
};

fn sky(environment: &Environment, size: u32) -> Sky {
    Sky::new(Some(environment), size).unwrap()
}

/// Irradiance for the normal of every texel, as the device has it.
fn difmap(light: &Light) -> Vec<(DVec3, DVec3)> {
    let mut out = vec![];
    for face in 0..6 {
        let bytes = light.difmap.read(0, face).unwrap();
        for (i, texel) in bytes.chunks_exact(16).enumerate() {
            let value = |k: usize| f64::from(f32::from_le_bytes(texel[4 * k..4 * k + 4].try_into().unwrap()));
            let (_, x, y) = sky::place(light.size, i as u32);
            let st = (DVec2::new(x.into(), y.into()) + 0.5) / f64::from(light.size);
            out.push((sky::direction(face, st).normalize(), DVec3::new(value(0), value(1), value(2))));
        }
    }
    out
}

#[test]
fn irradiance_of_even_and_of_linear_light() {
    with_gpu(|gpu| {
        let light = Light::new(gpu, &sky(&Environment::constant(vec3(2.0, 1.0, 0.0)), 32)).unwrap();
        for (n, e) in difmap(&light) {
            assert!((e.x / (2.0 * PI) - 1.0).abs() < 7e-4 && (e.y / PI - 1.0).abs() < 7e-4 && e.z == 0.0, "{n}: {e}");
        }
        assert!(length(&vectors(&light.total)) < 1e-5);
        // L = 1 + a·ω: E = π + 2π/3 a·n, FIV = 4π/3 a.
        let slopes = [DVec3::new(0.6, 0.0, 0.0), DVec3::new(0.0, 0.8, 0.0), DVec3::new(0.3, -0.2, 0.5)];
        let linear = painted(512, |d| Vec3::from_array(slopes.map(|a| (1.0 + a.dot(d)) as f32)));
        let light = Light::new(gpu, &sky(&linear, 32)).unwrap();
        for (n, e) in difmap(&light) {
            for (found, a) in e.to_array().into_iter().zip(slopes) {
                let exact = PI + 2.0 * PI / 3.0 * a.dot(n);
                assert!((found - exact).abs() < 4e-3, "{n}: {found} instead of {exact}");
            }
        }
        let total = vectors(&light.total);
        for (axis, found) in total.iter().enumerate() {
            let exact = DVec3::from_array(slopes.map(|a| 4.0 * PI / 3.0 * a[axis]));
            assert!((*found - exact).length() < 4e-3, "{axis}: {found} instead of {exact}");
        }
    });
}

#[test]
fn a_cap_of_light_has_its_closed_form() {
    with_gpu(|gpu| {
        for rows in [33, 114, 196] {
            let (environment, alpha) = cap(rows, 3.0);
            let light = Light::new(gpu, &sky(&environment, 64)).unwrap();
            let total = vectors(&light.total);
            let exact = 3.0 * PI * alpha.sin().powi(2);
            assert!((total[1].x / exact - 1.0).abs() < 3e-3, "{alpha}: {} instead of {exact}", total[1].x);
            assert!(total[0].length() + total[2].length() < 1e-4 * exact);
        }
    });
}

#[test]
fn the_device_sums_as_the_twin_does() {
    with_gpu(|gpu| {
        for size in [8, 40] {
            let sky = sky(&colourful(), size);
            let light = Light::new(gpu, &sky).unwrap();
            let whole = twin::total(&sky);
            assert!(apart(&vectors(&light.total), &whole) < 2e-6 * length(&whole));
            let map = difmap(&light);
            for (n, e) in map.iter().step_by(7) {
                let exact = twin::irradiance(&sky, *n);
                assert!((*e - exact).length() < 3e-6 * exact.length(), "{n}: {e} instead of {exact}");
                // Gershun's identity: light from the front minus light from behind.
                let behind = twin::irradiance(&sky, -*n);
                assert!((twin::dot(&whole, *n) - (*e - behind)).length() < 1e-5 * exact.length());
            }
        }
    });
}

#[test]
fn light_adds_scales_and_turns() {
    with_gpu(|gpu| {
        let total = |environment: &Environment| vectors(&Light::new(gpu, &sky(environment, 32)).unwrap().total);
        let a = colourful();
        let small = painted(128, |d| if d.y > 0.5f64.cos() { Vec3::splat(2.0) } else { Vec3::ZERO });
        let both =
            Environment { pixels: a.pixels.iter().zip(&small.pixels).map(|(p, q)| *p + *q).collect(), ..a.clone() };
        let (of_a, of_b) = (total(&a), total(&small));
        let sum = [0, 1, 2].map(|k| of_a[k] + of_b[k]);
        assert!(apart(&total(&both), &sum) < 1e-5 * length(&sum));
        let doubled = total(&Environment { scale: 2.0, ..a.clone() });
        assert!(apart(&doubled, &of_a.map(|v| v * 2.0)) < 1e-5 * length(&doubled));
        // A rotation by a quarter turn maps texels to texels, other angles nearly so.
        for (angle, slack) in [(0.5 * PI, 1e-5), (0.4, 3e-3)] {
            let turned = total(&Environment { rotation: angle as f32, ..a.clone() });
            // Converts the colours of x, y and z to one vector per channel and back.
            let turn = DMat3::from_rotation_y(angle) * DMat3::from_cols(of_a[0], of_a[1], of_a[2]).transpose();
            let exact = turn.transpose();
            let exact = [exact.x_axis, exact.y_axis, exact.z_axis];
            assert!(apart(&turned, &exact) < slack * length(&exact), "{angle}: {turned:?} instead of {exact:?}");
        }
    });
}

#[test]
fn odd_environments_give_numbers() {
    with_gpu(|gpu| {
        let mut odd = colourful();
        odd.pixels[70] = Vec3::splat(f32::NAN);
        odd.pixels[900] = vec3(f32::INFINITY, -1.0, 1.0);
        let black = painted(16, |_| Vec3::ZERO);
        let mut one = black.clone();
        one.pixels[37] = vec3(9.0, 0.0, 1.0);
        for environment in [&odd, &black, &one] {
            let light = Light::new(gpu, &sky(environment, 16)).unwrap();
            for (_, e) in difmap(&light) {
                assert!(e.is_finite() && e.min_element() >= 0.0, "{e}");
            }
            assert!(vectors(&light.total).iter().all(|v| v.is_finite()));
        }
        let light = Light::new(gpu, &sky(&black, 16)).unwrap();
        assert_eq!((light.total, light.lit.len()), ([0.0; 9], 0));
    });
}

/// Vectors and solid angles that an occluder hides from some points.
fn covered(gpu: &Gpu, occluder: &Occluder, light: &Light, points: &[Vec3], split: u32) -> Vec<(twin::Vectors, f64)> {
    let (fivs, coverage) = Cover::new(gpu, occluder).unwrap().run(&mut Runner::new(gpu), light, points, split).unwrap();
    assert_eq!((fivs.len(), coverage.len()), (9 * points.len(), points.len()));
    fivs.chunks_exact(9).zip(coverage).map(|(f, c)| (vectors(f), f64::from(c))).collect()
}

#[test]
fn the_mask_of_a_sphere_is_its_cap() {
    with_gpu(|gpu| {
        let (sphere, _) = occluder(&one_ball(1.0, 40));
        let light = Light::new(gpu, &sky(&Environment::constant(Vec3::ONE), 32)).unwrap();
        // A ball of half angle α: its solid angle is 2π(1 − cos α), and its vector has the length π sin²α. A texel is
        // hidden whole or not at all.
        for (d, slack) in [(1.05, 0.01), (1.5, 0.02), (2.0, 0.03), (4.0, 0.06)] {
            for direction in [DVec3::X, DVec3::NEG_Y, DVec3::new(1.0, 1.0, 1.0), DVec3::new(-0.3, 0.2, -0.9)] {
                let direction = direction.normalize();
                let (hidden, angle) = covered(gpu, &sphere, &light, &[(-direction * d).as_vec3()], 1)[0];
                let sin = 1.0 / d;
                let exact = 2.0 * PI * (1.0 - (1.0 - sin * sin).sqrt());
                assert!((angle / exact - 1.0).abs() < slack, "{d} {direction}: {angle} instead of {exact}");
                let exact = direction * (PI * sin * sin);
                let found = DVec3::new(hidden[0].x, hidden[1].x, hidden[2].x);
                assert!((found - exact).length() < slack * exact.length(), "{d}: {found} instead of {exact}");
            }
        }
        // Samples inside see no light and are left out.
        let (inside, angle) = covered(gpu, &sphere, &light, &[vec3(0.2, 0.1, 0.0)], 1)[0];
        assert!(inside[0].x >= f64::from(FIV_INSIDE) && (angle / (4.0 * PI) - 1.0).abs() < 1e-5);
        // More rays reduce the error of the staircase.
        let far = |split| covered(gpu, &sphere, &light, &[vec3(0.0, 3.1, 5.2)], split)[0].1;
        let exact = 2.0 * PI * (1.0 - (1.0 - 1.0 / (3.1f64.powi(2) + 5.2f64.powi(2))).sqrt());
        assert!((far(4) / exact - 1.0).abs() < 0.02, "{} instead of {exact}", far(4));
    });
}

#[test]
fn masks_are_those_of_the_cpus_hierarchy_and_disjoint_occluders_add() {
    with_gpu(|gpu| {
        let (positions, indices) = ball(0.4, 6);
        let alone = |x: f32| {
            let mut scene = Scene::default();
            let moved: Vec<Vec3> = positions.iter().map(|p| *p * vec3(1.0, 2.0, 1.0) + vec3(x, 0.0, 0.0)).collect();
            thing(&mut scene, "one", moved, indices.clone(), Mat4::IDENTITY);
            occluder(&scene)
        };
        // Two balls in one mesh, which do not hide each other from the tested points.
        let mut scene = Scene::default();
        let count = positions.len() as u32;
        let side = |x: f32| positions.iter().map(move |p| *p * vec3(1.0, 2.0, 1.0) + vec3(x, 0.0, 0.0));
        let pair: Vec<Vec3> = side(-1.0).chain(side(1.0)).collect();
        let triangles = indices.iter().copied().chain(indices.iter().map(|i| i + count)).collect();
        thing(&mut scene, "two", pair, triangles, Mat4::IDENTITY);
        let ((both, middle), (one, own)) = (occluder(&scene), alone(0.0));
        let sky = sky(&colourful(), 16);
        let light = Light::new(gpu, &sky).unwrap();
        let points = [vec3(0.1, 0.3, 2.5), vec3(0.0, -1.5, -3.0), vec3(0.3, 4.0, 0.1)];
        for (occluder, points) in [(&both, &points[..]), (&one, &points[..2])] {
            let tree = hierarchy(occluder);
            for split in [1, 2] {
                for (found, point) in covered(gpu, occluder, &light, points, split).iter().zip(points) {
                    let exact = twin::hidden(&sky, &tree, *point, split);
                    // An odd ray may pass an edge on the other side.
                    assert!((found.1 - exact.angle).abs() < 0.01 * exact.angle, "{point}: {} {}", found.1, exact.angle);
                    assert!(apart(&found.0, &exact.vectors) < 0.02 * length(&exact.vectors), "{point}");
                }
            }
        }
        let shift = |x: f32| points.map(|p| p + middle - own + vec3(x, 0.0, 0.0));
        let together = covered(gpu, &both, &light, &points, 1);
        let [left, right] = [shift(1.0), shift(-1.0)].map(|p| covered(gpu, &one, &light, &p, 1));
        for ((whole, l), r) in together.iter().zip(&left).zip(&right) {
            let sum = [0, 1, 2].map(|k| l.0[k] + r.0[k]);
            assert!(apart(&whole.0, &sum) < 0.02 * length(&sum), "{whole:?} is not {l:?} and {r:?}");
        }
    });
}

/// Vectors of the visible light at the samples on an occluder's surface, with the solid angles.
fn seen(gpu: &Gpu, occluder: &Occluder, light: &Light, split: u32) -> Vec<(twin::Vectors, f64)> {
    let (places, mut runner) = (occluder.places(), Runner::new(gpu));
    let (fivs, angles) = Cover::new(gpu, occluder).unwrap().run_own(&mut runner, light, &places, split).unwrap();
    assert_eq!(fivs.len(), 9 * places.len());
    fivs.chunks_exact(9).zip(angles).map(|(f, a)| (vectors(f), f64::from(a))).collect()
}

#[test]
fn a_convex_body_leaves_itself_all_that_is_before_it() {
    with_gpu(|gpu| {
        let (sphere, _) = occluder(&one_ball(2.0, 12));
        let sky = sky(&colourful(), 16);
        let light = Light::new(gpu, &sky).unwrap();
        let mut even = 0;
        for split in [1, 2] {
            for (place, (found, angle)) in sphere.places().iter().zip(seen(gpu, &sphere, &light, split)) {
                let n = place.normal.as_dvec3();
                // At the seam and the poles of this mesh normals are tilted, and neighbouring vertices lie in front of
                // the plane.
                if n.dot(place.point.normalize().as_dvec3()) < 0.9999 {
                    continue;
                }
                even += 1;
                let exact = twin::irradiance(&sky, n);
                assert!((twin::dot(&found, n) - exact).length() < 1e-4 * exact.length(), "{n}");
                assert!((angle / (2.0 * PI) - 1.0).abs() < 0.06, "{n}: {angle}");
            }
        }
        assert!(even > 200, "{even}");
    });
}

#[test]
fn a_leaf_has_two_sides_and_its_edges_see_only_what_is_before_them() {
    with_gpu(|gpu| {
        let mut scene = Scene::default();
        let corners = vec![vec3(-1.0, 0.0, -1.0), vec3(-1.0, 0.0, 1.0), vec3(1.0, 0.0, 1.0), vec3(1.0, 0.0, -1.0)];
        thing(&mut scene, "leaf", corners, vec![0, 1, 2, 0, 2, 3], Mat4::IDENTITY);
        scene.materials[0].double_sided = true;
        let mut all = lucerna::techniques::fiv::Occluders::of(&scene, &lucerna::scene::Pose::rest(&scene), true, 1.0);
        let leaf = all.kinds.remove(0);
        let sky = sky(&colourful(), 16);
        let light = Light::new(gpu, &sky).unwrap();
        let places = leaf.places();
        assert_eq!(places.len(), 8);
        for (place, (found, _)) in places.iter().zip(seen(gpu, &leaf, &light, 1)) {
            let n = place.normal.as_dvec3();
            let exact = twin::irradiance(&sky, n);
            assert!(n.y.abs() > 0.999 && (twin::dot(&found, n) - exact).length() < 1e-4 * exact.length(), "{n}");
        }
    });
}

#[test]
fn places_on_a_surface_are_those_of_the_cpus_hierarchy_and_buried_ones_are_told() {
    with_gpu(|gpu| {
        // Two balls that intersect.
        let (positions, indices) = ball(1.0, 10);
        let mut scene = Scene::default();
        let count = positions.len() as u32;
        let pair: Vec<Vec3> =
            [-0.6, 0.6].iter().flat_map(|x| positions.iter().map(move |p| *p + vec3(*x, 0.0, 0.0))).collect();
        let triangles = indices.iter().copied().chain(indices.iter().map(|i| i + count)).collect();
        thing(&mut scene, "pair", pair, triangles, Mat4::IDENTITY);
        let (pair, _) = occluder(&scene);
        let sky = sky(&colourful(), 16);
        let (light, tree) = (Light::new(gpu, &sky).unwrap(), hierarchy(&pair));
        let (mut buried, mut shaded) = (0, 0);
        for (place, (found, angle)) in pair.places().iter().zip(seen(gpu, &pair, &light, 1)) {
            let other = place.point - vec3(if place.point.x > 0.0 { -0.6 } else { 0.6 }, 0.0, 0.0);
            let (exact, free) = twin::seen(&sky, &tree, *place, 1);
            if found[0].x >= f64::from(FIV_INSIDE) {
                buried += 1;
                assert!(angle == 0.0 && free == 0.0, "{place:?}: {angle} {free}");
                continue;
            }
            assert!(other.length() > 0.9, "{place:?}");
            shaded += u32::from(angle < 0.9 * 2.0 * PI);
            assert!(
                (angle - free).abs() < 0.01 * 2.0 * PI && apart(&found, &exact) < 0.02 * length(&exact),
                "{place:?}"
            );
        }
        assert!(buried > 20 && shaded > 20, "{buried} {shaded}");
    });
}

#[test]
fn each_sample_is_the_same_whatever_is_computed_with_it() {
    with_gpu(|gpu| {
        let kinds = [occluder(&one_ball(1.0, 5)).0, occluder(&one_ball(0.3, 4)).0];
        let settings = Settings { size: 8, azimuths: 6, polars: 5, radii: 4, ..Settings::default() };
        let sky = sky(&colourful(), 8);
        let light = Light::new(gpu, &sky).unwrap();
        let plan = Plan::new("colourful", light.hash, &kinds, &settings);
        let on: Vec<u64> = kinds.iter().map(|k| k.places().len() as u64).collect();
        let samples = 240 + on[0] + on[1];
        assert_eq!((plan.samples(), plan.first(1), plan.grid), (samples, 120 + on[0], Grid::of(6, 5, 4)));
        let run = |range: std::ops::Range<u64>| {
            let mut out = vec![];
            plan.compute(gpu, &light, &kinds, range, |_, new| {
                out.extend_from_slice(new);
                Ok(true)
            })
            .unwrap();
            out
        };
        let whole = run(0..samples);
        assert_eq!(whole.len() as u64, 9 * samples);
        let parts = [0..1, 1..77, 77..133, 133..240, 240..samples].map(run).concat();
        let bits = |v: &[f32]| v.iter().map(|f| f.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&whole), bits(&parts));
        // At the poles all azimuths have the same position.
        for azimuth in 1..6 {
            let at = |a: u32| &whole[9 * plan.grid.index(a, 0, 3) as usize..][..9];
            assert_eq!(at(0), at(azimuth));
        }
    });
}
