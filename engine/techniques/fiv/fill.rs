//! Mean share of the bounding disc that an occluder fills. The overlap correction needs this share for occluders that
//! are not balls.

use glam::Vec3;

use super::Occluder;
use crate::scene::{
    AlphaMode, Pose,
    bvh::{Bvh, Ray, Step},
    surfaces::Surfaces,
};

/// Viewing directions, on half a sphere, because opposite directions have equal silhouettes.
const DIRECTIONS: u32 = 24;
/// Rays along an edge of the square around the disc.
const RAYS: u32 = 24;
/// Rotation from one direction to the next, radians: the golden angle.
const TURN: f32 = 2.399_963;

/// Mean area of the silhouette divided by the area of the bounding disc, above 0, at most 1. Parts that are cut out do
/// not count, and blended surfaces count by their opacity.
pub fn fill(occluder: &Occluder) -> f32 {
    let bvh = Bvh::build(&occluder.scene, &Pose::rest(&occluder.scene));
    let radius = occluder.radius;
    let opaque = occluder.scene.materials.iter().all(|m| m.alpha == AlphaMode::Opaque);
    let surfaces = (!opaque).then(|| Surfaces::new(&occluder.scene, &Pose::rest(&occluder.scene), &bvh));
    let stopped = |ray: &Ray| match &surfaces {
        None => f32::from(bvh.any(ray)),
        Some(surfaces) => {
            let mut left = 1.0;
            bvh.walk(ray, |hit| {
                left *= 1.0 - surfaces.stops(hit.triangle, hit.u, hit.v);
                if left > 0.0 { Step::Ignore } else { Step::End }
            });
            1.0 - left
        }
    };
    let (mut met, mut all) = (0f32, 0u32);
    for k in 0..DIRECTIONS {
        let y = (k as f32 + 0.5) / DIRECTIONS as f32;
        let (sin, cos) = (k as f32 * TURN).sin_cos();
        let level = (1.0 - y * y).sqrt();
        let along = Vec3::new(level * cos, y, level * sin);
        let right = along.any_orthonormal_vector();
        let up = along.cross(right);
        for i in 0..RAYS * RAYS {
            let place = |i: u32| 2.0 * (i as f32 + 0.5) / RAYS as f32 - 1.0;
            let (u, v) = (place(i % RAYS), place(i / RAYS));
            if u * u + v * v > 1.0 {
                continue;
            }
            all += 1;
            met += stopped(&Ray::new((right * u + up * v - along * 1.5) * radius, along));
        }
    }
    // An occluder thinner than the distance of the rays must not have the share 0.
    met.max(1.0) / all.max(1) as f32
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;
    use crate::builtin;
    use crate::{
        scene::{Material, Mesh, Node, Primitive, Scene},
        techniques::fiv::Occluders,
    };

    fn of(scene: &Scene) -> (f32, f32) {
        let all = Occluders::of(scene, &Pose::rest(scene), false, 1.0);
        (fill(&all.kinds[0]), all.kinds[0].radius)
    }

    /// A box around the origin.
    fn cuboid(size: Vec3) -> Scene {
        let corner = |i: u32| size * (Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) - 0.5);
        let sides = [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]];
        let primitive = Primitive {
            positions: (0..8).map(corner).collect(),
            normals: vec![Vec3::Y; 8],
            tangents: vec![Vec4::ZERO; 8],
            indices: sides.iter().flat_map(|[a, b, c, d]| [*a, *b, *c, *a, *c, *d]).collect(),
            ..Primitive::default()
        };
        Scene {
            nodes: vec![Node { mesh: Some(0), ..Node::default() }],
            meshes: vec![Mesh { primitives: vec![primitive], ..Mesh::default() }],
            materials: vec![Material::default()],
            ..Scene::default()
        }
    }

    #[test]
    fn what_lets_light_through_fills_less() {
        let size = Vec3::new(1.0, 2.0, 0.5);
        let with = |alpha: AlphaMode, value: f32| {
            let mut scene = cuboid(size);
            scene.materials[0] = Material { alpha, base_color: Vec4::new(1.0, 1.0, 1.0, value), ..Material::default() };
            of(&scene).0
        };
        let whole = of(&cuboid(size)).0;
        let cut = AlphaMode::Mask { cutoff: 0.5 };
        assert_eq!([with(cut, 0.6), with(AlphaMode::Opaque, 0.1), with(AlphaMode::Blend, 1.0)], [whole; 3]);
        assert!(with(cut, 0.4) < 1e-3, "{}", with(cut, 0.4));
        // Light passes two sides, each of which blocks a half of the light.
        let half = with(AlphaMode::Blend, 0.5);
        assert!((half / whole - 0.75).abs() < 0.01, "{half} of {whole}");
    }

    #[test]
    fn what_is_squeezed_fills_what_its_surface_tells() {
        let rest = Vec3::new(1.0, 2.0, 0.5);
        let kind = Occluders::of(&cuboid(rest), &Pose::rest(&cuboid(rest)), false, 1.0).kinds.remove(0);
        for squeeze in [Vec3::new(1.0, 0.3, 1.0), Vec3::new(0.2, 1.0, 3.0), Vec3::splat(0.7)] {
            let (exact, radius) = of(&cuboid(rest * squeeze));
            let size = kind.squeezed(&glam::Mat3::from_diagonal(squeeze)).unwrap();
            let found = fill(&kind) * size.fill(&kind.size());
            assert!((found / exact - 1.0).abs() < 0.05, "{squeeze}: {found} instead of {exact}");
            assert!((size.radius / radius - 1.0).abs() < 1e-3, "{squeeze}: {} {radius}", size.radius);
        }
    }

    #[test]
    fn silhouettes_have_a_quarter_of_the_surface_of_convex_bodies() {
        let (ball, _) = of(&builtin::load("furnace-sphere").unwrap());
        assert!((0.97..=1.0).contains(&ball), "{ball}");
        // Cauchy: exact for the mean over all directions.
        for size in [Vec3::new(1.0, 2.0, 0.5), Vec3::new(100.0, 20.0, 30.0), Vec3::splat(0.01)] {
            let (found, radius) = of(&cuboid(size));
            let exact = (size.x * size.y + size.y * size.z + size.z * size.x) / 2.0;
            let exact = exact / (std::f32::consts::PI * radius * radius);
            assert!((found / exact - 1.0).abs() < 0.05, "{size}: {found} instead of {exact}");
        }
    }
}
