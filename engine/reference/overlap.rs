//! Slow twin of the overlap correction: every pair of occluders in double precision.

use std::f64::consts::PI;

use glam::DVec3;

use super::fiv::{front, lens};
use crate::techniques::fiv::{Shared, spots::Spot};

/// An occluder as a receiver sees it.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Offset of the bounding sphere's centre from the receiver, metres.
    pub offset: DVec3,
    /// Radius of the bounding sphere, metres.
    pub radius: f64,
    /// Mean share of its bounding disc that it fills.
    pub fill: f64,
    /// Irradiance that it would hide alone if it lay wholly in front of the receiver's plane, W/m².
    pub hidden: DVec3,
    /// Half the angle between two samples, radians: interpolated shadow edges are this soft.
    pub soft: f64,
}

impl Seen {
    /// Direction and sine of the radius of its disc.
    fn disc(&self) -> (DVec3, f64) {
        (self.offset.normalize_or_zero(), (self.radius / self.offset.length().max(1e-20)).min(1.0))
    }
}

/// Irradiance that is left of `open` (W/m²). For two occluders without bright parts this is [FIV 15] for discs that are
/// partly filled. For more occluders the factor is the mean of 1 / (1 + number of other occluders at a point), with
/// independent occluders. With [`Shared::Lights`] the irradiance that an occluder hides beyond its share of constant
/// radiance is subtracted from the bright parts that its disc can cover, and at most all light of each part is
/// subtracted.
pub fn left(open: DVec3, normal: DVec3, occluders: &[Seen], spots: &[Spot], shared: Shared) -> DVec3 {
    let spots = if shared == Shared::Lights && occluders.len() > 1 { spots } else { &[] };
    let light = |spot: &Spot| {
        let [x, y, z] = spot.vectors;
        (x * normal.x + y * normal.y + z * normal.z).max(DVec3::ZERO)
    };
    let even = spots.iter().fold(open, |rest, spot| (rest - light(spot)).max(DVec3::ZERO));
    let mut sum = open;
    let mut gone = vec![DVec3::ZERO; spots.len()];
    for (i, own) in occluders.iter().enumerate() {
        let (direction, r) = own.disc();
        let height = own.offset.dot(normal);
        let before = front(height, own.radius);
        let hidden = own.hidden.max(DVec3::ZERO) * before;
        let others = occluders.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, o)| o);
        let share = share(own, others, normal, shared);
        let cosine = (height / own.offset.length().max(1e-20)).max(0.4 * r);
        let could: Vec<DVec3> = spots.iter().map(|s| light(s) * reached(s, direction, r, own.soft)).collect();
        let all: DVec3 = could.iter().copied().sum();
        let bright = (hidden - even * (own.fill * before * r * r * cosine)).max(DVec3::ZERO).min(all);
        for (gone, could) in gone.iter_mut().zip(&could) {
            *gone += share * bright * *could / all.max(DVec3::splat(1e-30));
        }
        sum -= (hidden - bright) * share;
    }
    let spent: DVec3 = spots.iter().zip(gone).map(|(spot, gone)| gone.min(light(spot))).sum();
    (sum - spent).max(DVec3::ZERO)
}

/// Share of the irradiance that `own` hides that is subtracted for it.
fn share<'a>(own: &Seen, others: impl Iterator<Item = &'a Seen>, normal: DVec3, shared: Shared) -> f64 {
    let (direction, r) = own.disc();
    let fill = |o: &Seen| if shared == Shared::Discs { 1.0 } else { o.fill };
    // Distribution of the number of other occluders, a sum of independent events.
    let mut chances = vec![1.0];
    for other in others {
        let (at, s) = other.disc();
        let (f, g) = (fill(own), fill(other));
        let both = 2.0 * lens(r, s, direction.distance(at)) * f * g / (PI * (r * r * f + s * s * g));
        let there = both * front(other.offset.dot(normal), other.radius);
        let mut next = vec![0.0; chances.len() + 1];
        for (k, chance) in chances.iter().enumerate() {
            next[k] += chance * (1.0 - there);
            next[k + 1] += chance * there;
        }
        chances = next;
    }
    chances.iter().enumerate().map(|(k, chance)| chance / (k + 1) as f64).sum()
}

/// Share of a bright part that a disc can hide.
fn reached(spot: &Spot, direction: DVec3, r: f64, soft: f64) -> f64 {
    let b = f64::from(spot.packed().radius);
    let apart = spot.direction.distance(direction);
    (r * r / (b * b)).min(1.0) * ((r + b + soft - apart) / (2.0 * r.min(b) + soft)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small light above and constant radiance, of one W/m² each.
    fn sun() -> Spot {
        Spot { direction: DVec3::Y, angle: 1e-3, vectors: [DVec3::ZERO, DVec3::ONE, DVec3::ZERO] }
    }

    fn over(height: f64, x: f64, hidden: f64) -> Seen {
        Seen { offset: DVec3::new(x, height, 0.0), radius: 1.0, fill: 0.3, hidden: DVec3::splat(hidden), soft: 0.05 }
    }

    #[test]
    fn one_shadow_on_another_leaves_a_light_hidden_once() {
        let open = DVec3::splat(2.0);
        // Each occluder hides the sun and a hundredth of the other light.
        let two = [over(5.0, 0.0, 1.012), over(9.0, 0.0, 1.0037)];
        let once = left(open, DVec3::Y, &two, &[sun()], Shared::Lights);
        assert!((once.x - 0.985).abs() < 0.01, "{once}");
        // By the mean fill alone the second occluder would mostly hide other light.
        let twice = left(open, DVec3::Y, &two, &[sun()], Shared::Filled);
        assert!(twice.x < 0.2, "{twice}");
        // Occluders that do not overlap are subtracted separately.
        let apart = [over(5.0, 3.0, 0.01), over(5.0, -3.0, 0.01), two[0]];
        let left_over = left(open, DVec3::Y, &apart, &[sun()], Shared::Lights);
        assert!((left_over.x - (2.0 - 1.012 - 0.02)).abs() < 1e-9, "{left_over}");
    }

    #[test]
    fn any_order_gives_the_same_and_no_step() {
        let open = DVec3::splat(2.0);
        let at = |t: f64| [over(5.0, -1.0 + t, 0.7), over(7.0, 1.0 - 2.0 * t, 0.9), over(3.0, t * t, 0.3)];
        let mut last: Option<f64> = None;
        for step in 0..=400 {
            let three = at(f64::from(step) / 200.0);
            let of = |order: [usize; 3]| left(open, DVec3::Y, &order.map(|i| three[i]), &[sun()], Shared::Lights).x;
            let found = of([0, 1, 2]);
            assert!([of([2, 1, 0]), of([1, 2, 0])].iter().all(|other| (other - found).abs() < 1e-12));
            if let Some(last) = last {
                assert!((found - last).abs() < 0.06, "{step}: {last} to {found}");
            }
            last = Some(found);
        }
    }

    #[test]
    fn without_bright_parts_two_are_as_the_thesis_has_them() {
        let full = |x: f64| Seen { fill: 1.0, ..over(4.0, x, 0.2) };
        let two = [full(0.0), full(0.6)];
        let shares = super::super::fiv::shares(DVec3::Y, &two.map(|o| (o.offset, o.radius)));
        let exact = 1.0 - 0.2 * (shares[0] + shares[1]);
        for shared in [Shared::Discs, Shared::Filled, Shared::Lights] {
            let found = left(DVec3::ONE, DVec3::Y, &two, &[], shared).x;
            assert!((found - exact).abs() < 1e-12, "{shared:?}: {found} {exact}");
        }
    }
}
