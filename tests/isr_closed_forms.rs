//! The CPU reference of image-space radiosity against closed forms. No device needed.

use glam::{DVec2, DVec3, dvec3};
use lucerna::reference::{
    isr::{self, Estimator, Gather, Pattern},
    isr_scene::{Buffers, Eye, Patch},
};
use std::f64::consts::PI;

fn patch(corner: DVec3, a: DVec3, b: DVec3, radiance: f64) -> Patch {
    Patch { corner, a, b, albedo: DVec3::splat(0.5), radiance: DVec3::splat(radiance) }
}

/// Floor z in -2..0 at y = 0; wall at z = -2, 1 high, sending radiance 1; both 2 wide. Seen obliquely from above.
fn corner() -> (Eye, Vec<Patch>) {
    let floor = patch(dvec3(-1.0, 0.0, 0.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 0.0, -2.0), 0.0);
    let wall = patch(dvec3(-1.0, 0.0, -2.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 1.0, 0.0), 1.0);
    let eye = Eye::look_at(dvec3(0.3, 1.8, 2.2), dvec3(0.0, 0.3, -1.3), 0.9, 10.0, 160, 120);
    (eye, vec![floor, wall])
}

/// Floor and, one metre above it, a ceiling lit to radiance 1, both wholly in view from the open side.
fn facing() -> (Eye, Vec<Patch>) {
    let floor = patch(dvec3(-1.0, 0.0, 0.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 0.0, -2.0), 0.0);
    let ceiling = patch(dvec3(-1.0, 1.0, -2.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 0.0, 2.0), 1.0);
    let eye = Eye::look_at(dvec3(0.0, 0.5, 2.5), dvec3(0.0, 0.5, -1.0), 0.7, 10.0, 240, 180);
    (eye, vec![floor, ceiling])
}

fn area(samples: usize, jitter: bool, reach: f64) -> Gather {
    Gather {
        estimator: Estimator::Area,
        pattern: Pattern::Rings { spread: 1.5 },
        samples,
        jitter,
        reach,
        occlusion_reach: 8.0,
        occluder_radius: 1.0,
        occlusion_bias: 0.0,
        visibility_steps: 0,
        thickness: 0.0,
    }
}

#[test]
fn form_factor_of_small_patches_is_equation_6() {
    // Facing at distance 2: cos = 1 twice.
    let f = isr::form_factor(DVec3::ZERO, DVec3::Y, dvec3(0.0, 2.0, 0.0), -DVec3::Y, 0.01);
    assert!((f - 0.01 / (PI * 4.0)).abs() < 1e-15);
    // Both turned by 60°: a quarter.
    let n = dvec3(0.0, 0.5, 0.75f64.sqrt());
    let m = dvec3(0.0, -0.5, 0.75f64.sqrt());
    let turned = isr::form_factor(DVec3::ZERO, n, dvec3(0.0, 2.0, 0.0), m, 0.01);
    assert!((turned - f / 4.0).abs() < 1e-15);
    // Facing away on either side: nothing.
    assert_eq!(isr::form_factor(DVec3::ZERO, DVec3::Y, dvec3(0.0, 2.0, 0.0), DVec3::Y, 0.01), 0.0);
    assert_eq!(isr::form_factor(DVec3::ZERO, -DVec3::Y, dvec3(0.0, 2.0, 0.0), -DVec3::Y, 0.01), 0.0);
}

#[test]
fn form_factors_of_a_disc_sum_to_the_closed_form() {
    // Disc of radius R at height h above a parallel receiver: R² / (R² + h²).
    let (r, h) = (0.7, 0.9);
    let steps = 400;
    let mut total = 0.0;
    for i in 0..steps {
        for j in 0..steps {
            let rho = r * (f64::from(i) + 0.5) / f64::from(steps);
            let phi = 2.0 * PI * f64::from(j) / f64::from(steps);
            let d_area = rho * (r / f64::from(steps)) * (2.0 * PI / f64::from(steps));
            let x = dvec3(rho * phi.cos(), h, rho * phi.sin());
            total += isr::form_factor(DVec3::ZERO, DVec3::Y, x, -DVec3::Y, d_area);
        }
    }
    let exact = r * r / (r * r + h * h);
    assert!((total - exact).abs() < 1e-5, "{total} {exact}");
}

#[test]
fn occlusion_is_the_spherical_cap() {
    // A sphere that subtends 30° straight above: cap 1 - cos 30°.
    let o = isr::occlusion(DVec3::ZERO, DVec3::Y, dvec3(0.0, 2.0, 0.0), 1.0, 0.0);
    assert!((o - (1.0 - (PI / 6.0).cos())).abs() < 1e-15);
    // Inside the sphere the ratio is clamped: the whole hemisphere. At 60° from the normal: half of it.
    assert_eq!(isr::occlusion(DVec3::ZERO, DVec3::Y, dvec3(0.0, 0.5, 0.0), 1.0, 0.0), 1.0);
    let slanted = dvec3(0.75f64.sqrt(), 0.5, 0.0) * 0.5;
    assert!((isr::occlusion(DVec3::ZERO, DVec3::Y, slanted, 1.0, 0.0) - 0.5).abs() < 1e-12);
    // Below the horizon, and at the point itself: none.
    assert_eq!(isr::occlusion(DVec3::ZERO, DVec3::Y, dvec3(1.0, -0.5, 0.0), 1.0, 0.0), 0.0);
    assert_eq!(isr::occlusion(DVec3::ZERO, DVec3::Y, DVec3::ZERO, 1.0, 0.0), 0.0);
}

#[test]
fn equation_16_values() {
    assert_eq!(isr::paper_attenuation(0.0, 4.0), 1.0);
    assert_eq!(isr::paper_attenuation(2.0, 4.0), 0.75);
    assert_eq!(isr::paper_attenuation(4.0, 4.0), 0.0);
    assert_eq!(isr::paper_attenuation(5.0, 4.0), 0.0);
}

#[test]
fn equation_29_values() {
    let (direct, indirect) = (DVec3::splat(0.8), DVec3::splat(0.2));
    // Open: saturate(1 + 1 - 0.5) = 1. Closed: 1 - 0.5.
    assert!((isr::sum(direct, 1.0, indirect, 0.5, 0.5).x - 0.9).abs() < 1e-12);
    assert!((isr::sum(direct, 0.0, indirect, 0.5, 0.5).x - 0.5).abs() < 1e-12);
}

#[test]
fn sample_cells_tile_the_square_without_overlap() {
    for count in [24, 48, 80] {
        for pattern in [Pattern::Rings { spread: 1.0 }, Pattern::Rings { spread: 2.5 }, Pattern::Grid] {
            let samples = isr::samples(pattern, count, 30.0, None);
            assert_eq!(samples.len(), count);
            let total: f64 = samples.iter().map(|s| s.1).sum();
            let expected = match pattern {
                Pattern::Rings { .. } => 60.0 * 60.0,
                // Cells reach half a spacing further; the centre cell is missing.
                Pattern::Grid => count as f64 * (30.0 / (((count + 1) as f64).sqrt() - 1.0) * 2.0).powi(2),
            };
            assert!((total - expected).abs() < 1e-6, "{pattern:?} {count}: {total} {expected}");
            let balance: DVec2 = samples.iter().map(|s| s.0 * s.1).sum();
            assert!(balance.length() < 1e-6 * total, "{pattern:?} {count} leans to {balance}");
            assert!(samples.iter().all(|s| s.0.abs().max_element() <= 30.0));
        }
    }
}

#[test]
fn jittered_samples_integrate_a_polynomial() {
    // ∫∫ x² over [-R, R]² = 4R⁴/3. The mean over the 16 jitters must come near it.
    let reach = 10.0;
    let mut total = 0.0;
    for y in 0..4 {
        for x in 0..4 {
            let jitter = isr::jitter(x, y);
            for (at, area) in isr::samples(Pattern::Rings { spread: 2.0 }, 48, reach, Some(jitter)) {
                total += at.x * at.x * area / 16.0;
            }
        }
    }
    let exact = 4.0 * reach.powi(4) / 3.0;
    assert!((total / exact - 1.0).abs() < 0.02, "{total} {exact}");
}

#[test]
fn every_texel_as_sender_is_the_area_integral() {
    for (name, (eye, patches)) in [("corner", corner()), ("facing", facing())] {
        let buffers = Buffers::cast(&eye, &patches, 1);
        let mut tested = 0;
        for (x, y) in (0..eye.width).step_by(8).flat_map(|x| (0..eye.height).step_by(6).map(move |y| (x, y))) {
            let i = buffers.at(x, y);
            let p = buffers.position(&eye, x, y);
            // On the floor, not in the last texels before the wall, where a texel is not a point.
            if buffers.depth[i] >= 1.0 || p.y > 1e-6 || p.z < -1.8 {
                continue;
            }
            let exact = patches[1].reflected_by_white(p, DVec3::Y).x;
            let summed = isr::gather_all(&eye, &buffers, x, y).x;
            assert!((summed / exact - 1.0).abs() < 0.05, "{name} at {p}: {summed} instead of {exact}");
            tested += 1;
        }
        assert!(tested > 10, "{name}: only {tested} receivers");
    }
}

/// Mean over receivers of the estimate over the closed form, and the root mean square of its relative error.
fn quality(eye: &Eye, patches: &[Patch], settings: &Gather) -> (f64, f64) {
    let buffers = Buffers::cast(eye, patches, 2);
    let (mut ratio, mut square, mut count) = (0.0, 0.0, 0.0);
    // 4 × 4 blocks, as the jitter repeats and a blur would average.
    for by in (0..buffers.height - 4).step_by(3) {
        for bx in (0..buffers.width - 4).step_by(3) {
            let (mut estimate, mut exact, mut inside) = (0.0, 0.0, true);
            for (x, y) in (0..4).flat_map(|i| (0..4).map(move |j| (bx + i, by + j))) {
                let p = buffers.position(eye, x, y);
                inside &= buffers.depth[buffers.at(x, y)] < 1.0 && p.y < 1e-6 && p.z > -1.8;
                if inside {
                    exact += patches[1].reflected_by_white(p, DVec3::Y).x;
                    estimate += isr::gather_texel(eye, &buffers, settings, x, y).0.x;
                }
            }
            if inside {
                ratio += estimate / exact;
                square += (estimate / exact - 1.0).powi(2);
                count += 1.0;
            }
        }
    }
    assert!(count > 5.0);
    (ratio / count, (square / count).sqrt())
}

#[test]
fn the_area_estimator_is_consistent() {
    for (name, (eye, patches)) in [("corner", corner()), ("facing", facing())] {
        for (samples, bias, noise) in [(24, 0.1, 0.25), (48, 0.1, 0.15), (80, 0.1, 0.15)] {
            let (mean, error) = quality(&eye, &patches, &area(samples, true, eye.width as f64 / 4.0));
            println!("{name}, area, {samples} samples: mean {mean:.3}, relative error {error:.3}");
            assert!((mean - 1.0).abs() < bias, "{name}, {samples} samples: {mean} of the true irradiance");
            assert!(error < noise, "{name}, {samples} samples: relative error {error}");
        }
    }
}

#[test]
fn the_papers_sum_depends_on_the_number_of_samples_and_the_resolution() {
    // (2π/N) Σ F estimates 2π/N of the irradiance from within reach, and with single texels for dA 2π / (N s²), s the
    // spacing of the grid in texels. This holds the documented deviation.
    let (eye, patches) = corner();
    let reach = 24.0;
    for samples in [24, 48, 80] {
        let n = (((samples + 1) as f64).sqrt() - 1.0) / 2.0;
        let spacing = reach / n;
        let buffers = Buffers::cast(&eye, &patches, 2);
        let total = |estimator: Estimator| {
            let settings = Gather { estimator, pattern: Pattern::Grid, ..area(samples, true, reach) };
            let mut sum = 0.0;
            for (x, y) in (0..buffers.width).flat_map(|x| (0..buffers.height).map(move |y| (x, y))) {
                let p = buffers.position(&eye, x, y);
                if buffers.depth[buffers.at(x, y)] < 1.0 && p.y < 1e-6 && p.z > -1.7 {
                    sum += isr::gather_texel(&eye, &buffers, &settings, x, y).0.x;
                }
            }
            sum
        };
        let by_area = total(Estimator::Area);
        for (estimator, expected) in [
            (Estimator::PaperCells, 2.0 * PI / samples as f64),
            (Estimator::Paper, 2.0 * PI / (samples as f64 * spacing * spacing)),
        ] {
            let found = total(estimator) / by_area;
            println!("{samples} samples, {estimator:?}: {found:.4} of the area estimate, expected {expected:.4}");
            assert!((found / expected - 1.0).abs() < 0.05, "{samples} samples: {found} instead of {expected}");
        }
    }
}

#[test]
fn indirect_light_is_linear_in_the_senders_and_zero_without() {
    let (eye, mut patches) = corner();
    let settings = area(48, true, 60.0);
    let once = isr::gather(&eye, &Buffers::cast(&eye, &patches, 4), &settings);
    patches[1].radiance = dvec3(2.0, 3.0, 0.0);
    let scaled = isr::gather(&eye, &Buffers::cast(&eye, &patches, 4), &settings);
    for (a, b) in once.iter().zip(&scaled) {
        assert!((b.0 - a.0 * dvec3(2.0, 3.0, 0.0)).length() < 1e-12);
    }
    patches[1].radiance = DVec3::ZERO;
    let dark = isr::gather(&eye, &Buffers::cast(&eye, &patches, 4), &settings);
    assert!(dark.iter().all(|d| d.0 == DVec3::ZERO));
    assert!(once.iter().any(|o| o.0.x > 0.01));
}

#[test]
fn a_flat_plane_neither_lights_nor_hides_itself() {
    let (eye, mut patches) = corner();
    patches.truncate(1);
    patches[0].radiance = DVec3::ONE;
    let buffers = Buffers::cast(&eye, &patches, 2);
    for (light, hidden) in isr::gather(&eye, &buffers, &area(24, false, 20.0)) {
        assert!(light.length() < 1e-9 && hidden < 1e-9, "{light} {hidden}");
    }
}

#[test]
fn upsampling_weights() {
    let near = |v| Some((v, 0.0));
    let far = |v| Some((v, 0.5));
    // A constant stays constant whatever the depths.
    assert!((isr::upsample([near(2.0), far(2.0), far(2.0), near(2.0)], 0.3, 0.6, 1e-3) - 2.0).abs() < 1e-12);
    // Equal depths: bilinear.
    let plain = isr::upsample([near(0.0), near(1.0), near(0.0), near(1.0)], 0.25, 0.5, 1e-3);
    assert!((plain - 0.25).abs() < 1e-12);
    // Over a step, the other side gets 1/500 of the weight.
    let edge = isr::upsample([near(1.0), far(0.0), near(1.0), far(0.0)], 0.5, 0.5, 1e-3);
    assert!(edge > 0.99);
    // No match: the nearest in depth, not a mixture.
    let lost = isr::upsample([Some((1.0, 0.5)), Some((2.0, 0.4)), Some((3.0, 0.9)), None], 0.1, 0.1, 1e-3);
    assert_eq!(lost, 2.0);
    assert_eq!(isr::upsample([None; 4], 0.5, 0.5, 1e-3), 0.0);
}
