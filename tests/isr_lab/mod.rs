//! Known texels into the passes of image-space radiosity, and their results back.
#![allow(dead_code)]

use glam::{DVec3, Mat4, Vec3, dvec3};
use lucerna::{
    gpu::Gpu,
    graph::{Extent, Format, Graph, Image, Runner},
    passes::{direct::Lights, downsample::Coarse, gbuffer::GBuffer},
    reference::isr_scene::{Buffers, Eye, Patch},
    scene::{Camera, Projection, view::View},
    shaders::{test::unpack, types},
};

fn patch(corner: DVec3, a: DVec3, b: DVec3, albedo: DVec3, radiance: DVec3) -> Patch {
    Patch { corner, a, b, albedo, radiance }
}

/// Floor, lit wall, and a small block's top between them and the camera; background above.
pub fn scene(width: usize, height: usize) -> (Eye, Vec<Patch>) {
    let (red, white) = (dvec3(0.7, 0.1, 0.1), dvec3(0.6, 0.6, 0.6));
    let floor = patch(dvec3(-1.0, 0.0, 0.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 0.0, -2.0), white, white * 0.2);
    let wall = patch(dvec3(-1.0, 0.0, -2.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 1.0, 0.0), red, dvec3(1.0, 0.4, 0.1));
    let block = patch(dvec3(-0.3, 0.4, -0.4), dvec3(0.6, 0.0, 0.0), dvec3(0.0, 0.0, -0.5), white, white);
    let eye = Eye::look_at(dvec3(0.3, 1.5, 2.0), dvec3(0.0, 0.3, -1.3), 0.9, 10.0, width, height);
    (eye, vec![floor, wall, block])
}

/// Reproducible numbers in 0..1.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 40) as f64 / (1u64 << 24) as f64
    }

    pub fn vector(&mut self) -> DVec3 {
        dvec3(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }

    pub fn texel(&mut self) -> [f32; 4] {
        [self.next() as f32, self.next() as f32, self.next() as f32, self.next() as f32]
    }
}

/// An RGBA32F image of these texels.
pub fn image(graph: &mut Graph, name: &str, extent: Extent, texels: &[[f32; 4]]) -> Image {
    assert_eq!(texels.len() as u64, extent.pixels());
    let texels = graph.buffer_from(format!("{name}.texels"), texels);
    let target = graph.image(name, Format::RGBA32F, extent);
    graph.compute(unpack::Args { texels, target }, extent);
    target
}

/// Runs the graph and returns the texels of `wanted`.
pub fn read<const N: usize>(gpu: &Gpu, mut graph: Graph, wanted: [Image; N]) -> [Vec<[f32; 4]>; N] {
    let tokens = wanted.map(|image| graph.read_image(image));
    let frame = Runner::new(gpu).run(&graph).unwrap_or_else(|error| panic!("{error}"));
    tokens.map(|token| frame.image(token).to_f32())
}

/// The same camera for the shaders.
pub fn view(eye: &Eye) -> View {
    let projection = Projection::Perspective {
        yfov: 2.0 * eye.tan_y.atan() as f32,
        aspect: None,
        znear: 0.01,
        zfar: Some(eye.far as f32),
    };
    let [right, up, back, at] = [eye.right, eye.up, -eye.forward, eye.position].map(|v| v.as_vec3());
    let world_from_camera = Mat4::from_cols(right.extend(0.0), up.extend(0.0), back.extend(0.0), at.extend(1.0));
    View::new(&Camera { name: String::new(), projection }, world_from_camera, [eye.width as u32, eye.height as u32])
}

fn texel(rgb: DVec3, a: f64) -> [f32; 4] {
    rgb.as_vec3().extend(a as f32).to_array()
}

/// Buffers of the reference on the device, with their senders.
pub fn coarse(graph: &mut Graph, buffers: &Buffers) -> (Coarse, Image) {
    let extent = Extent::new(buffers.width as u32, buffers.height as u32);
    let all = 0..buffers.depth.len();
    let pack = |f: &dyn Fn(usize) -> [f32; 4]| all.clone().map(f).collect::<Vec<_>>();
    let albedo = pack(&|i| texel(buffers.albedo[i], buffers.mask[i]));
    let normal = pack(&|i| texel(buffers.normal[i], 0.0));
    let depth = pack(&|i| [buffers.depth[i] as f32; 4]);
    let sender = pack(&|i| texel(buffers.sender[i], buffers.mask[i]));
    let coarse = Coarse {
        albedo: image(graph, "albedo", extent, &albedo),
        normal: image(graph, "normal", extent, &normal),
        depth: image(graph, "depth", extent, &depth),
    };
    (coarse, image(graph, "sender", extent, &sender))
}

/// A G-buffer of matt surfaces that emit what the buffers send, with normals in 8-bit coding but unrounded.
pub fn gbuffer(graph: &mut Graph, eye: &Eye, buffers: &Buffers) -> GBuffer {
    gbuffer_seen(graph, &view(eye), buffers)
}

/// The same, seen by any camera.
pub fn gbuffer_seen(graph: &mut Graph, view: &View, buffers: &Buffers) -> GBuffer {
    let extent = Extent::new(buffers.width as u32, buffers.height as u32);
    let (coarse, emission) = coarse(graph, buffers);
    let coded: Vec<_> = buffers.normal.iter().map(|n| texel(*n * 0.5 + 0.5, 0.0)).collect();
    GBuffer {
        albedo: coarse.albedo,
        normal: image(graph, "coded normal", extent, &coded),
        depth: coarse.depth,
        specular: image(graph, "specular", extent, &vec![[0.0, 0.0, 0.0, 1.0]; buffers.depth.len()]),
        emission,
        hardware: coarse.depth,
        view: graph.uniform(&view.uniform()),
        settings: Default::default(),
    }
}

/// Lights without shadows.
pub fn lights(graph: &mut Graph, lights: &[types::Light]) -> Lights {
    let mut words = vec![lights.len() as u32];
    for light in lights {
        words.extend_from_slice(bytemuck::cast_slice(bytemuck::bytes_of(light)));
    }
    // Settings of kind 0 (off), slots and one entry a light, all zero: no light casts a shadow.
    let slots = size_of::<types::ShadowSettings>() + 64 * size_of::<types::ShadowSlot>();
    let shadows = vec![0u32; (slots + lights.len().max(1) * size_of::<types::ShadowLight>()) / 4];
    let maps = graph.image("shadow maps", Format::R32F, Extent::square(1));
    graph.clear(maps, [0.0; 4]);
    Lights {
        lights: graph.buffer_from("lights", &words),
        shadows: graph.buffer_from("shadows", &shadows),
        shadow_maps: maps,
        screen_blur: (0, 0),
    }
}

/// A point light of `intensity` W/sr.
pub fn point(position: Vec3, intensity: Vec3) -> types::Light {
    types::Light {
        position: position.to_array(),
        kind: lucerna::shaders::consts::LIGHT_POINT,
        direction: [0.0, -1.0, 0.0],
        intensity: intensity.to_array(),
        spot_offset: 1.0,
        ..Default::default()
    }
}

/// Fails where two lists of texels differ by more than `absolute + relative · |expected|` in a channel of `channels`.
#[track_caller]
pub fn close(
    found: &[[f32; 4]],
    expected: &[[f32; 4]],
    channels: std::ops::Range<usize>,
    absolute: f32,
    relative: f32,
) {
    assert_eq!(found.len(), expected.len());
    for (i, (f, e)) in found.iter().zip(expected).enumerate() {
        for c in channels.clone() {
            let most = absolute + relative * e[c].abs();
            assert!((f[c] - e[c]).abs() <= most, "texel {i}, channel {c}: {} instead of {} (±{most})", f[c], e[c]);
        }
    }
}

/// A floor of that albedo from (-1, 0, -2) to (1, 0, 0), and behind it a wall that glows and reflects nothing.
pub fn floor_and_wall(albedo: f64) -> Vec<Patch> {
    let corner = dvec3(-1.0, 0.0, 0.0);
    let floor = Patch {
        corner,
        a: dvec3(2.0, 0.0, 0.0),
        b: dvec3(0.0, 0.0, -2.0),
        albedo: DVec3::splat(albedo),
        radiance: DVec3::ZERO,
    };
    let wall = Patch {
        corner: dvec3(-1.0, 0.0, -2.0),
        b: dvec3(0.0, 1.0, 0.0),
        albedo: DVec3::ZERO,
        radiance: dvec3(1.0, 0.5, 0.25),
        ..floor
    };
    vec![floor, wall]
}
