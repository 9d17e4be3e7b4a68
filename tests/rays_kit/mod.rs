//! Rays through scenes on the device and on the CPU, for the tests of the ray interface.
#![allow(dead_code)]

use glam::Vec3;
use lucerna::{
    gpu::Gpu,
    graph::{BufferRead, Graph, Runner},
    rays::Rays,
    resident::Resident,
    scene::{Pose, Scene, bvh},
    shaders::{test::trace, types},
};

/// xorshift: tests need no crate for numbers.
pub struct Numbers(pub u64);

impl Numbers {
    /// In [-1, 1).
    pub fn next(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1u64 << 24) as f32 * 2.0 - 1.0
    }

    /// In the cube of side 2.
    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

pub fn ray(origin: Vec3, direction: Vec3) -> types::Ray {
    types::Ray { origin: origin.to_array(), t_min: 0.0, direction: direction.to_array(), t_max: f32::MAX }
}

/// The same ray for the CPU.
pub fn cpu(ray: &types::Ray) -> bvh::Ray {
    bvh::Ray { origin: ray.origin.into(), direction: ray.direction.into(), t_min: ray.t_min, t_max: ray.t_max }
}

/// `count` rays of random directions that start at random places in and around a box.
pub fn random_rays(numbers: &mut Numbers, count: usize, low: Vec3, high: Vec3) -> Vec<types::Ray> {
    let (centre, half) = ((low + high) * 0.5, (high - low) * 0.6);
    (0..count).map(|_| ray(centre + half * numbers.vector(), numbers.vector() + 1e-6)).collect()
}

/// What `trace_closest` and `trace_any` say.
#[derive(Debug)]
pub struct Traced {
    pub closest: Vec<types::Hit>,
    pub any: Vec<bool>,
    /// Milliseconds of both on the device.
    pub ms: [f64; 2],
}

/// A scene on the device, ready for rays.
pub struct Traceable<'a> {
    pub scene: &'a Scene,
    pub resident: Resident,
    pub rays: Rays,
    pub runner: Runner,
}

impl<'a> Traceable<'a> {
    pub fn new(gpu: &Gpu, scene: &'a Scene) -> Self {
        let resident = Resident::new(gpu, scene).unwrap();
        let rays = Rays::in_compute(gpu, scene, &resident).unwrap();
        Self { scene, resident, rays, runner: Runner::new(gpu) }
    }

    /// As the device traces by itself: by ray query where it has them.
    pub fn as_caps_say(gpu: &Gpu, scene: &'a Scene) -> Self {
        let resident = Resident::new(gpu, scene).unwrap();
        let rays = Rays::new(gpu, scene, &resident).unwrap();
        Self { scene, resident, rays, runner: Runner::new(gpu) }
    }

    /// Passes for one pose: nearest and any hits of `rays`.
    pub fn declare(
        &mut self,
        graph: &mut Graph,
        pose: &Pose,
        rays: &[types::Ray],
        mask: u32,
        salt: u32,
    ) -> [BufferRead; 2] {
        let handles = self.resident.frame_in(graph, self.scene, pose);
        let traced = self.rays.frame(graph, &handles);
        let count = rays.len() as u32;
        let list = graph.buffer_from("rays", rays);
        [0, 1].map(|any| {
            let hits = graph.buffer("hits", (size_of::<types::Hit>() * rays.len()) as u64);
            let args = trace::Args {
                rays: list,
                hits,
                trace_nodes: traced.trace_nodes,
                scene_at: traced.scene_at,
                trace_accel: traced.trace_accel,
                trace_triangles: traced.trace_triangles,
                trace_instances: traced.trace_instances,
                trace_indices: traced.trace_indices,
                trace_uvs: traced.trace_uvs,
                trace_colors: traced.trace_colors,
                trace_scene: traced.trace_scene,
                materials: traced.materials,
                scene_textures: traced.scene_textures,
                push: trace::Push { count, mask, salt },
                spec: trace::Spec { any, ..Default::default() },
            };
            graph.compute(args, count);
            graph.read_buffer(hits)
        })
    }

    pub fn trace(&mut self, pose: &Pose, rays: &[types::Ray], mask: u32, salt: u32) -> Traced {
        let mut graph = Graph::new("rays");
        let [closest, any] = self.declare(&mut graph, pose, rays, mask, salt);
        let frame = self.runner.run(graph).unwrap();
        let ms =
            |name: &str| frame.report.passes.iter().filter(|p| p.name == name).find_map(|p| p.gpu_ms).unwrap_or(0.0);
        Traced {
            ms: [ms("test.trace"), ms("test.trace#2")],
            closest: frame.buffer(closest),
            any: frame.buffer::<types::Hit>(any).iter().map(|h| h.instance != u32::MAX).collect(),
        }
    }
}

/// Instance and triangle of each triangle of the CPU's hierarchy, as the device counts them.
pub fn device_ids(scene: &Scene, bvh: &bvh::Bvh) -> Vec<(u32, u32)> {
    let mut first = vec![];
    let mut instances = 0;
    for node in &scene.nodes {
        first.push(instances);
        instances += node.mesh.map_or(0, |m| scene.meshes[m as usize].primitives.len() as u32);
    }
    let id = |i| {
        let id = bvh.id(i);
        (first[id.node as usize] + id.primitive, id.triangle)
    };
    (0..bvh.triangles().len() as u32).map(id).collect()
}
