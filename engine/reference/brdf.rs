//! Reflection of surfaces in double precision: a matt base under a layer of GGX microfacets, as `lib/brdf.glsl` has it for every
//! technique and for the path tracers, and integrals over it by brute force.
//!
//! Written from Walter et al. 2007, Heitz 2014 and 2018, Schlick 1994, Kelemen and Szirmay-Kalos 2001, and Kulla and Conty 2017.
//!
//! With E₁(μ) the share of light at cosine μ that facets of reflectance 1 send upwards at once, B(μ) its part weighed by Schlick's
//! fifth power, and F = F_avg² E₁avg / (1 − F_avg (1 − E₁avg)) the Fresnel term of light that meets several facets, the layer
//! reflects E = f0 (E₁ − B) + f90 B + F (1 − E₁). The BRDF is
//!
//! ρ/π (1 − E(μ_o)) (1 − E(μ_i)) / (1 − E_avg) + F/π (1 − E₁(μ_o)) (1 − E₁(μ_i)) / (1 − E₁avg) + GGX.
//!
//! It is reciprocal, reflects all light where ρ = 1 or f0 = 1, and is Lambert's where f0 = 0. (glTF's plain mixture of base and
//! GGX by the Fresnel term of the half vector is reciprocal too, but makes light: of roughness 0.2, white, and under a sky of 1 it
//! reflects 1.007 seen at 53°, 1.106 at 70°, 1.258 at 78° and 1.445 at 85°.)
//! E₁ and B are fits, good to 0.35 % of the light from μ = 0.06 on; the integrals are in [`at_once`].

use std::f64::consts::PI;

use glam::DVec3;

/// What a surface is made of.
#[derive(Clone, Copy, Debug)]
pub struct Matter {
    /// Of the base, ρ.
    pub albedo: DVec3,
    /// Reflectance of the facets at normal incidence.
    pub f0: DVec3,
    /// Perceptual: the square root of the GGX width.
    pub roughness: f64,
}

/// What a light meets of the layer at one cosine.
#[derive(Clone, Copy, Debug)]
struct Layer {
    /// 1 − E₁.
    lost: f64,
    /// 1 − E, the share that the base gets.
    open: DVec3,
}

impl Matter {
    /// BRDF times the cosine of the light, 1/sr. Unit vectors; no light from below.
    pub fn response(&self, normal: DVec3, viewer: DVec3, light: DVec3) -> DVec3 {
        let (nv, nl) = (normal.dot(viewer).max(1e-4), normal.dot(light));
        if nl <= 0.0 {
            return DVec3::ZERO;
        }
        if self.f90() <= 0.0 {
            return self.albedo * (nl / PI);
        }
        let (out, within, mean) = (self.layer(nv), self.layer(nl), self.mean());
        let base = self.albedo * out.open * within.open / mean.open.max(DVec3::splat(1e-4));
        let multiple = self.again() * (out.lost * within.lost / mean.lost.max(1e-4));
        (base + multiple) * (nl / PI) + self.facets(normal, viewer, light)
    }

    /// GGX with height-correlated masking and Schlick's Fresnel term, times the cosine of the light.
    pub fn facets(&self, normal: DVec3, viewer: DVec3, light: DVec3) -> DVec3 {
        let (nv, nl) = (normal.dot(viewer).max(1e-4), normal.dot(light));
        if nl <= 0.0 {
            return DVec3::ZERO;
        }
        let half = (viewer + light).normalize_or(normal);
        let a2 = width(self.roughness).powi(2);
        let (along, across) = (normal.dot(half).min(1.0), normal.cross(half).length_squared());
        if along <= 0.0 {
            return DVec3::ZERO;
        }
        let distribution = a2 / (PI * (along * along * a2 + across).powi(2));
        let both = 1.0 / (1.0 + masking(nv, a2.sqrt()) + masking(nl, a2.sqrt()));
        let fifth = (1.0 - viewer.dot(half).clamp(0.0, 1.0)).powi(5);
        (self.f0 + (self.f90() - self.f0) * fifth) * (distribution * both / (4.0 * nv))
    }

    /// The share of light from everywhere alike that leaves towards a viewer at this cosine by other ways than one facet.
    pub fn matt(&self, viewer: f64) -> DVec3 {
        let out = self.layer(viewer.max(1e-4));
        self.albedo * out.open + self.again() * out.lost
    }

    /// The share of light from everywhere alike that leaves towards a viewer at this cosine: twice `steps`² directions, half by the
    /// cosine and half by the normals of visible facets, weighed by the balance heuristic.
    pub fn reflected(&self, viewer: f64, steps: u32) -> DVec3 {
        let viewer = DVec3::new((1.0 - viewer * viewer).max(0.0).sqrt(), 0.0, viewer);
        let alpha = width(self.roughness);
        let mut sum = DVec3::ZERO;
        for k in 0..steps * steps {
            let u = [k % steps, k / steps].map(|k| (f64::from(k) + 0.5) / f64::from(steps));
            // The fourth power puts more directions where facets lean far.
            let rim = 1.0 - u[0].powi(4);
            let half = visible([rim, u[1]], viewer, alpha);
            let (sine, turn) = (u[0].sqrt(), 2.0 * PI * u[1]);
            let even = DVec3::new(sine * turn.cos(), sine * turn.sin(), (1.0 - u[0]).sqrt());
            for (light, stretch) in [(2.0 * viewer.dot(half) * half - viewer, 4.0 * u[0].powi(3)), (even, 1.0)] {
                if light.z <= 0.0 {
                    continue;
                }
                let density = light.z / PI + visible_density(viewer, light, alpha);
                sum += self.response(DVec3::Z, viewer, light) * (stretch / density);
            }
        }
        sum / f64::from(steps * steps)
    }

    /// Reflectance of the facets at grazing incidence: 1 but for what reflects less than 2 % at normal incidence.
    pub fn f90(&self) -> f64 {
        (50.0 * self.f0.max_element()).clamp(0.0, 1.0)
    }

    /// Fresnel term of light that meets several facets.
    fn again(&self) -> DVec3 {
        let mean = self.f0 + (self.f90() - self.f0) / 21.0;
        let lost = lost_mean(self.roughness);
        mean * mean * (1.0 - lost) / (1.0 - mean * lost)
    }

    fn layer(&self, cosine: f64) -> Layer {
        let lost = lost(cosine, self.roughness);
        Layer { lost, open: self.open(lost, graze(cosine, self.roughness)) }
    }

    /// Of light from everywhere alike.
    fn mean(&self) -> Layer {
        let lost = lost_mean(self.roughness);
        Layer { lost, open: self.open(lost, polynomial(&GRAZE_MEAN, self.roughness.max(0.045))) }
    }

    fn open(&self, lost: f64, graze: f64) -> DVec3 {
        let layer = self.f0 * (1.0 - lost - graze) + self.f90() * graze + self.again() * lost;
        (1.0 - layer).max(DVec3::ZERO)
    }
}

/// Width α of GGX. Below a roughness of 0.045 the highlight of a point light would fall between pixels.
pub fn width(roughness: f64) -> f64 {
    roughness.max(0.045).powi(2)
}

/// 1 − E₁ by the fit.
pub fn lost(cosine: f64, roughness: f64) -> f64 {
    let (alpha, c) = (width(roughness), cosine.max(0.01));
    let x = c / (c + 0.7 * alpha);
    (x * (1.0 - x) * bivariate(&LOST, x, alpha)).clamp(0.0, 1.0)
}

/// B by the fit.
pub fn graze(cosine: f64, roughness: f64) -> f64 {
    let (alpha, c) = (width(roughness), cosine.max(0.01));
    let q = c.hypot(2.0 * alpha / (1.0 + 3.5 * alpha));
    let m = 1.0 - bivariate(&GRAZE, q, roughness.max(0.045));
    (1.0 - lost(cosine, roughness)) * m.clamp(0.0, 1.0).powi(5)
}

fn lost_mean(roughness: f64) -> f64 {
    width(roughness) * polynomial(&LOST_MEAN, roughness.max(0.045))
}

/// The part of the light of facets that is left for a viewer below the horizon of the shading normal, by the fit. Twin: `brdf_below`.
pub fn below(cosine: f64, roughness: f64) -> f64 {
    let alpha = width(roughness);
    let t = (-cosine).max(0.0) * (1.1 / alpha - 0.5).min(1.0 / alpha);
    1.0 / (1.0 + t * (1.0 + 1.1 * t))
}

/// E₁ and B by brute force: `steps`² normals of visible facets.
pub fn at_once(cosine: f64, roughness: f64, steps: u32) -> [f64; 2] {
    let alpha = width(roughness);
    let viewer = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let (mut all, mut fifth) = (0.0, 0.0);
    for k in 0..steps * steps {
        let u = [k % steps, k / steps].map(|k| (f64::from(k) + 0.5) / f64::from(steps));
        let half = visible([1.0 - u[0].powi(4), u[1]], viewer, alpha);
        let light = 2.0 * viewer.dot(half) * half - viewer;
        if light.z <= 0.0 {
            continue;
        }
        let seen = 1.0 + masking(cosine, alpha);
        let share = seen / (seen + masking(light.z, alpha)) * 4.0 * u[0].powi(3);
        all += share;
        fifth += share * (1.0 - viewer.dot(half)).powi(5);
    }
    [all, fifth].map(|sum| sum / f64::from(steps * steps))
}

/// Smith's Λ.
fn masking(cosine: f64, alpha: f64) -> f64 {
    0.5 * ((1.0 + alpha * alpha * (1.0 - cosine * cosine).max(0.0) / (cosine * cosine)).sqrt() - 1.0)
}

/// The normal of a facet that the viewer sees, about +z (Heitz 2018).
fn visible(u: [f64; 2], viewer: DVec3, alpha: f64) -> DVec3 {
    let v = DVec3::new(alpha * viewer.x, alpha * viewer.y, viewer.z).normalize();
    let flat = DVec3::new(-v.y, v.x, 0.0).normalize_or(DVec3::X);
    let up = v.cross(flat);
    let (r, turn) = (u[0].sqrt(), 2.0 * PI * u[1]);
    let (a, s) = (r * turn.cos(), 0.5 * (1.0 + v.z));
    let b = (1.0 - s) * (1.0 - a * a).max(0.0).sqrt() + s * r * turn.sin();
    let h = a * flat + b * up + (1.0 - a * a - b * b).max(0.0).sqrt() * v;
    DVec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).normalize_or(DVec3::Z)
}

/// Density per steradian of light that such a facet mirrors.
fn visible_density(viewer: DVec3, light: DVec3, alpha: f64) -> f64 {
    let half = (viewer + light).normalize_or(DVec3::Z);
    let across = half.x * half.x + half.y * half.y;
    let distribution = alpha * alpha / (PI * (half.z * half.z * alpha * alpha + across).powi(2));
    distribution / (1.0 + masking(viewer.z, alpha)) / (4.0 * viewer.z)
}

fn polynomial(c: &[f64], x: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// Rows are powers of `x`, columns of `y`.
fn bivariate(rows: &[&[f64]], x: f64, y: f64) -> f64 {
    rows.iter().rev().fold(0.0, |sum, row| sum * x + polynomial(row, y))
}

// Least squares, weighed again and again towards the least maximum, over roughness 0.045 to 1 and cosine 0.01 to 1.

/// (1 − E₁) / (x (1 − x)) in x = μ / (μ + 0.7 α) and α.
#[rustfmt::skip]
const LOST: [&[f64]; 7] = [
    &[0.409827, -0.142153, 6.945744, -12.9091, 17.379619, -11.229288, 2.709242],
    &[-5.593009, -4.519838, 0.559714, 0.908676, -12.954087, 6.843697],
    &[47.439318, 10.93719, -7.497, 39.004864, -12.041552],
    &[-170.936419, 4.800189, -29.862884, -16.598324],
    &[310.215818, -21.111957, 40.771942],
    &[-273.438613, 9.47037],
    &[92.032195],
];

/// 1 − (B / E₁)^(1/5) in √(μ² + (2 α / (1 + 3.5 α))²) and the roughness.
#[rustfmt::skip]
const GRAZE: [&[f64]; 8] = [
    &[-0.003461, 0.114778, -0.625336, 13.980493, 13.428452, -92.839605, 102.766635, -29.80176],
    &[0.988659, -1.560179, -25.647618, -166.842302, 299.701318, -230.100769, 19.001909],
    &[0.978732, 34.274535, 304.821822, 110.147453, -53.386304, 156.867769],
    &[-13.623753, -264.067197, -781.30978, -170.199178, -185.509776],
    &[75.621232, 720.167618, 922.139412, 232.727714],
    &[-182.69096, -835.347741, -445.215403],
    &[196.318908, 352.47638],
    &[-76.959364],
];

/// (1 − E₁avg) / α in the roughness, where the average is of the fit, weighed by 2 μ.
const LOST_MEAN: [f64; 7] = [0.233537, -1.555373, 6.749253, -1.199048, -16.765131, 20.564504, -7.43971];

/// B_avg as well.
const GRAZE_MEAN: [f64; 5] = [0.046601, 0.048822, -0.443438, 0.587848, -0.236867];

#[cfg(test)]
mod tests {
    use super::*;

    const ROUGHNESSES: [f64; 9] = [0.0, 0.07, 0.12, 0.2, 0.33, 0.5, 0.71, 0.86, 1.0];
    const ANGLES: [f64; 9] = [0.0, 15.0, 30.0, 45.0, 53.0, 65.0, 75.0, 80.0, 85.0];

    #[test]
    fn the_fits_are_the_integrals() {
        let (mut worst, mut worst_graze) = (0.0f64, 0.0f64);
        for i in 0..40 {
            for j in 0..40 {
                let roughness = 0.0453 + 0.954 * f64::from(i) / 39.0;
                let cosine = 0.06 + 0.94 * f64::from(j) / 39.0;
                let [all, fifth] = at_once(cosine, roughness, 96);
                worst = worst.max((1.0 - all - lost(cosine, roughness)).abs());
                worst_graze = worst_graze.max((fifth - graze(cosine, roughness)).abs());
            }
        }
        println!("largest errors: {worst:.5} of E1, {worst_graze:.5} of B");
        assert!(worst < 0.002 && worst_graze < 0.0035, "{worst} {worst_graze}");
    }

    #[test]
    fn white_stays_white_at_all_angles() {
        // White dielectric, white metal, half metal; the albedo does not matter where all is reflected.
        let white = [(1.0, 0.04), (0.0, 1.0), (0.5, 1.0), (1.0, 0.02), (1.0, 0.17), (1.0, 0.5)];
        let mut worst = 0.0f64;
        for (albedo, f0) in white {
            for roughness in ROUGHNESSES {
                let matter = Matter { albedo: DVec3::splat(albedo), f0: DVec3::splat(f0), roughness };
                for angle in ANGLES {
                    let found = matter.reflected(angle.to_radians().cos(), 160).x;
                    worst = worst.max((found - 1.0).abs());
                    assert!((found - 1.0).abs() < 0.01, "{albedo} {f0} roughness {roughness} at {angle}°: {found}");
                }
            }
        }
        println!("largest error: {worst:.5}");
    }

    #[test]
    fn coloured_surfaces_reflect_what_the_layer_leaves() {
        let base = DVec3::new(0.8, 0.3, 0.05);
        for metallic in [0.0, 0.3, 1.0] {
            for roughness in ROUGHNESSES {
                let matter =
                    Matter { albedo: base * (1.0 - metallic), f0: DVec3::splat(0.04).lerp(base, metallic), roughness };
                for angle in ANGLES {
                    let cosine = angle.to_radians().cos();
                    let found = matter.reflected(cosine, 160);
                    // By the integrals: the layer, and the base under it.
                    let [all, fifth] = at_once(cosine, roughness, 160);
                    let layer = matter.f0 * (all - fifth) + matter.f90() * fifth + matter.again() * (1.0 - all);
                    let exact = layer + matter.albedo * (1.0 - layer);
                    assert!(
                        (found - exact).abs().max_element() < 0.01,
                        "{metallic} {roughness} {angle}: {found} {exact}"
                    );
                    assert!(found.max_element() < 1.005);
                    // The share that technique without directions use for all but the facets.
                    let facets = matter.f0 * (all - fifth) + matter.f90() * fifth;
                    assert!((matter.matt(cosine) + facets - exact).abs().max_element() < 0.006);
                }
            }
        }
    }

    #[test]
    fn few_facets_are_seen_from_below_the_horizon() {
        let facets = |cosine: f64, matter: &Matter| {
            let viewer = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            let count = 200_000;
            let sum: f64 = (0..count)
                .map(|i| {
                    let (z, turn) = ((f64::from(i) + 0.5) / f64::from(count), 2.399_963_229_728_653 * f64::from(i));
                    let sine = (1.0 - z * z).sqrt();
                    matter.facets(DVec3::Z, viewer, DVec3::new(sine * turn.cos(), sine * turn.sin(), z)).x
                })
                .sum();
            2.0 * PI * sum / f64::from(count)
        };
        let mut worst = 0.0f64;
        for roughness in [0.2, 0.5, 0.7, 1.0] {
            let matter = Matter { albedo: DVec3::ZERO, f0: DVec3::splat(0.04), roughness };
            let level = facets(1e-3, &matter);
            for cosine in [-0.02, -0.05, -0.1, -0.2, -0.3, -0.5, -0.8] {
                let (found, exact) = (below(cosine, roughness), facets(cosine, &matter) / level);
                worst = worst.max((found - exact).abs());
            }
        }
        println!("largest error: {worst:.4}");
        assert!(worst < 0.08);
        assert_eq!((below(0.0, 0.5), below(0.7, 0.5)), (1.0, 1.0));
    }

    #[test]
    fn light_and_viewer_may_change_places() {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        for _ in 0..20_000 {
            let mut direction = || {
                let (z, turn) = (0.001 + 0.999 * next(), 2.0 * PI * next());
                let sine = (1.0 - z * z).sqrt();
                DVec3::new(sine * turn.cos(), sine * turn.sin(), z)
            };
            let (v, l) = (direction(), direction());
            let matter = Matter {
                albedo: DVec3::new(next(), next(), next()),
                f0: DVec3::new(next(), next(), next()),
                roughness: next(),
            };
            let there = matter.response(DVec3::Z, v, l) / l.z;
            let back = matter.response(DVec3::Z, l, v) / v.z;
            assert!((there - back).abs().max_element() <= 1e-9 * there.max_element(), "{there} {back}");
        }
    }

    #[test]
    fn without_an_interface_it_is_lamberts_law_to_the_bit() {
        let matter = Matter { albedo: DVec3::new(0.7, 0.2, 1.0), f0: DVec3::ZERO, roughness: 0.3 };
        let (v, l) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, -0.8, 0.6));
        assert_eq!(matter.response(DVec3::Z, v, l), matter.albedo * (0.6 / PI));
    }
}
