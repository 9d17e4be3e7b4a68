//! Slow twin of the fullsphere irradiance vectors (Michael 2010, chapter 3): sums over the texels of the environment in
//! double precision, rays through the hierarchy of the CPU, lookups and the overlap correction.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec3};

use crate::{
    scene::bvh::{Bvh, Ray},
    techniques::fiv::{
        samples::{Grid, Shells},
        sky::{self, Sky},
        spacing::Spacing,
        surface::Place,
    },
};

/// One 3-vector per colour channel, stored as the colours of x, y and z, W/m².
pub type Vectors = [DVec3; 3];

/// normal · FIV for each channel, W/m² ([FIV 11]).
pub fn dot(vectors: &Vectors, normal: DVec3) -> DVec3 {
    vectors[0] * normal.x + vectors[1] * normal.y + vectors[2] * normal.z
}

fn texels(sky: &Sky) -> impl Iterator<Item = (DVec3, DVec3)> + '_ {
    sky.radiance.iter().enumerate().map(|(i, radiance)| {
        let (face, x, y) = sky::place(sky.size, i as u32);
        (radiance.as_dvec3(), sky::area(face, sky.size, x, y))
    })
}

/// Irradiance for a normal, W/m² ([FIV 6] with the solid angle).
pub fn irradiance(sky: &Sky, normal: DVec3) -> DVec3 {
    texels(sky).map(|(radiance, area)| radiance * area.dot(normal).max(0.0)).sum()
}

/// Vectors of the whole environment ([FIV 10]).
pub fn total(sky: &Sky) -> Vectors {
    texels(sky).fold(Vectors::default(), |sum, (radiance, area)| add(sum, radiance, area))
}

fn add(mut sum: Vectors, radiance: DVec3, area: DVec3) -> Vectors {
    for (axis, color) in sum.iter_mut().enumerate() {
        *color += radiance * area[axis];
    }
    sum
}

/// The light that an occluder hides.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hidden {
    /// W/m²
    pub vectors: Vectors,
    /// Steradians.
    pub angle: f64,
}

/// The part of the environment that geometry hides from a point: texels whose `split`² rays hit the geometry.
pub fn hidden(sky: &Sky, geometry: &Bvh, point: Vec3, split: u32) -> Hidden {
    let side = sky.size * split;
    let mut out = Hidden::default();
    for ray in 0..6 * side * side {
        let (face, x, y) = sky::place(side, ray);
        let st = (DVec2::new(x.into(), y.into()) + 0.5) / f64::from(side);
        if !geometry.any(&Ray::new(point, sky::direction(face, st).as_vec3())) {
            continue;
        }
        let (tx, ty) = (x / split, y / split);
        let share = 1.0 / f64::from(split * split);
        let radiance = sky.radiance[((face * sky.size + ty) * sky.size + tx) as usize].as_dvec3();
        out.vectors = add(out.vectors, radiance, sky::area(face, sky.size, tx, ty) * share);
        out.angle += sky::solid_angle(sky.size, tx, ty) * share;
    }
    out
}

/// Vectors of the part of the environment in front of a surface sample that geometry does not hide, and its solid angle
/// in steradians.
pub fn seen(sky: &Sky, geometry: &Bvh, place: Place, split: u32) -> (Vectors, f64) {
    let side = sky.size * split;
    let share = 1.0 / f64::from(split * split);
    let mut out = (Vectors::default(), 0.0);
    for ray in 0..6 * side * side {
        let (face, x, y) = sky::place(side, ray);
        let (tx, ty) = (x / split, y / split);
        let area = sky::area(face, sky.size, tx, ty);
        let st = (DVec2::new(x.into(), y.into()) + 0.5) / f64::from(side);
        if area.dot(place.normal.as_dvec3()) <= 0.0
            || geometry.any(&Ray::new(place.point, sky::direction(face, st).as_vec3()))
        {
            continue;
        }
        let radiance = sky.radiance[((face * sky.size + ty) * sky.size + tx) as usize].as_dvec3();
        out.0 = add(out.0, radiance, area * share);
        out.1 += sky::solid_angle(sky.size, tx, ty) * share;
    }
    out
}

/// Precomputed vectors of one occluder.
#[derive(Clone, Copy, Debug)]
pub struct Set<'a> {
    pub grid: Grid,
    pub shells: Shells,
    /// Spacing of the samples.
    pub spacing: &'a Spacing,
    /// Radius of the bounding sphere, metres, if vectors are interpolated relative to its solid angle.
    pub solid: Option<f64>,
    /// Nine floats for each sample.
    pub fivs: &'a [f32],
}

impl Set<'_> {
    fn at(&self, sample: u32) -> Option<Vectors> {
        let floats = &self.fivs[9 * sample as usize..][..9];
        let color = |k: usize| Vec3::from_slice(&floats[3 * k..]).as_dvec3();
        (floats[0] < crate::shaders::consts::FIV_INSIDE).then(|| [color(0), color(1), color(2)])
    }

    /// Vectors of the light that the occluder hides if its centre lies at `offset` (metres) from the receiver, and the
    /// share of the interpolation weight of samples outside the occluder. Trilinear in azimuth, polar angle and
    /// logarithm of the radius.
    pub fn lookup(&self, offset: DVec3) -> (Vectors, f64) {
        let Grid { azimuths, polars, radii } = self.grid;
        let rho = offset.length();
        let far = f64::from(self.shells.farthest);
        let [a, p, r] = self.spacing.numbers(&self.grid, &self.shells, offset);
        let (a0, p0, r0) = ((a as u32).min(azimuths - 1), (p as u32).min(polars - 2), (r as u32).min(radii - 2));
        let growth = |sphere: u32| {
            let size = |rho: f64| self.solid.map_or(1.0, |radius| rho.max(radius).powi(2));
            size(self.spacing.radius(&self.grid, &self.shells, sphere)) / size(rho.min(far))
        };
        let (mut sum, mut weights) = (Vectors::default(), 0.0);
        for (da, dp, dr) in (0..8).map(|k| (k & 1, k >> 1 & 1, k >> 2)) {
            let part = |at: f64, low: u32, step: u32| {
                let x = at - f64::from(low);
                if step == 1 { x } else { 1.0 - x }
            };
            let weight = part(a, a0, da) * part(p, p0, dp) * part(r, r0, dr);
            let sample = self.grid.index((a0 + da) % azimuths, p0 + dp, r0 + dr);
            if let Some(vectors) = self.at(sample).filter(|_| weight > 0.0) {
                let grown = weight * growth(r0 + dr);
                (0..3).for_each(|axis| sum[axis] += vectors[axis] * grown);
                weights += weight;
            }
        }
        let beyond = (far / rho.max(1e-30)).min(1.0);
        let scale = if weights > 0.0 { beyond * beyond / weights } else { 0.0 };
        (sum.map(|v| v * scale), weights)
    }
}

/// Area that two discs have in common. `r1`, `r2`: radii, `d`: distance of the centres.
pub fn lens(r1: f64, r2: f64, d: f64) -> f64 {
    if d >= r1 + r2 {
        return 0.0;
    }
    if d <= (r1 - r2).abs() {
        return PI * r1.min(r2).powi(2);
    }
    let sector = |r: f64, s: f64| {
        let half = ((d * d + r * r - s * s) / (2.0 * d * r)).clamp(-1.0, 1.0).acos();
        r * r * (half - half.sin() * half.cos())
    };
    sector(r1, r2) + sector(r2, r1)
}

/// Share of a bounding sphere in front of a plane at distance `d` from its centre (section 3.3.3.1, partial occluders).
pub fn front(d: f64, radius: f64) -> f64 {
    ((d + radius) / (2.0 * radius)).clamp(0.0, 1.0)
}

/// Share of the irradiance of constant radiance that the part of a ball in front of the receiver's plane hides. The
/// centre of the ball is `d` in front of the plane and `rho` from the receiver, metres. Closed form (Snyder, Area Light
/// Sources for Real-Time Graphics, 1996).
pub fn ball(d: f64, rho: f64, radius: f64) -> f64 {
    let h = (rho / radius).max(1.0001);
    let c = (d / rho.max(1e-20)).clamp(-1.0, 1.0);
    let squared = 1.0 - (h * c).powi(2);
    if squared <= 0.0 {
        return c.max(0.0) / (h * h);
    }
    let g = (h * h - 1.0).sqrt();
    let side = (-c * g / (1.0 - c * c).max(1e-20).sqrt()).clamp(-1.0, 1.0).acos();
    ((c * side - squared.sqrt() * g) / (h * h) + (squared.sqrt() / g).atan()) / PI
}

/// Irradiance that a ball hides if the receiver's plane cuts it. `hidden` is normal · FIV of the ball. `open` is the
/// irradiance of the environment for the normal, `behind` for the opposite normal. normal · FIV is the light hidden in
/// front minus the light hidden behind. One of the two is estimated as if radiance were constant. The smaller estimate
/// gets the larger weight. `fill`: share of the ball that is not a hole.
pub fn cut(hidden: DVec3, (open, behind): (DVec3, DVec3), (d, rho, radius): (f64, f64, f64), fill: f64) -> DVec3 {
    let under = behind * (fill * ball(-d, rho, radius));
    let over = open * (fill * ball(d, rho, radius));
    let ratio = (under / over.max(DVec3::splat(1e-30))).min(DVec3::splat(1e15));
    let weight = (1.0 + ratio * ratio).recip();
    (over + (hidden + under - over) * weight).clamp(DVec3::ZERO, open)
}

/// Share of its hidden irradiance that is subtracted for each occluder (centre relative to the receiver, radius). For
/// two occluders this is 1 − Overlapped% of [FIV 15], so that the sum of both is [FIV 14]. For more occluders it is the
/// mean of 1 / (1 + number of other occluders at a point), with independent occluders.
pub fn shares(normal: DVec3, occluders: &[(DVec3, f64)]) -> Vec<f64> {
    let disc = |&(to, radius): &(DVec3, f64)| (to.normalize_or_zero(), (radius / to.length().max(1e-20)).min(1.0));
    let share = |i: usize| {
        let (at, r) = disc(&occluders[i]);
        let others: Vec<f64> = (0..occluders.len())
            .filter(|&j| j != i)
            .map(|j| {
                let (other, s) = disc(&occluders[j]);
                let both = 2.0 * lens(r, s, at.distance(other)) / (PI * (r * r + s * s));
                both * front(occluders[j].0.dot(normal), occluders[j].1)
            })
            .collect();
        // Distribution of the number of other occluders, a sum of independent events.
        let mut chances = vec![1.0];
        for g in others {
            let mut next = vec![0.0; chances.len() + 1];
            for (k, chance) in chances.iter().enumerate() {
                next[k] += chance * (1.0 - g);
                next[k + 1] += chance * g;
            }
            chances = next;
        }
        chances.iter().enumerate().map(|(k, chance)| chance / (k + 1) as f64).sum()
    };
    (0..occluders.len()).map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Environment;
    use std::f64::consts::TAU;

    fn even(size: u32) -> Sky {
        Sky::new(Some(&Environment::constant(Vec3::new(1.0, 2.0, 0.5))), size).unwrap()
    }

    fn normals() -> impl Iterator<Item = DVec3> {
        (0..40).map(|i| {
            let y = 1.0 - (f64::from(i) + 0.5) / 20.0;
            let (sin, cos) = (2.399 * f64::from(i)).sin_cos();
            DVec3::new((1.0 - y * y).sqrt() * cos, y, (1.0 - y * y).sqrt() * sin)
        })
    }

    #[test]
    fn even_light_gives_pi_for_every_normal_and_no_vector() {
        let sky = even(32);
        for n in normals().chain([DVec3::X, DVec3::NEG_Y, DVec3::Z]) {
            // Texels on the horizon count with their mean cosine, which is slightly too small.
            let found = irradiance(&sky, n).x / PI;
            assert!((0.9993..1.000001).contains(&found), "{n}: {found}");
        }
        assert!(total(&sky).iter().all(|v| v.length() < 1e-7));
    }

    #[test]
    fn the_vector_is_the_difference_of_front_and_back() {
        // Gershun's identity, exact for any radiance.
        let mut sky = even(16);
        for (i, r) in sky.radiance.iter_mut().enumerate() {
            *r = Vec3::new((i * 7919 % 101) as f32, (i % 3) as f32, 0.1);
        }
        let whole = total(&sky);
        for n in normals() {
            let found = dot(&whole, n);
            let exact = irradiance(&sky, n) - irradiance(&sky, -n);
            assert!((found - exact).length() < 1e-9 * irradiance(&sky, n).length(), "{n}: {found} and {exact}");
        }
    }

    #[test]
    fn lenses_of_equal_touching_disjoint_and_nested_discs() {
        assert_eq!(lens(1.0, 1.0, 2.0), 0.0);
        assert_eq!(lens(1.0, 0.5, 3.0), 0.0);
        assert!((lens(1.0, 1.0, 0.0) - PI).abs() < 1e-12);
        assert!((lens(2.0, 0.5, 1.0) - 0.25 * PI).abs() < 1e-12);
        // Through each other's centre: 2π/3 − √3/2.
        assert!((lens(1.0, 1.0, 1.0) - (2.0 * PI / 3.0 - 0.75f64.sqrt())).abs() < 1e-12);
        // By counting.
        let (r1, r2, d, n) = (1.0, 0.7, 0.9, 1000);
        let inside = |x: f64, y: f64| x * x + y * y < r1 * r1 && (x - d).powi(2) + y * y < r2 * r2;
        let at = |i: i32| 4.0 * (f64::from(i) + 0.5) / f64::from(n) - 2.0;
        let count = (0..n * n).filter(|k| inside(at(k % n), at(k / n))).count();
        let counted = count as f64 * (4.0 / f64::from(n)).powi(2);
        assert!((lens(r1, r2, d) - counted).abs() < 1e-3, "{counted}");
    }

    #[test]
    fn shares_of_two_are_the_thesis_and_of_many_the_union() {
        let up = DVec3::Y;
        let at = |x: f64| (DVec3::new(x, 2.0, 0.0), 0.5);
        for (a, b) in [(at(0.0), at(0.4)), (at(0.1), at(9.0)), ((DVec3::new(0.0, 4.0, 0.0), 1.5), at(0.3))] {
            let [r, s] = [a, b].map(|o: (DVec3, f64)| o.1 / o.0.length());
            let both = lens(r, s, a.0.normalize().distance(b.0.normalize()));
            let exact = 1.0 - both / (PI * (r * r + s * s));
            for share in shares(up, &[a, b]) {
                assert!((share - exact).abs() < 1e-12);
            }
        }
        // Many in the same place hide as much as one.
        for count in 1..8 {
            let all = shares(up, &vec![at(0.2); count]);
            assert!((all.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{count}");
        }
        // Occluders behind the receiver hide no light.
        assert_eq!(shares(up, &[at(0.0), (DVec3::new(0.0, -2.0, 0.0), 0.5)])[0], 1.0);
        assert_eq!((front(-1.0, 1.0), front(0.0, 1.0), front(1.0, 1.0), front(0.5, 1.0)), (0.0, 0.5, 1.0, 0.75));
    }

    #[test]
    fn balls_that_are_cut_hide_what_counting_finds() {
        let sum = |d: f64, rho: f64, radius: f64| {
            let to = DVec3::new((rho * rho - d * d).sqrt(), d, 0.0);
            let steps = 600;
            // Even over the projected hemisphere.
            let at = |i: i32| 2.0 * (f64::from(i) + 0.5) / f64::from(steps) - 1.0;
            let (mut met, mut all) = (0, 0);
            for (x, z) in (0..steps * steps).map(|k| (at(k % steps), at(k / steps))) {
                let squared = 1.0 - x * x - z * z;
                if squared > 0.0 {
                    let along = to.dot(DVec3::new(x, squared.sqrt(), z));
                    all += 1;
                    met += i32::from(along > 0.0 && rho * rho - along * along < radius * radius);
                }
            }
            f64::from(met) / f64::from(all)
        };
        for (d, rho, radius) in
            [(0.0, 2.0, 1.0), (0.7, 1.2, 1.0), (-0.6, 1.5, 1.0), (-0.9, 1.01, 1.0), (3.0, 3.5, 1.0), (0.2, 9.0, 4.0)]
        {
            let (found, exact) = (ball(d, rho, radius), sum(d, rho, radius));
            assert!((found - exact).abs() < 2e-3, "{d} {rho} {radius}: {found} instead of {exact}");
        }
        assert_eq!((ball(-1.0, 2.0, 1.0), ball(-2.0, 2.0, 1.0)), (0.0, 0.0));
        assert!((ball(2.0, 2.0, 1.0) - 0.25).abs() < 1e-12);
    }

    #[test]
    fn cut_balls_are_exact_in_even_light_and_in_light_from_one_side() {
        let (front, back) = (DVec3::new(2.0, 1.0, 0.0), DVec3::new(0.5, 3.0, 1.0));
        let (rho, radius) = (1.6, 1.0);
        let vector = |d: f64, back: DVec3| front * ball(d, rho, radius) - back * ball(-d, rho, radius);
        for step in -20..=20 {
            let d = 0.06 * f64::from(step);
            let exact = front * ball(d, rho, radius);
            for behind in [back, DVec3::ZERO, 100.0 * back] {
                let found = cut(vector(d, behind), (front, behind), (d, rho, radius), 1.0);
                assert!((found - exact).length() < 1e-12, "{d}: {found} instead of {exact}");
            }
            // A ball wholly in front or behind needs no estimate, so a wrong estimate has no effect.
            let found = cut(vector(d, back), (front, back), (d, rho, radius), 0.1);
            let apart = (found - exact).length();
            assert!(if d.abs() >= radius { apart < 1e-12 } else { apart < 0.5 * front.length() }, "{d}: {found}");
        }
        // All light from in front: the vector is right already, whatever the occluder is like.
        let hidden = DVec3::splat(0.3);
        assert_eq!(cut(hidden, (front, DVec3::ZERO), (0.1, rho, radius), 0.7), hidden.min(front));
    }

    #[test]
    fn lookups_are_exact_at_samples_and_go_on_over_the_seam_and_the_poles() {
        let (grid, shells) = (Grid::of(12, 7, 5), Shells { nearest: 0.5, farthest: 8.0 });
        // Something smooth in direction and radius, one value at the poles.
        let light = |d: DVec3| {
            let n = d.normalize();
            [n * 0.5 + 1.0, DVec3::splat(n.x * n.y), DVec3::new(n.z, 1.0, d.length().ln())]
        };
        let mut fivs = vec![];
        for i in 0..grid.count() {
            let v = light(shells.offset(&grid, i));
            fivs.extend(v.iter().flat_map(|c| c.to_array()).map(|x| x as f32));
        }
        let set = Set { grid, shells, spacing: &Spacing::default(), solid: None, fivs: &fivs };
        let close = |a: &Vectors, b: &Vectors, slack: f64| (0..3).all(|k| (a[k] - b[k]).length() < slack);
        for i in 0..grid.count() {
            let offset = shells.offset(&grid, i);
            let (found, weight) = set.lookup(offset);
            assert!(close(&found, &light(offset), 1e-5) && (weight - 1.0).abs() < 1e-9, "{i}: {found:?}");
        }
        for polar in [0.01, 0.3, 1.0, 2.9, 3.13] {
            let near = |azimuth: f64| {
                let (sin, cos) = f64::sin_cos(azimuth);
                set.lookup(DVec3::new(f64::sin(polar) * sin, f64::cos(polar), -f64::sin(polar) * cos) * 2.0).0
            };
            assert!(close(&near(1e-7), &near(-1e-7), 1e-5), "{polar}");
            for k in 0..100 {
                let azimuth = TAU * f64::from(k) / 100.0;
                assert!(close(&near(azimuth), &near(azimuth + 0.01), 0.02));
            }
        }
        // Farther out by the solid angle, farther in as at the first sphere.
        let d = DVec3::new(0.3, 0.5, -0.4).normalize();
        let (edge, far) = (set.lookup(8.0 * d).0, set.lookup(24.0 * d).0);
        assert!(close(&edge.map(|v| v / 9.0), &far, 1e-9));
        assert!(close(&set.lookup(0.5 * d).0, &set.lookup(0.1 * d).0, 1e-9));
    }

    #[test]
    fn what_falls_with_the_solid_angle_is_exact_between_spheres() {
        let (grid, shells) = (Grid::of(12, 7, 4), Shells { nearest: 0.5, farthest: 8.0 });
        let light = |d: DVec3| 3.0 / d.length_squared().max(1.0);
        let fivs: Vec<f32> = (0..grid.count()).flat_map(|i| [light(shells.offset(&grid, i)) as f32; 9]).collect();
        let spacing = Spacing::default();
        let set = |solid| Set { grid, shells, spacing: &spacing, solid, fivs: &fivs };
        for rho in [0.2, 0.5, 0.7, 1.0, 1.3, 2.0, 3.1, 5.0, 7.9, 8.0, 13.0] {
            let d = DVec3::new(0.48, -0.6, 0.64) * rho;
            let error = |solid| (set(solid).lookup(d).0[1].x / light(d) - 1.0).abs();
            assert!(error(Some(1.0)) < 1e-6, "{rho}: {}", error(Some(1.0)));
            // Spheres are at 0.5, 1.26, 3.17 and 8.
            assert!(![2.0, 5.0].contains(&rho) || error(None) > 0.1, "{rho}: {}", error(None));
        }
    }

    #[test]
    fn samples_inside_are_left_out() {
        let (grid, shells) = (Grid::of(4, 3, 2), Shells { nearest: 1.0, farthest: 2.0 });
        let mut fivs = vec![2.0f32; 9 * grid.count() as usize];
        (0..grid.index(0, 0, 1) as usize).for_each(|i| fivs[9 * i] = 2e38);
        let set = Set { grid, shells, spacing: &Spacing::default(), solid: None, fivs: &fivs };
        let (found, weight) = set.lookup(DVec3::X * 2f64.sqrt());
        assert!((found[0].x - 2.0).abs() < 1e-9 && (weight - 0.5).abs() < 1e-9);
        assert_eq!(set.lookup(DVec3::X), (Vectors::default(), 0.0));
    }
}
