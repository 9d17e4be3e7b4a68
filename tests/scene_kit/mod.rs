//! Small scenes with known geometry, and the loop around one graph, for tests of the scene on the device.
#![allow(dead_code)]

use glam::{Mat4, Vec2, Vec3, Vec4};
use lucerna::{
    gpu::Gpu,
    graph::{Frame, Graph, ImageRead, Runner},
    passes::gbuffer::{self, GBuffer, Normals, Settings},
    resident::Resident,
    scene::{Camera, Light, LightKind, Material, Mesh, Node, Primitive, Projection, Scene, Transform, View},
};

pub const PI: f32 = std::f32::consts::PI;

/// A square of side 2 around the origin in the xz plane, normal +Y, uv from 0 to 1.
pub fn square() -> Primitive {
    let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
    Primitive {
        positions: corners.iter().map(|(x, z)| Vec3::new(*x, 0.0, *z)).collect(),
        normals: vec![Vec3::Y; 4],
        tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4],
        uvs: vec![corners.iter().map(|(x, z)| Vec2::new(0.5 + 0.5 * x, 0.5 + 0.5 * z)).collect()],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Primitive::default()
    }
}

/// A sphere of radius 1 around the origin with exact normals.
pub fn sphere(rings: u32) -> Primitive {
    let sectors = 2 * rings;
    let mut out = Primitive::default();
    for ring in 0..=rings {
        for sector in 0..=sectors {
            let (theta, phi) = (PI * ring as f32 / rings as f32, 2.0 * PI * sector as f32 / sectors as f32);
            let p = Vec3::new(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos());
            out.positions.push(p);
            out.normals.push(p);
            out.tangents.push(Vec4::ZERO);
        }
    }
    for ring in 0..rings {
        for sector in 0..sectors {
            let a = ring * (sectors + 1) + sector;
            let b = a + sectors + 1;
            out.indices.extend([a, b, b + 1, a, b + 1, a + 1]);
        }
    }
    out
}

/// Adds a mesh of one primitive.
pub fn mesh(scene: &mut Scene, primitive: Primitive, material: Material) -> u32 {
    let material_index = scene.materials.len() as u32;
    scene.materials.push(material);
    let primitive = Primitive { material: material_index, ..primitive };
    scene.meshes.push(Mesh { name: String::new(), primitives: vec![primitive], weights: Vec::new() });
    scene.meshes.len() as u32 - 1
}

/// Adds a node that shows a mesh.
pub fn place(scene: &mut Scene, mesh: u32, at: Mat4) -> usize {
    scene.nodes.push(Node { mesh: Some(mesh), local: Transform::Matrix(at), ..Node::default() });
    scene.nodes.len() - 1
}

/// Adds a white light.
pub fn light(scene: &mut Scene, kind: LightKind, at: Mat4) {
    let index = scene.lights.len() as u32;
    scene.lights.push(Light { name: String::new(), kind, color: Vec3::ONE, intensity: 1.0 });
    scene.nodes.push(Node { light: Some(index), local: Transform::Matrix(at), ..Node::default() });
}

/// `world_from_local` of something that stands at `eye` and looks at `target`.
pub fn look(eye: Vec3, target: Vec3) -> Mat4 {
    let back = (eye - target).normalize();
    let up = if back.y.abs() > 0.99 { Vec3::Z } else { Vec3::Y };
    let right = up.cross(back).normalize();
    Mat4::from_cols(right.extend(0.0), back.cross(right).extend(0.0), back.extend(0.0), eye.extend(1.0))
}

/// A perspective view of 60° from `eye` to `target`.
pub fn view(eye: Vec3, target: Vec3, extent: [u32; 2]) -> View {
    let projection = Projection::Perspective { yfov: PI / 3.0, aspect: None, znear: 0.1, zfar: Some(50.0) };
    View::new(&Camera { name: String::new(), projection }, look(eye, target), extent)
}

/// One frame at rest: `declare` adds to the graph and says what to bring back.
pub fn frame<T>(
    gpu: &Gpu,
    scene: &Scene,
    declare: impl FnOnce(&mut Graph, &lucerna::resident::Handles) -> T,
) -> (Frame, T) {
    let mut resident = Resident::new(gpu, scene).unwrap();
    let mut runner = Runner::new(gpu);
    let mut graph = Graph::new("test");
    let handles = resident.frame(&mut graph, scene, 0.0);
    let wanted = declare(&mut graph, &handles);
    (runner.run(graph).unwrap(), wanted)
}

/// The images of a G-buffer as floats, row by row.
#[derive(Debug, PartialEq)]
pub struct Surfaces {
    pub albedo: Vec<[f32; 4]>,
    pub normal: Vec<Vec3>,
    pub depth: Vec<f32>,
    pub specular: Vec<[f32; 4]>,
    pub emission: Vec<[f32; 4]>,
}

/// Draws a G-buffer with `settings` and reads it back.
pub fn surfaces(gpu: &Gpu, scene: &Scene, view: &View, settings: Settings) -> Surfaces {
    let (frame, reads) = frame(gpu, scene, |graph, handles| {
        let GBuffer { albedo, normal, depth, specular, emission, .. } = gbuffer::draw(graph, handles, view, &settings);
        [albedo, normal, depth, specular, emission].map(|image| graph.read_image(image))
    });
    let pixels = |read: ImageRead| frame.image(read).to_f32();
    let [albedo, normal, depth, specular, emission] = reads;
    Surfaces {
        albedo: pixels(albedo),
        normal: pixels(normal).into_iter().map(|c| decode_normal(c, settings.normals)).collect(),
        depth: pixels(depth).into_iter().map(|c| c[0]).collect(),
        specular: pixels(specular),
        emission: pixels(emission),
    }
}

fn decode_normal(c: [f32; 4], normals: Normals) -> Vec3 {
    match normals {
        Normals::Bytes => (Vec3::new(c[0], c[1], c[2]) * 2.0 - 1.0).normalize_or_zero(),
        Normals::Octahedral => {
            let p = Vec2::new(c[0], c[1]) * 2.0 - 1.0;
            let mut n = Vec3::new(p.x, p.y, 1.0 - p.x.abs() - p.y.abs());
            let t = (-n.z).max(0.0);
            n.x -= t.copysign(n.x);
            n.y -= t.copysign(n.y);
            n.normalize_or_zero()
        }
    }
}
