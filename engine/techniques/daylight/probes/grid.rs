//! The places of probes.

use glam::{UVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::{
    Error, Result,
    scene::{Aabb, Pose, Scene, deform},
    shaders::{consts, types},
};

/// Probes of a bake at most.
const MOST: u64 = 1 << 20;

/// Probes at the middles of equal boxes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// World position of the first probe, metres.
    pub origin: [f32; 3],
    /// Distance between neighbours along the axes, metres.
    pub spacing: [f32; 3],
    /// Number of probes along the axes.
    pub counts: [u32; 3],
}

impl Grid {
    /// Fills a box with probes that are at most `spacing` metres apart, or farther apart if there would be more than `most`. At least two along
    /// each axis.
    pub fn new(around: &Aabb, spacing: f32, most: u32) -> Self {
        let size = (around.max - around.min).max(Vec3::splat(1e-3));
        let counts = |spacing: f32| size.to_array().map(|size| (size / spacing).ceil().clamp(2.0, 1e6) as u32);
        let product = |counts: [u32; 3]| counts.map(u64::from).iter().product::<u64>();
        let most = u64::from(most.max(8));
        // Tiny numbers would not grow by a hundredth.
        let mut spacing = spacing.max(1e-6);
        while product(counts(spacing)) > most {
            spacing *= 1.01;
        }
        let counts = counts(spacing);
        let spacing = size / UVec3::from(counts).as_vec3();
        Self { origin: (around.min + 0.5 * spacing).to_array(), spacing: spacing.to_array(), counts }
    }

    /// The box around all surfaces of a scene at rest that stop light; high enough for one probe over a flat scene. `None` if there are none.
    pub fn around(scene: &Scene, spacing: f32) -> Option<Aabb> {
        let pose = Pose::rest(scene);
        let mut around = Aabb::EMPTY;
        for (index, node) in scene.nodes.iter().enumerate() {
            let Some(mesh) = node.mesh.and_then(|mesh| scene.meshes.get(mesh as usize)) else { continue };
            let stops = |material: u32| scene.materials.get(material as usize).is_some_and(|m| !m.unlit);
            for primitive in mesh.primitives.iter().filter(|p| stops(p.material) && !p.indices.is_empty()) {
                let vertices = deform::world_vertices(scene, &pose, index, primitive);
                around = around.union(Aabb::of(vertices.positions.into_iter().filter(|p| p.is_finite())));
            }
        }
        around.max.y = around.max.y.max(around.min.y + spacing);
        around.is_finite().then_some(around)
    }

    /// # Errors
    /// `Input`, saying which number is impossible.
    pub fn validate(&self) -> Result<()> {
        let all = self.counts.map(u64::from).iter().try_fold(1u64, |all, count| all.checked_mul(*count));
        if !all.is_some_and(|all| (1..=MOST).contains(&all)) {
            return Err(Error::input(format!("{:?} probes; 1 to {MOST} are allowed", self.counts)));
        }
        let finite = self.origin.iter().chain(&self.spacing).all(|value| value.is_finite());
        match finite && self.spacing.iter().all(|value| *value > 0.0) {
            true => Ok(()),
            false => Err(Error::input("probes without a place or without a distance between them")),
        }
    }

    /// Number of probes.
    pub fn probes(&self) -> u32 {
        self.counts.iter().product()
    }

    /// Bricks along each axis.
    fn bricks_along(&self) -> [u32; 3] {
        self.counts.map(|count| count.div_ceil(consts::PROBE_BRICK))
    }

    /// Number of bricks.
    pub fn bricks(&self) -> u32 {
        self.bricks_along().iter().product()
    }

    /// The probes of a brick: numbers along the axes.
    pub fn brick(&self, index: u32) -> Vec<[u32; 3]> {
        let [x, y, _] = self.bricks_along().map(|count| count.max(1));
        let first = [index % x, index / x % y, index / (x * y)].map(|brick| brick * consts::PROBE_BRICK);
        let end: [u32; 3] = std::array::from_fn(|axis| (first[axis] + consts::PROBE_BRICK).min(self.counts[axis]));
        let mut out = Vec::new();
        for z in first[2]..end[2] {
            for y in first[1]..end[1] {
                out.extend((first[0]..end[0]).map(|x| [x, y, z]));
            }
        }
        out
    }

    /// Number of a probe in the whole grid.
    pub fn number(&self, [x, y, z]: [u32; 3]) -> u32 {
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    /// World position of a probe, metres.
    pub fn position(&self, at: [u32; 3]) -> Vec3 {
        Vec3::from(self.origin) + UVec3::from(at).as_vec3() * Vec3::from(self.spacing)
    }

    /// Distances to surfaces count up to this one, metres: beyond the farthest probe that a point uses.
    pub fn reach(&self) -> f32 {
        1.5 * Vec3::from(self.spacing).length()
    }

    /// As shaders read it.
    pub(super) fn on_device(&self) -> types::DayGrid {
        types::DayGrid { origin: self.origin, spacing: self.spacing, counts: self.counts, most: self.reach() }
    }
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;

    #[test]
    fn probes_fill_the_box_and_no_more_than_allowed() {
        let around = Aabb { min: vec3(-1.0, 0.0, 2.0), max: vec3(9.0, 3.0, 4.0) };
        let grid = Grid::new(&around, 1.0, 4096);
        assert_eq!((grid.counts, grid.spacing), ([10, 3, 2], [1.0; 3]));
        assert_eq!(grid.position([0, 0, 0]), vec3(-0.5, 0.5, 2.5));
        assert_eq!(grid.position([9, 2, 1]), vec3(8.5, 2.5, 3.5));
        for spacing in [f32::from_bits(1), 1e-20, 1e20] {
            assert!((8..=100).contains(&Grid::new(&around, spacing, 100).probes()), "{spacing}");
        }
        for most in [8, 20, 59, 60] {
            let fewer = Grid::new(&around, 1.0, most);
            assert!(fewer.probes() <= most && fewer.counts.iter().all(|count| *count >= 2), "{most}: {fewer:?}");
        }
        let flat = Aabb { min: Vec3::ZERO, max: vec3(4.0, 0.0, 4.0) };
        Grid::new(&flat, 1.0, 4096).validate().unwrap();
    }

    #[test]
    fn bricks_hold_each_probe_once() {
        let grid = Grid { origin: [0.0; 3], spacing: [1.0; 3], counts: [9, 4, 5] };
        assert_eq!(grid.bricks(), 3 * 2);
        let mut all: Vec<u32> = (0..grid.bricks()).flat_map(|b| grid.brick(b)).map(|at| grid.number(at)).collect();
        all.sort_unstable();
        assert_eq!(all, (0..grid.probes()).collect::<Vec<_>>());
    }

    #[test]
    fn impossible_grids_are_refused() {
        let grid = Grid { origin: [0.0; 3], spacing: [1.0; 3], counts: [9, 4, 5] };
        grid.validate().unwrap();
        for wrong in [
            Grid { counts: [0, 4, 5], ..grid.clone() },
            Grid { counts: [u32::MAX; 3], ..grid.clone() },
            Grid { spacing: [1.0, 0.0, 1.0], ..grid.clone() },
            Grid { origin: [f32::NAN, 0.0, 0.0], ..grid },
        ] {
            assert_eq!(wrong.validate().unwrap_err().exit_code(), 3);
        }
    }
}
