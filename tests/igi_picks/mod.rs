//! CPU implementation (twin) of `igi/vpl_tree.glsl` in double precision: estimates of nodes, picks of virtual lights, and their probabilities.
#![allow(dead_code)]

use glam::{DVec3, Vec3};
use lucerna::shaders::types::{Vpl, VplNode};
use std::f64::consts::PI;

const LEAST_SHARE: f64 = 0.01;
const FLAT: f64 = 1e-4;

/// Smooth step of the bound.
pub fn bound(least: f64, distance: f64) -> f64 {
    if least <= 0.0 {
        return 1.0;
    }
    let x = ((distance - 0.8 * least) / (0.4 * least)).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// Unoccluded irradiance at a surface from a virtual light.
pub fn irradiance(vpl: &Vpl, point: DVec3, normal: DVec3, least: f64) -> DVec3 {
    let to = Vec3::from(vpl.position).as_dvec3() - point;
    let (d2, away) = (to.length_squared(), Vec3::from(vpl.normal).as_dvec3());
    let cosines = normal.dot(to).max(0.0) * (-away.dot(to)).max(0.0);
    if cosines <= 0.0 {
        return DVec3::ZERO;
    }
    Vec3::from(vpl.flux).as_dvec3() * (cosines / (d2 * d2) / PI * bound(least, d2.sqrt()))
}

/// Cosine of a − b for angles given by their cosines; the difference is 0 if a is smaller than b.
fn less(a: f64, b: f64) -> f64 {
    if a >= b { 1.0 } else { (a.acos() - b.acos()).cos() }
}

pub fn estimate(node: &VplNode, point: DVec3, normal: DVec3, least: f64) -> f64 {
    let (low, high) = (Vec3::from(node.low).as_dvec3(), Vec3::from(node.high).as_dvec3());
    let (way, extent) = (0.5 * (low + high) - point, 0.5 * (high - low));
    let height = normal.dot(way) + normal.abs().dot(extent);
    let farthest = (way.abs() + extent).length();
    if node.flux <= 0.0 || height <= FLAT * farthest || farthest <= 0.8 * least {
        return 0.0;
    }
    let (distance2, radius2) = (way.length_squared(), extent.length_squared());
    let mut cosines = (height / radius2.sqrt()).min(1.0);
    if distance2 > radius2 {
        let width = (1.0 - radius2 / distance2).sqrt();
        let to = way.normalize();
        let axis = Vec3::from(node.axis).as_dvec3();
        let off = less((-axis.dot(to)).clamp(-1.0, 1.0), f64::from(node.cos_spread).clamp(-1.0, 1.0));
        let sends = less(off.clamp(-1.0, 1.0), width);
        let takes = less(normal.dot(to).clamp(-1.0, 1.0), width);
        cosines = sends.max(0.0) * takes.max(0.0);
    }
    let bounded = if radius2 > 0.0 { 1.0 } else { bound(least, distance2.sqrt()) };
    f64::from(node.flux) * cosines * bounded / distance2.max(0.25 * radius2).max(0.64 * least * least)
}

/// Probability of the first child; `None` if neither child sends light.
fn first_share(first: f64, second: f64) -> Option<f64> {
    if first + second <= 0.0 {
        return None;
    }
    Some(match (first, second) {
        (_, 0.0) => 1.0,
        (0.0, _) => 0.0,
        _ => (first / (first + second)).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE),
    })
}

/// A light tree from the device, evaluated for one surface.
pub struct Chooser<'a> {
    pub nodes: &'a [VplNode],
    pub point: DVec3,
    pub normal: DVec3,
    pub least: f64,
}

impl Chooser<'_> {
    fn share(&self, node: usize) -> Option<f64> {
        let [a, b] = [0, 1].map(|i| estimate(&self.nodes[2 * node + i], self.point, self.normal, self.least));
        first_share(a, b)
    }

    /// Number of the virtual light and its probability.
    pub fn pick(&self, mut u: f64) -> Option<(usize, f64)> {
        let leaves = self.nodes.len() / 2;
        let (mut node, mut probability) = (1, 1.0);
        while node < leaves {
            let share = self.share(node)?;
            let first = u < share;
            u = if first { u / share } else { (u - share) / (1.0 - share) };
            probability *= if first { share } else { 1.0 - share };
            node = 2 * node + usize::from(!first);
        }
        Some((node - leaves, probability))
    }

    /// Irradiance by picks, without occlusion.
    pub fn picked(&self, vpls: &[Vpl], (picks, proposals): (u32, u32), start: f64, salt: [u32; 2], seed: u32) -> DVec3 {
        let all = f64::from(picks * proposals);
        let mut sum = DVec3::ZERO;
        for i in 0..picks {
            let (mut taken, mut strengths) = (DVec3::ZERO, 0.0);
            let mut u = unit(pcg4d([salt[0], salt[1], i, seed ^ 0x91c5])[0]);
            for j in 0..proposals {
                let Some((k, p)) = self.pick((f64::from(i * proposals + j) + start) / all) else { continue };
                let sent = irradiance(&vpls[k], self.point, self.normal, self.least) / (p * all);
                let weight = sent.element_sum();
                if weight > 0.0 {
                    strengths += weight;
                    let share = weight / strengths;
                    (taken, u) = if u < share { (sent, u / share) } else { (taken, (u - share) / (1.0 - share)) };
                }
            }
            if strengths > 0.0 {
                sum += taken * (strengths / taken.element_sum());
            }
        }
        sum
    }

    /// Probability of every leaf, and of picking no light.
    pub fn probabilities(&self) -> (Vec<f64>, f64) {
        let leaves = self.nodes.len() / 2;
        let (mut out, mut none) = (vec![0.0; leaves], 0.0);
        let mut open = vec![(1, 1.0)];
        while let Some((node, probability)) = open.pop() {
            if node >= leaves {
                out[node - leaves] = probability;
                continue;
            }
            match self.share(node) {
                None => none += probability,
                Some(share) => {
                    open.extend([(2 * node, probability * share), (2 * node + 1, probability * (1.0 - share))])
                }
            }
        }
        (out, none)
    }
}

/// A number in [0, 1) from random bits.
fn unit(bits: u32) -> f64 {
    f64::from(bits >> 8) / 16_777_216.0
}

fn pcg4d(mut v: [u32; 4]) -> [u32; 4] {
    let mix = |v: &mut [u32; 4]| {
        for (to, a, b) in [(0, 1, 3), (1, 2, 0), (2, 0, 1), (3, 1, 2)] {
            v[to] = v[to].wrapping_add(v[a].wrapping_mul(v[b]));
        }
    };
    v = v.map(|x| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    mix(&mut v);
    v = v.map(|x| x ^ x >> 16);
    mix(&mut v);
    v
}

/// Offset of the stratified numbers of a texel's picks.
pub fn offset(tile: [u32; 2], subset: u32, subsets: u32, seed: u32) -> f64 {
    let turn = unit(pcg4d([seed, 0x9e3, 0x51, 0x7c1])[0]);
    let place = tile[0].wrapping_mul(3_242_174_889).wrapping_add(tile[1].wrapping_mul(2_447_445_414));
    (unit(place) + turn + f64::from(subset) / f64::from(subsets)).fract()
}
