//! The rays.

use glam::Vec3;
use lucerna::{
    scene::bvh::{Bvh, Ray},
    shaders::types,
};

pub struct Set {
    pub name: &'static str,
    pub rays: Vec<types::Ray>,
}

fn ray(origin: Vec3, direction: Vec3, t_max: f32) -> types::Ray {
    types::Ray { origin: origin.to_array(), t_min: 0.0, direction: direction.to_array(), t_max }
}

/// Camera rays of a picture of `size`² in tiles of 8×8 from a place in the scene, and from what they hit: towards a lamp under the
/// ceiling, towards the sun, and in cosine-distributed directions.
pub fn sets(bvh: &Bvh, size: u32) -> Vec<Set> {
    let (low, high) = bvh.bounds().unwrap_or((Vec3::ZERO, Vec3::ONE));
    let at = |x: f32, y: f32, z: f32| low + (high - low) * Vec3::new(x, y, z);
    let (eye, target) = (at(0.15, 0.3, 0.5), at(0.9, 0.35, 0.45));
    let lamp = at(0.5, 0.6, 0.5);
    let sun = Vec3::new(0.25, 1.0, 0.15).normalize();
    let forward = (target - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let mut camera = Vec::new();
    for tile in 0..(size / 8) * (size / 8) {
        for i in 0..64 {
            let x = tile % (size / 8) * 8 + i % 8;
            let y = tile / (size / 8) * 8 + i / 8;
            let [u, v] = [x, y].map(|c| (c as f32 + 0.5) / size as f32 * 2.0 - 1.0);
            camera.push(ray(eye, forward + right * u - up * v, f32::MAX));
        }
    }
    let mut sets = vec![
        Set { name: "camera", rays: camera },
        Set { name: "lamp", rays: Vec::new() },
        Set { name: "sun", rays: Vec::new() },
        Set { name: "bounce", rays: Vec::new() },
    ];
    let mut state = 1u64;
    let mut random = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    for i in 0..sets[0].rays.len() {
        let from = sets[0].rays[i];
        let direction = Vec3::from(from.direction);
        let hit = bvh.closest(&Ray::new(eye, direction));
        let Some(hit) = hit else { continue };
        let [a, b, c] = bvh.triangles()[hit.triangle as usize];
        let mut normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
        if normal.dot(direction) > 0.0 {
            normal = -normal;
        }
        let p = eye + direction * hit.t + normal * 1e-4 * (high - low).max_element();
        sets[1].rays.push(ray(p, lamp - p, 1.0));
        sets[2].rays.push(ray(p, sun, f32::MAX));
        let (r, phi) = (random().sqrt(), random() * std::f32::consts::TAU);
        let (t, b) = normal.any_orthonormal_pair();
        let d = t * (r * phi.cos()) + b * (r * phi.sin()) + normal * (1.0 - r * r).max(0.0).sqrt();
        sets[3].rays.push(ray(p, d, f32::MAX));
    }
    sets
}
