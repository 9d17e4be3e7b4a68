//! Spherical harmonics of bands 0 to 2 (Ramamoorthi and Hanrahan, An Efficient Representation for Irradiance Environment Maps, 2001).

use std::f64::consts::PI;

use glam::DVec3;

use crate::shaders::consts;

const TERMS: usize = consts::PROBE_TERMS as usize;
/// Number of normals for which a bake holds the irradiance of a probe.
pub const DIRECTIONS: usize = consts::PROBE_DIRECTIONS as usize;

/// The harmonics in a unit direction.
pub fn harmonics(d: DVec3) -> [f64; TERMS] {
    let band = |value: f64| value.sqrt();
    let (zero, one, two) = (band(0.25 / PI), band(0.75 / PI), band(3.75 / PI));
    [
        zero,
        one * d.y,
        one * d.z,
        one * d.x,
        two * d.x * d.y,
        two * d.y * d.z,
        band(0.3125 / PI) * (3.0 * d.z * d.z - 1.0),
        two * d.x * d.z,
        0.5 * two * (d.x * d.x - d.y * d.y),
    ]
}

/// The unit normals: the corners of an icosahedron. Twin of `probe_direction` (`probe.glsl`).
pub(super) fn directions() -> [DVec3; DIRECTIONS] {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let (short, long) = (1.0 / (1.0 + golden * golden).sqrt(), golden / (1.0 + golden * golden).sqrt());
    std::array::from_fn(|i| {
        let a = if i & 1 == 0 { short } else { -short };
        let b = if i & 2 == 0 { long } else { -long };
        match i / 4 {
            0 => DVec3::new(0.0, a, b),
            1 => DVec3::new(b, 0.0, a),
            _ => DVec3::new(a, b, 0.0),
        }
    })
}

/// Harmonics of irradiance, W/m², from those of radiance: the convolution with the cosine (equation 8 of the paper).
pub fn convolved(radiance: [f64; TERMS]) -> [f64; TERMS] {
    std::array::from_fn(|term| {
        let cosine = match term {
            0 => PI,
            1..=3 => 2.0 * PI / 3.0,
            _ => 0.25 * PI,
        };
        cosine * radiance[term]
    })
}

/// The value of harmonics in a unit direction.
pub fn irradiance(terms: &[f64; TERMS], normal: DVec3) -> f64 {
    harmonics(normal).iter().zip(terms).map(|(a, b)| a * b).sum()
}

/// Bands 1 and 2 of the zonal harmonics of the lobe of light that GGX microfacets of width `alpha` reflect to a viewer at the normal, relative to band 0:
/// 2/3 and 1/4 for `alpha` 1, as those of the cosine, and 1 for a mirror. Twin of `day_lobe` (`reflect.glsl`).
pub fn lobe(alpha: f64) -> [f64; 2] {
    [(0.602, 1.0 / 3.0), (1.512, 0.75)].map(|(slope, end)| 1.0 - alpha * (slope - alpha * (slope - end)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lobes_have_the_harmonics_of_their_integrals() {
        for alpha in [0.002, 0.04, 0.1, 0.25, 0.5, 0.8, 1.0] {
            let (mut weight, mut bands) = (0.0, [0.0; 2]);
            let count = 100_000;
            for i in 0..count {
                // The square of the cosine of a normal of GGX facets (Walter et al. 2007, equation 35), and the cosine of the light that it mirrors.
                let u = (f64::from(i) + 0.5) / f64::from(count);
                let square = (1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u);
                let cosine = 2.0 * square - 1.0;
                if cosine > 0.0 {
                    weight += cosine;
                    bands[0] += cosine * cosine;
                    bands[1] += cosine * (1.5 * cosine * cosine - 0.5);
                }
            }
            let [one, two] = lobe(alpha);
            assert!((one - bands[0] / weight).abs() < 0.014, "{alpha}: {one}, {}", bands[0] / weight);
            assert!((two - bands[1] / weight).abs() < 0.026, "{alpha}: {two}, {}", bands[1] / weight);
        }
    }

    fn sphere(count: usize) -> impl Iterator<Item = DVec3> {
        (0..count).map(move |i| {
            let z = 1.0 - 2.0 * (i as f64 + 0.5) / count as f64;
            let (s, phi) = ((1.0 - z * z).sqrt(), 2.399_963_229_728_653 * i as f64);
            DVec3::new(s * phi.cos(), s * phi.sin(), z)
        })
    }

    #[test]
    fn harmonics_are_orthonormal_over_the_sphere_and_over_the_twelve_directions() {
        let weighted: [(Vec<DVec3>, f64); 2] = [(sphere(20_000).collect(), 2e-4), (directions().to_vec(), 1e-12)];
        for (points, within) in weighted {
            for a in 0..TERMS {
                for b in 0..TERMS {
                    let sum: f64 = points.iter().map(|d| harmonics(*d)[a] * harmonics(*d)[b]).sum();
                    let found = sum * 4.0 * PI / points.len() as f64;
                    assert!((found - f64::from(u8::from(a == b))).abs() < within, "{a} {b}: {found}");
                }
            }
        }
    }

    #[test]
    fn irradiance_of_simple_skies_is_right() {
        // Radiance 1 everywhere; radiance 1 + d.y, whose irradiance is π + 2π/3 n.y.
        let project = |radiance: &dyn Fn(DVec3) -> f64| {
            let mut terms = [0.0; TERMS];
            let count = 50_000;
            for d in sphere(count) {
                let add = radiance(d) * 4.0 * PI / count as f64;
                terms.iter_mut().zip(harmonics(d)).for_each(|(term, y)| *term += add * y);
            }
            convolved(terms)
        };
        let (even, slope) = (project(&|_| 1.0), project(&|d| 1.0 + d.y));
        // Half of a sky: bands above the second are lost, so the truth π/2 (1 + n.y) is met where the half is seen whole or not at all.
        let half = project(&|d| f64::from(u8::from(d.y > 0.0)));
        for normal in directions() {
            assert!((irradiance(&even, normal) - PI).abs() < 1e-3);
            assert!((irradiance(&slope, normal) - PI - 2.0 * PI / 3.0 * normal.y).abs() < 1e-3);
            let truth = 0.5 * PI * (1.0 + normal.y);
            assert!((irradiance(&half, normal) - truth).abs() < 2e-3, "{normal}");
        }
    }
}
