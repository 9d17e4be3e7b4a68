//! Distances from a probe to the surfaces around it: octahedral maps of their mean and mean square (Majercik, Guertin, Nowrouzezahrai and
//! McGuire, Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields, 2019), and probes that leave solids.

use glam::{Vec2, Vec3};
use half::f16;

use crate::shaders::{consts, types};

pub(super) const SIDE: usize = consts::PROBE_SIDE as usize;
/// Texels of a map.
pub(super) const TEXELS: usize = SIDE * SIDE;
/// Share of paths that hit the inside of a solid from which on the probe counts as inside.
const INSIDE: f32 = 0.25;

/// Mean and mean square of the distance in each texel's direction, metres and square metres.
pub(super) type Map = [[f16; 2]; TEXELS];

/// The unit direction of the middle of each texel. Twin of `octahedral_decode` (`lib/gbuffer.glsl`).
fn directions() -> [Vec3; TEXELS] {
    std::array::from_fn(|i| {
        let p = (Vec2::new((i % SIDE) as f32, (i / SIDE) as f32) + 0.5) / SIDE as f32 * 2.0 - 1.0;
        let z = 1.0 - p.x.abs() - p.y.abs();
        let fold = (-z).max(0.0);
        Vec3::new(p.x - fold.copysign(p.x), p.y - fold.copysign(p.y), z).normalize()
    })
}

/// The sums of one probe.
#[derive(Clone, Debug)]
pub(super) struct Distances {
    directions: [Vec3; TEXELS],
    /// Longer distances count as this one.
    most: f32,
    /// Of weights, weighted distances and weighted squares.
    sums: [[f64; 3]; TEXELS],
    inside: u32,
    count: u32,
}

impl Distances {
    pub(super) fn new(most: f32) -> Self {
        Self { directions: directions(), most, sums: [[0.0; 3]; TEXELS], inside: 0, count: 0 }
    }

    pub(super) fn add(&mut self, starts: &[types::DayStart]) {
        for start in starts {
            self.count += 1;
            self.inside += u32::from(start.distance < 0.0);
            let (toward, distance) = (Vec3::from(start.direction), start.distance.abs().min(self.most));
            for (direction, sums) in self.directions.iter().zip(&mut self.sums) {
                let cosine = toward.dot(*direction);
                // The weight is the cosine to the power of 64, which is below a thousandth beyond 26 degrees.
                if cosine > 0.9 {
                    let weight = f64::from((0..6).fold(cosine, |power, _| power * power));
                    sums[0] += weight;
                    sums[1] += weight * f64::from(distance);
                    sums[2] += weight * f64::from(distance) * f64::from(distance);
                }
            }
        }
    }

    /// Most of what the probe sees is the inside of solids.
    pub(super) fn is_inside(&self) -> bool {
        self.inside as f32 > INSIDE * self.count as f32
    }

    /// The map. Directions in which no path started count as open.
    pub(super) fn map(&self) -> Map {
        self.sums.map(|[weight, mean, square]| {
            let of = |sum: f64, open: f32| if weight > 0.0 { sum / weight } else { f64::from(open) };
            [of(mean, self.most), of(square, self.most * self.most)].map(f16::from_f64)
        })
    }
}

/// Where a probe goes from `offset`: out of the solid that it is in, or away from the nearest surface if that is nearer than `margin`. It stays
/// within `most` of its place along each axis.
pub(super) fn moved(offset: Vec3, starts: &[types::DayStart], margin: f32, most: Vec3) -> Vec3 {
    let nearest = |wanted: fn(&&types::DayStart) -> bool| {
        starts.iter().filter(wanted).min_by(|a, b| a.distance.abs().total_cmp(&b.distance.abs()))
    };
    let inside = starts.iter().filter(|start| start.distance < 0.0).count();
    let step = if inside as f32 > INSIDE * starts.len() as f32 {
        nearest(|start| start.distance < 0.0).map(|out| Vec3::from(out.direction) * (margin - out.distance))
    } else {
        nearest(|start| start.distance >= 0.0)
            .filter(|near| near.distance < margin)
            .map(|near| Vec3::from(near.direction) * (near.distance - margin))
    };
    (offset + step.unwrap_or_default()).clamp(-most, most)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn starts(distance: impl Fn(Vec3) -> f32) -> Vec<types::DayStart> {
        (0..4096)
            .map(|i| {
                let z = 1.0 - 2.0 * (i as f32 + 0.5) / 4096.0;
                let (s, phi) = ((1.0 - z * z).sqrt(), 2.399_963_1 * i as f32);
                let direction = Vec3::new(s * phi.cos(), s * phi.sin(), z);
                types::DayStart { direction: direction.to_array(), distance: distance(direction) }
            })
            .collect()
    }

    #[test]
    fn maps_have_the_distances_of_their_directions() {
        let mut distances = Distances::new(3.0);
        distances.add(&starts(|d| if d.y < 0.0 { -1.0 / d.y } else { 1e30 }));
        assert!(!distances.is_inside());
        for ([mean, square], direction) in distances.map().iter().zip(directions()) {
            let wanted = if direction.y < 0.0 { (-1.0 / direction.y).min(3.0) } else { 3.0 };
            let (mean, square) = (mean.to_f32(), square.to_f32());
            assert!((mean - wanted).abs() < 0.35, "{direction}: {mean}, not {wanted}");
            assert!(square > mean * mean - 0.01, "{direction}");
        }
    }

    #[test]
    fn probes_leave_solids_and_surfaces() {
        let most = Vec3::splat(0.45);
        // The wall of a solid lies 0.2 m towards +x, and the probe is inside.
        let inside = starts(|d| if d.x > 0.0 { -0.2 / d.x } else { -5.0 });
        let out = moved(Vec3::ZERO, &inside, 0.1, most);
        assert!((out.x - 0.3).abs() < 0.01 && out.length() < 0.32, "{out}");
        let mut distances = Distances::new(3.0);
        distances.add(&inside);
        assert!(distances.is_inside());
        let near = starts(|d| if d.y < 0.0 { -0.02 / d.y } else { 1e30 });
        let up = moved(Vec3::ZERO, &near, 0.1, most);
        assert!((up.y - 0.08).abs() < 0.01, "{up}");
        let free = starts(|_| 2.0);
        assert_eq!(moved(Vec3::ZERO, &free, 0.1, most), Vec3::ZERO);
        let deep = starts(|_| -2.0);
        assert!(moved(Vec3::ZERO, &deep, 0.1, most).abs().max_element() <= 0.45);
    }
}
