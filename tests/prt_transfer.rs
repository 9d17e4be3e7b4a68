//! Transfer against form factors, projection and reconstruction of examples, and the errors that a bake states.

use crate::{
    prt_lab::{baked, closed, sampled, small},
    tracer_lab::Stage,
};
use glam::{Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{Material, Scene},
    techniques::prt::{Baking, Settings, Stored, solve},
};

/// The inside of a box of a × b × c m from the origin.
fn cuboid(size: Vec3) -> Scene {
    let mut stage = Stage::new();
    let wall = stage.material(Material::diffuse("wall", Vec3::splat(0.5)));
    stage.cuboid(wall, Vec3::ZERO, size, true);
    stage.point(0.4 * size, Vec3::ONE);
    stage.scene
}

/// Form factor of equal, directly opposed rectangles a × b at the distance c (Howell, A Catalog of Radiation Heat Transfer, C-11).
fn parallel(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (rx, ry) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    let log = (rx * rx * ry * ry / (1.0 + x * x + y * y)).sqrt().ln();
    2.0 / (std::f64::consts::PI * x * y)
        * (log + x * ry * (x / ry).atan() + y * rx * (y / rx).atan() - x * x.atan() - y * y.atan())
}

/// Form factor from a rectangle of the width w to one of the height h at a right angle, with the common edge l (Howell, C-14).
fn perpendicular(w: f64, h: f64, l: f64) -> f64 {
    let (w, h) = (w / l, h / l);
    let (w2, h2) = (w * w, h * h);
    let both = w2 + h2;
    let angles = w * (1.0 / w).atan() + h * (1.0 / h).atan() - both.sqrt() * (1.0 / both.sqrt()).atan();
    let log = ((1.0 + w2) * (1.0 + h2) / (1.0 + both)).ln()
        + w2 * (w2 * (1.0 + both) / ((1.0 + w2) * both)).ln()
        + h2 * (h2 * (1.0 + both) / ((1.0 + h2) * both)).ln();
    (angles + 0.25 * log) / (std::f64::consts::PI * w)
}

#[test]
fn one_scattering_between_plates_is_their_form_factor() {
    // All faces of a box see each other: the formulas sum to 1 (checks of the formulas themselves).
    for [a, b, c] in [[1.0, 1.0, 1.0], [2.0, 1.0, 3.0]] {
        let sum = parallel(a, b, c) + 2.0 * perpendicular(b, c, a) + 2.0 * perpendicular(a, c, b);
        assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    }
    assert!(
        (parallel(1.0, 1.0, 1.0) - 0.199_825).abs() < 1e-5 && (perpendicular(1.0, 1.0, 1.0) - 0.200_044).abs() < 1e-5
    );
    with_gpu(|gpu| {
        let size = vec3(2.0, 1.0, 1.5);
        // A basis with nearly as many vectors as samples holds light that ends at an edge.
        let baking = Baking { samples: 2000, cluster: 60, light: 64, receivers: 0, ..small() };
        let stored = baked(gpu, &cuboid(size), &baking);
        let count = stored.samples.len();
        let once = Settings { bounces: false, ..Settings::default() };
        let faces = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
        let on = |sample: usize, face: usize| Vec3::from(stored.samples[sample].side).dot(faces[face]) > 0.9;
        for sender in 0..6 {
            let light: Vec<[f32; 3]> = (0..count).map(|i| [f32::from(on(i, sender)); 3]).collect();
            let found = solve::indirect(&stored, &vec![[1.0; 3]; count], &light, &once).unwrap();
            for receiver in 0..6 {
                let (mut sum, mut area) = (0.0f64, 0.0f64);
                for i in (0..count).filter(|i| on(*i, receiver)) {
                    area += f64::from(stored.samples[i].area);
                    sum += f64::from(stored.samples[i].area * found[i][0]);
                }
                let size = size.as_dvec3();
                let (s, r) = (sender % 3, receiver % 3);
                let wanted = match (sender == receiver, s == r) {
                    (true, _) => 0.0,
                    (_, true) => parallel(size[(s + 1) % 3], size[(s + 2) % 3], size[s]),
                    // The common edge is along the third axis.
                    _ => perpendicular(size[s], size[r], size[3 - s - r]),
                };
                // At an edge, half a distance of samples may belong to the next face: 3 % of these faces. Chance: 256 rays of 300 samples, 0.7 %.
                let off = (sum / area - wanted).abs();
                assert!(off < 0.03 * wanted.max(0.2), "{sender} to {receiver}: {} instead of {wanted}", sum / area);
            }
        }
    });
}

#[test]
fn examples_are_restored_up_to_the_share_that_the_sizes_leave_out() {
    with_gpu(|gpu| {
        let scene = closed(Vec3::splat(0.5));
        let baking = Baking { samples: 1200, cluster: 200, light: 10, ..small() };
        let stored = baked(gpu, &scene, &baking);
        let (mut bakery, again) = sampled(gpu, &scene, &baking).unwrap();
        assert!(again.samples == stored.samples);
        bakery.upload(&again.plan, &again.samples).unwrap();
        let lights = again.examples.len();
        for cluster in 0..stored.plan.clusters.len() {
            let lit = bakery.lit(&stored.plan, cluster, &again.examples, 2.0 * stored.plan.radius).unwrap();
            let range = stored.plan.range(cluster);
            let samples = &stored.samples[range];
            let basis = &stored.bases[cluster];
            let (mut whole, mut left, mut squares) = (0.0f64, 0.0f64, vec![0.0f64; basis.vectors as usize]);
            for light in 0..lights {
                let e = |i: usize| f64::from(lit[i * lights + light]);
                let mut along = vec![0.0f64; basis.vectors as usize];
                for (i, sample) in samples.iter().enumerate() {
                    along
                        .iter_mut()
                        .zip(basis.weights(i, sample.area))
                        .for_each(|(sum, w)| *sum += f64::from(w) * e(i));
                }
                squares.iter_mut().zip(&along).for_each(|(sum, a)| *sum += a * a / lights as f64);
                let (mut sums, mut here) = ([0.0f64; 2], 0.0f64);
                for (i, sample) in samples.iter().enumerate() {
                    let functions = basis.functions(i, sample.area).zip(&along);
                    let restored: f64 = functions.map(|(value, a)| f64::from(value) * a).sum();
                    let area = f64::from(sample.area);
                    here += area * e(i).powi(2) / lights as f64;
                    left += area * (restored - e(i)).powi(2) / lights as f64;
                    sums[0] += area * restored;
                    sums[1] += area * e(i);
                }
                whole += here;
                // The first vector is even light, so the sum over the cluster stays; 16-bit floats have 11 bits.
                let norm = (lights as f64 * here * samples.iter().map(|s| f64::from(s.area)).sum::<f64>()).sqrt();
                assert!((sums[0] - sums[1]).abs() < 2f64.powi(-9) * norm.max(1e-12), "{cluster}: {sums:?}");
            }
            // Pythagoras: vectors are orthonormal.
            let kept: f64 = squares.iter().sum();
            assert!((whole - kept - left).abs() < 4e-3 * whole, "{cluster}: {whole} {kept} {left}");
            // The sizes of the file are those of the coefficients, in the units of the bake.
            let unit = f64::from(stored.plan.far).powi(2);
            for (size, square) in basis.sizes.iter().zip(&squares) {
                let (stated, found) = (f64::from(*size), unit * square.sqrt());
                assert!(
                    (stated - found).abs() < 0.01 * found + 2e-3 * unit * whole.sqrt(),
                    "{cluster}: {stated} {found}"
                );
            }
        }
    });
}

/// Light that each vector sends to each sample of a cluster, but for that of links: by the rays, without any compression, and by the bake.
fn dense(stored: &Stored, cluster: usize, seen: &[u32]) -> [Vec<f64>; 2] {
    let plan = &stored.plan;
    let all = plan.all_vectors();
    let rays = plan.settings.rays as usize;
    let of: Vec<(usize, usize)> = (0..plan.clusters.len()).flat_map(|c| plan.range(c).map(move |i| (c, i))).collect();
    let mut exact = vec![0.0f64; plan.range(cluster).len() * all];
    let links = &stored.transfers[cluster].links;
    for (at, (row, seen)) in exact.chunks_exact_mut(all).zip(seen.chunks_exact(rays)).enumerate() {
        let linked: Vec<usize> = links.of(at, rays as u32).map(|(sender, _)| sender).collect();
        let rest = seen.iter().map(|n| *n as usize).filter(|n| *n < of.len() && !linked.contains(n));
        for number in rest {
            let (c, i) = of[number];
            let first = plan.first_vector(c);
            let functions = stored.bases[c].functions(i - plan.range(c).start, stored.samples[i].area);
            row[first..].iter_mut().zip(functions).for_each(|(sum, value)| *sum += f64::from(value) / rays as f64);
        }
    }
    let transfer = &stored.transfers[cluster];
    let stride = transfer.stride(all);
    let mut found = Vec::new();
    for values in transfer.values.chunks_exact(stride) {
        if transfer.rank == 0 {
            found.extend(values.iter().map(|v| v.to_f64()));
            continue;
        }
        for vector in 0..all {
            let parts = values.iter().zip(transfer.rows.chunks_exact(all));
            found.push(parts.map(|(value, row)| value.to_f64() * f64::from(row[vector])).sum::<f64>());
        }
    }
    [exact, found]
}

#[test]
fn low_rank_threshold_and_quantisation_leave_out_no_more_than_the_bake_states() {
    with_gpu(|gpu| {
        let scene = closed(Vec3::splat(0.5));
        for (receivers, keep, links) in [(6, 1.0, 0.0), (6, 1.0, 0.03), (0, 0.2, 0.0), (0, 0.2, 0.03), (0, 1.0, 0.0)] {
            let baking = Baking { samples: 400, cluster: 100, light: 8, rays: 128, receivers, keep, links, ..small() };
            let stored = baked(gpu, &scene, &baking);
            let (mut bakery, again) = sampled(gpu, &scene, &baking).unwrap();
            bakery.upload(&again.plan, &again.samples).unwrap();
            let sizes: Vec<f64> = stored.bases.iter().flat_map(|basis| &basis.sizes).map(|s| f64::from(*s)).collect();
            for cluster in 0..stored.plan.clusters.len() {
                let seen = bakery.gather(&stored.plan, cluster).unwrap();
                let [exact, found] = dense(&stored, cluster, &seen);
                let (mut whole, mut off) = (0.0, 0.0);
                for (at, (exact, found)) in exact.iter().zip(&found).enumerate() {
                    let sample = &stored.samples[stored.plan.range(cluster).start + at / sizes.len()];
                    let area = if receivers > 0 { f64::from(sample.area) } else { 1.0 };
                    let weight = area * sizes[at % sizes.len()].powi(2);
                    whole += weight * exact * exact;
                    off += weight * (exact - found).powi(2);
                }
                let (stated, found) = (f64::from(stored.transfers[cluster].left), (off / whole).sqrt());
                // Half a unit in the last place of 11 bits is the error of quantisation.
                assert!((found - stated).abs() < 2f64.powi(-11), "{receivers} {keep}: {found}, stated {stated}");
                // What is compared is far above the quantisation, but for all coefficients, of which none is left out.
                match (receivers, keep < 1.0) {
                    (0, false) => assert_eq!(stated, 0.0),
                    _ => assert!(stated > 2f64.powi(-8), "{receivers} {keep}: {stated}"),
                }
            }
        }
    });
}

#[test]
fn signed_light_is_transferred_as_the_difference_of_its_parts() {
    with_gpu(|gpu| {
        let stored = baked(gpu, &closed(Vec3::splat(0.5)), &Baking { samples: 1000, ..small() });
        let count = stored.samples.len();
        let of = |light: &dyn Fn(usize) -> f32| {
            let light: Vec<[f32; 3]> = (0..count).map(|i| [light(i); 3]).collect();
            solve::indirect(&stored, &vec![[0.5; 3]; count], &light, &Settings::default()).unwrap()
        };
        let (a, b) = (|i: usize| 1.0 + (0.3 * i as f32).sin(), |i: usize| 2.0 * (0.11 * i as f32).cos());
        let (of_a, of_b, both) = (of(&a), of(&b), of(&|i| a(i) - b(i)));
        let size = of_a.iter().chain(&of_b).map(|e| e[0].abs()).fold(0.0, f32::max);
        assert!(both.iter().any(|e| e[0] > 0.0) && size > 0.1);
        for i in 0..count {
            assert!((of_a[i][0] - of_b[i][0] - both[i][0]).abs() < 1e-5 * size, "{i}");
        }
        // The opposite light is exactly the opposite.
        for (plus, minus) in of_b.iter().zip(of(&|i| -b(i))) {
            assert_eq!(plus[0], -minus[0]);
        }
    });
}
