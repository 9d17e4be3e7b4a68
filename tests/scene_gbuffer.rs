//! The G-buffer of known scenes against closed forms.

use crate::scene_kit::*;
use glam::{Mat4, Quat, Vec2, Vec3, Vec4};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    passes::gbuffer::{self, Blended, GBuffer, Normals, Settings},
    scene::{AlphaMode, Camera, Material, Projection, Sampler, Scene, Texture, TextureRef, View},
    shaders::{test::view as view_shader, types},
};

const EXTENT: [u32; 2] = [96, 64];

/// World-space ray through the centre of pixel `i`.
fn ray(view: &View, i: usize) -> (Vec3, Vec3) {
    let uv = pixel_uv(i);
    let (a, b) = (view.world_from_depth(uv, 0.01), view.world_from_depth(uv, 1.0));
    (a, (b - a).normalize())
}

fn pixel_uv(i: usize) -> Vec2 {
    let [w, h] = EXTENT.map(|e| e as usize);
    Vec2::new(((i % w) as f32 + 0.5) / w as f32, ((i / w) as f32 + 0.5) / h as f32)
}

#[test]
fn positions_come_back_from_linear_depth_on_the_gpu() {
    for orthographic in [false, true] {
        let projection = match orthographic {
            false => Projection::Perspective { yfov: 0.9, aspect: None, znear: 0.1, zfar: Some(60.0) },
            true => Projection::Orthographic { xmag: 4.0, ymag: 3.0, znear: 0.1, zfar: 60.0 },
        };
        let camera = Camera { name: String::new(), projection };
        let view = View::new(&camera, look(Vec3::new(3.0, 2.0, 5.0), Vec3::new(-1.0, 0.5, 0.0)), [640, 480]);
        let probes: Vec<types::ViewProbe> = (0..200)
            .map(|i| {
                let t = i as f32 / 200.0;
                let uv = [(t * 7.3).fract(), (t * 13.7).fract()];
                types::ViewProbe { uv, z: 0.01 + 0.99 * t, ..Default::default() }
            })
            .collect();
        with_gpu(|gpu| {
            let mut graph = Graph::new("view");
            let buffer = graph.buffer_from("probes", &probes);
            let args = view_shader::Args { view: graph.uniform(&view.uniform()), probes: buffer };
            graph.compute(args, probes.len() as u32);
            let read = graph.read_buffer(buffer);
            let frame = Runner::new(gpu).run(graph).unwrap();
            for probe in frame.buffer::<types::ViewProbe>(read) {
                let eye = view.view_from_world.transform_point3(probe.world.into());
                assert!((-eye.z - probe.z * view.far).abs() < 1e-3, "eye distance of {probe:?} is {}", -eye.z);
                assert!((probe.z_back - probe.z).abs() < 1e-5, "{probe:?}");
                assert!(Vec2::from(probe.uv_back).distance(probe.uv.into()) < 1e-4, "{probe:?}");
                let expected = view.world_from_depth(probe.uv.into(), probe.z);
                assert!(expected.distance(probe.world.into()) < 1e-3, "{probe:?}");
            }
        });
    }
}

#[test]
fn a_plane_has_its_albedo_normal_depth_and_emission() {
    let mut scene = Scene::default();
    let material = Material {
        metallic: 0.25,
        roughness: 0.6,
        emissive: Vec3::new(0.0, 3.0, 0.5),
        ior: 2.0,
        ..Material::diffuse("", Vec3::new(0.8, 0.4, 0.1))
    };
    let plane = mesh(&mut scene, square(), material);
    place(&mut scene, plane, Mat4::from_scale(Vec3::splat(2.0)));
    let view = view(Vec3::new(0.0, 3.0, 4.0), Vec3::ZERO, EXTENT);
    with_gpu(|gpu| {
        let got = surfaces(gpu, &scene, &view, Settings::default());
        let mut seen = 0;
        for i in 0..got.depth.len() {
            let (origin, direction) = ray(&view, i);
            let t = -origin.y / direction.y;
            let hit = origin + direction * t;
            let inside = t > 0.0 && hit.x.abs().max(hit.z.abs()) <= 2.0;
            if (hit.x.abs() - 2.0).abs().min((hit.z.abs() - 2.0).abs()) < 0.05 {
                continue; // the edge may fall on either side
            }
            if !inside {
                assert_eq!(got.depth[i], 1.0, "background has exactly depth 1");
                assert_eq!(got.albedo[i][3], 0.0);
                continue;
            }
            seen += 1;
            let expected = view.view_from_world.transform_point3(hit).z / -view.far;
            assert!((got.depth[i] - expected).abs() < 1e-4 * expected, "{} {expected}", got.depth[i]);
            let back = view.world_from_depth(pixel_uv(i), got.depth[i]);
            assert!(back.distance(hit) < 2e-3, "{back} {hit}");
            assert!(got.normal[i].abs_diff_eq(Vec3::Y, 1e-3), "{}", got.normal[i]);
            for (c, rho) in [0.8, 0.4, 0.1].into_iter().enumerate() {
                // sRGB8 keeps about half a percent.
                assert!((got.albedo[i][c] - 0.75 * rho).abs() < 4e-3, "{:?}", got.albedo[i]);
                // F0 of index 2 is 1/9.
                let f0 = 0.75 / 9.0 + 0.25 * rho;
                assert!((got.specular[i][c] - f0).abs() < 3e-3, "{:?}", got.specular[i]);
            }
            assert!((got.specular[i][3] - 0.6).abs() < 3e-3);
            assert_eq!(got.emission[i], [0.0, 3.0, 0.5, 1.0]);
            assert_eq!(got.albedo[i][3], 1.0);
        }
        assert!(seen > 500, "{seen} pixels show the plane");
    });
}

/// One texel of these codes.
fn texel(rgba: [u8; 4]) -> Texture {
    Texture { name: String::new(), width: 1, height: 1, rgba: vec![rgba] }
}

#[test]
fn every_texture_reaches_its_channel() {
    let codes =
        [[188, 120, 60, 255], [20, 102, 51, 255], [170, 90, 230, 255], [102, 250, 10, 255], [90, 188, 250, 255]];
    let [base, _, mapped, _, glow] = codes.map(|[r, g, b, _]| Vec3::new(r.into(), g.into(), b.into()) / 255.0);
    let linear = |v: Vec3| Vec3::from_array(v.to_array().map(lucerna::image::srgb::decode));
    let slot = |i: u32| Some(TextureRef::new(i));
    let material = Material {
        base_color: Vec3::new(0.8, 0.6, 0.4).extend(1.0),
        base_color_texture: slot(0),
        metallic: 0.5,
        roughness: 0.75,
        metallic_roughness_texture: slot(1),
        normal_texture: slot(2),
        normal_scale: 0.6,
        occlusion_texture: slot(3),
        occlusion_strength: 0.25,
        emissive: Vec3::new(2.0, 3.0, 4.0),
        emissive_texture: slot(4),
        ior: 2.0,
        ..Material::default()
    };
    let base = Vec3::new(0.8, 0.6, 0.4) * linear(base);
    // Roughness from green, metallic from blue, accessibility from red.
    let (roughness, metallic) = (0.75 * 102.0 / 255.0, 0.5 * 51.0 / 255.0);
    let f0 = Vec3::splat(1.0 / 9.0).lerp(base, metallic);
    let access = 1.0 + 0.25 * (102.0 / 255.0 - 1.0);
    let glow = Vec3::new(2.0, 3.0, 4.0) * linear(glow);
    let mapped = (mapped * 2.0 - 1.0) * Vec3::new(0.6, 0.6, 1.0);
    let turned = Mat4::from_rotation_y(0.5);
    with_gpu(|gpu| {
        for world in [turned, turned * Mat4::from_scale(Vec3::new(-1.5, 1.0, 1.0))] {
            for side in [1.0, -1.0] {
                let mut scene = Scene { textures: codes.map(texel).to_vec(), ..Scene::default() };
                let mut primitive = square();
                primitive.tangents.iter_mut().for_each(|t| t.w = side);
                let plane = mesh(&mut scene, primitive, material.clone());
                place(&mut scene, plane, world);
                // A transform that mirrors turns the bitangent around.
                let tangent = world.transform_vector3(Vec3::X).normalize();
                let bitangent = Vec3::Y.cross(tangent) * side * world.determinant().signum();
                let normal = (tangent * mapped.x + bitangent * mapped.y + Vec3::Y * mapped.z).normalize();
                let view = view(Vec3::new(0.0, 2.0, 1.0), Vec3::ZERO, EXTENT);
                let got = surfaces(gpu, &scene, &view, Settings::default());
                let at = (EXTENT[1] / 2 * EXTENT[0] + EXTENT[0] / 2) as usize;
                assert!(got.depth[at] < 1.0);
                assert!(got.normal[at].abs_diff_eq(normal, 8e-3), "{} instead of {normal}", got.normal[at]);
                let close = |got: [f32; 4], want: [f32; 4], slack: f32| {
                    assert!(got.iter().zip(want).all(|(a, b)| (a - b).abs() < slack), "{got:?} instead of {want:?}");
                };
                // sRGB8 and RGBA8 keep about half a percent; drivers decode sRGB about as well.
                close(got.albedo[at], (base * (1.0 - metallic)).extend(1.0).to_array(), 6e-3);
                close(got.specular[at], f0.extend(roughness).to_array(), 6e-3);
                close(got.emission[at], glow.extend(access).to_array(), 0.05);
            }
        }
    });
}

#[test]
fn a_sphere_has_the_normals_and_depths_of_a_sphere_in_both_encodings() {
    let mut scene = Scene::default();
    let ball = mesh(&mut scene, sphere(96), Material::diffuse("", Vec3::splat(0.5)));
    // Uneven scale: an ellipsoid, whose normals are not scaled positions.
    let world = Mat4::from_scale_rotation_translation(
        Vec3::new(1.5, 0.7, 1.0),
        Quat::from_rotation_z(0.4),
        Vec3::new(0.2, 0.1, 0.0),
    );
    place(&mut scene, ball, world);
    // From both ends: octahedra are folded along z = 0.
    let eyes = [Vec3::new(0.5, 1.0, 4.0), Vec3::new(-0.9, -0.6, -4.0)];
    let encodings = [(Normals::Octahedral, 0.04), (Normals::Bytes, 0.045)];
    with_gpu(|gpu| {
        for (eye, (normals, tolerance)) in eyes.into_iter().flat_map(|eye| encodings.map(|encoding| (eye, encoding))) {
            let view = view(eye, Vec3::ZERO, EXTENT);
            let got = surfaces(gpu, &scene, &view, Settings { normals, ..Settings::default() });
            let local = world.inverse();
            let mut seen = 0;
            for i in 0..got.depth.len() {
                let (origin, direction) = ray(&view, i);
                let (o, d) = (local.transform_point3(origin), local.transform_vector3(direction));
                let (a, b, c) = (d.dot(d), o.dot(d), o.dot(o) - 1.0);
                let root = b * b - a * c;
                // Grazing pixels see the polygons of the mesh.
                if root < 0.05 * a {
                    continue;
                }
                let t = (-b - root.sqrt()) / a;
                let hit = origin + direction * t;
                let at = o + d * t;
                let normal = (local.transpose().transform_vector3(at)).normalize();
                let depth = -view.view_from_world.transform_point3(hit).z / view.far;
                assert!((got.depth[i] - depth).abs() < 2e-3 * depth, "{} {depth}", got.depth[i]);
                assert!(got.normal[i].distance(normal) < tolerance, "{} {normal}", got.normal[i]);
                seen += 1;
            }
            assert!(seen > 400, "{seen}");
        }
    });
}

fn crowd(shared: bool) -> Scene {
    let mut scene = Scene::default();
    let make = |scene: &mut Scene| mesh(scene, sphere(8), Material::diffuse("", Vec3::new(0.2, 0.5, 0.7)));
    let one = make(&mut scene);
    for i in 0..25 {
        let which = if shared || i == 0 { one } else { make(&mut scene) };
        let at = Vec3::new((i % 5) as f32 - 2.0, (i / 5) as f32 - 2.0, -0.3 * i as f32);
        // Every other one is mirrored.
        let scale = Vec3::new(if i % 2 == 0 { 0.4 } else { -0.4 }, 0.4, 0.4);
        place(&mut scene, which, Mat4::from_scale_rotation_translation(scale, Quat::IDENTITY, at));
    }
    scene
}

#[test]
fn instances_look_like_copies() {
    let view = view(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, EXTENT);
    with_gpu(|gpu| {
        let shared = surfaces(gpu, &crowd(true), &view, Settings::default());
        assert!(shared.depth.iter().filter(|d| **d < 1.0).count() > 300);
        assert_eq!(shared, surfaces(gpu, &crowd(false), &view, Settings::default()));
    });
}

#[test]
fn culling_changes_no_pixel() {
    // Half of the crowd lies outside.
    let view = view(Vec3::new(0.0, 0.0, 2.0), Vec3::new(2.0, 1.0, 0.0), EXTENT);
    with_gpu(|gpu| {
        let on = surfaces(gpu, &crowd(true), &view, Settings::default());
        let off = surfaces(gpu, &crowd(true), &view, Settings { culling: false, ..Settings::default() });
        assert_eq!(on, off);
    });
}

#[test]
fn two_eyes_in_one_pass_have_the_pixels_of_two_passes() {
    let mut scene = crowd(true);
    // Of the dithered kind: its pattern is that of each view.
    let pane = Material {
        alpha: AlphaMode::Blend,
        base_color: Vec4::new(0.9, 0.2, 0.2, 0.4),
        ..Material::diffuse("pane", Vec3::ONE)
    };
    let ball = mesh(&mut scene, sphere(24), pane);
    place(&mut scene, ball, Mat4::from_translation(Vec3::new(0.3, 0.2, 1.0)));
    let middle = view(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, EXTENT);
    let [left, right] = [-0.8, 0.8].map(|side| middle.beside(side));
    with_gpu(|gpu| {
        if !gpu.caps().multiview {
            return;
        }
        let of = |multiview: bool| {
            let (frame, reads) = frame(gpu, &scene, |graph, handles| {
                let settings = Settings::default();
                let eyes = gbuffer::draw_eyes(graph, handles, [&left, &right], &settings, multiview);
                eyes.map(|GBuffer { albedo, normal, depth, specular, emission, hardware, .. }| {
                    [albedo, normal, depth, specular, emission, hardware].map(|image| graph.read_image(image))
                })
            });
            reads.map(|eye| eye.map(|read| frame.image(read).to_f32()))
        };
        let (one_pass, two_passes) = (of(true), of(false));
        assert_eq!(one_pass, two_passes);
        assert_ne!(one_pass[0][2], one_pass[1][2]);
        // Each eye sees what a single view from there sees, and something.
        for (eye, of_eye) in [left, right].iter().zip(&one_pass) {
            let depth: Vec<f32> = of_eye[2].iter().map(|pixel| pixel[0]).collect();
            assert_eq!(depth, surfaces(gpu, &scene, eye, Settings::default()).depth);
            assert!(depth.iter().filter(|depth| **depth < 1.0).count() > 300);
        }
    });
}

#[test]
fn sides_are_culled_shown_or_turned_to_the_viewer() {
    // From below, the square shows its back.
    for (double_sided, mirrored, below) in
        [(false, false, true), (false, true, true), (true, false, true), (true, true, true), (false, true, false)]
    {
        let mut scene = Scene::default();
        let material = Material { double_sided, ..Material::diffuse("", Vec3::ONE) };
        let plane = mesh(&mut scene, square(), material);
        let flip = if mirrored { -1.0 } else { 1.0 };
        place(&mut scene, plane, Mat4::from_scale(Vec3::new(flip, 1.0, 1.0)));
        let eye = Vec3::new(0.0, if below { -2.0 } else { 2.0 }, 0.5);
        let view = view(eye, Vec3::ZERO, EXTENT);
        with_gpu(|gpu| {
            let got = surfaces(gpu, &scene, &view, Settings::default());
            let middle = (EXTENT[1] / 2 * EXTENT[0] + EXTENT[0] / 2) as usize;
            let label = format!("double-sided {double_sided}, mirrored {mirrored}, below {below}");
            let visible = double_sided || !below;
            assert_eq!(got.depth[middle] < 1.0, visible, "{label}");
            if visible {
                let towards = if below { Vec3::NEG_Y } else { Vec3::Y };
                assert!(got.normal[middle].abs_diff_eq(towards, 1e-3), "{label}: {}", got.normal[middle]);
            }
        });
    }
}

#[test]
fn unlit_surfaces_only_emit_and_vertex_colours_multiply() {
    let mut scene = Scene::default();
    let mut primitive = square();
    primitive.colors = vec![glam::Vec4::new(0.5, 0.25, 1.0, 1.0); 4];
    let material = Material { unlit: true, ..Material::diffuse("", Vec3::new(0.8, 0.8, 0.2)) };
    let plane = mesh(&mut scene, primitive, material);
    place(&mut scene, plane, Mat4::from_scale(Vec3::splat(9.0)));
    let view = view(Vec3::new(0.0, 2.0, 0.1), Vec3::ZERO, EXTENT);
    with_gpu(|gpu| {
        let got = surfaces(gpu, &scene, &view, Settings::default());
        for i in 0..got.depth.len() {
            assert_eq!(got.albedo[i], [0.0; 4]);
            let [r, g, b, _] = got.emission[i];
            assert!(Vec3::new(r, g, b).abs_diff_eq(Vec3::new(0.4, 0.2, 0.2), 1e-3), "{:?}", got.emission[i]);
        }
    });
}

#[test]
fn alpha_cuts_dithers_or_hides() {
    let coverage = |gpu: &Gpu, alpha: AlphaMode, opacity: f32, blended: Blended| {
        let mut scene = Scene::default();
        let mut material = Material::diffuse("", Vec3::ONE);
        material.base_color.w = opacity;
        material.alpha = alpha;
        let plane = mesh(&mut scene, square(), material);
        place(&mut scene, plane, Mat4::from_scale(Vec3::splat(9.0)));
        let view = view(Vec3::new(0.0, 2.0, 0.1), Vec3::ZERO, EXTENT);
        let got = surfaces(gpu, &scene, &view, Settings { blended, ..Settings::default() });
        got.depth.iter().filter(|d| **d < 1.0).count() as f32 / got.depth.len() as f32
    };
    with_gpu(|gpu| {
        assert_eq!(coverage(gpu, AlphaMode::Opaque, 0.1, Blended::Dithered), 1.0);
        assert_eq!(coverage(gpu, AlphaMode::Mask { cutoff: 0.5 }, 0.49, Blended::Dithered), 0.0);
        assert_eq!(coverage(gpu, AlphaMode::Mask { cutoff: 0.5 }, 0.51, Blended::Dithered), 1.0);
        assert_eq!(coverage(gpu, AlphaMode::Blend, 0.3, Blended::Threshold), 0.0);
        assert_eq!(coverage(gpu, AlphaMode::Blend, 0.9, Blended::Hidden), 0.0);
        // 6144 pixels: three standard deviations are 0.018.
        let dithered = coverage(gpu, AlphaMode::Blend, 0.3, Blended::Dithered);
        assert!((dithered - 0.3).abs() < 0.02, "{dithered}");
    });
}

#[test]
fn an_empty_scene_is_all_background() {
    let view = view(Vec3::Z, Vec3::ZERO, EXTENT);
    with_gpu(|gpu| {
        let got = surfaces(gpu, &Scene::default(), &view, Settings::default());
        assert!(got.depth.iter().all(|d| *d == 1.0));
    });
}

#[test]
fn textures_far_away_are_smooth_or_as_rays_see_them() {
    // Every other texel is white, some eight texels a pixel.
    let rgba = (0..256 * 256).map(|i| [if (i % 256 + i / 256) % 2 == 0 { 255 } else { 0 }; 4]).collect();
    let sampler = Sampler { mag_linear: false, ..Sampler::default() };
    let mut scene =
        Scene { textures: vec![Texture { name: String::new(), width: 256, height: 256, rgba }], ..Scene::default() };
    let used = Some(TextureRef { sampler, ..TextureRef::new(0) });
    let white = Material { base_color_texture: used, ..Material::diffuse("", Vec3::ONE) };
    let plane = mesh(&mut scene, square(), white);
    place(&mut scene, plane, Mat4::IDENTITY);
    let view = view(Vec3::new(0.0, 3.3, 0.01), Vec3::ZERO, EXTENT);
    with_gpu(|gpu| {
        let smooth = surfaces(gpu, &scene, &view, Settings::default());
        let sharp = surfaces(gpu, &scene, &view, Settings { mips: false, ..Settings::default() });
        let (mut seen, mut bright) = (0, 0);
        for i in 0..smooth.depth.len() {
            let (origin, direction) = ray(&view, i);
            let hit = origin - direction * (origin.y / direction.y);
            if hit.x.abs().max(hit.z.abs()) > 0.9 {
                continue;
            }
            // Half of the light, which 8 bits of sRGB keep to half a percent.
            assert!((smooth.albedo[i][1] - 0.5).abs() < 0.01, "{:?}", smooth.albedo[i]);
            assert!(sharp.albedo[i][1] < 1e-3 || sharp.albedo[i][1] > 0.999, "{:?}", sharp.albedo[i]);
            let place = (Vec2::new(hit.x, hit.z) * 0.5 + 0.5) * 256.0;
            // On the border of two texels rounding decides.
            if (place - place.round()).abs().min_element() > 0.02 {
                let white = (place.x.floor() + place.y.floor()) as i32 % 2 == 0;
                assert_eq!(sharp.albedo[i][1] > 0.5, white, "pixel {i} at {place}");
            }
            seen += 1;
            bright += usize::from(sharp.albedo[i][1] > 0.5);
        }
        assert!(seen > 300 && bright > seen / 5 && bright < 4 * seen / 5, "{bright} of {seen}");
        assert_eq!(smooth.depth, sharp.depth);
    });
}

#[test]
fn textures_are_read_at_the_level_of_their_footprint() {
    let extent = [32, 32];
    let projection = Projection::Orthographic { xmag: 1.0, ymag: 1.0, znear: 0.1, zfar: 10.0 };
    let camera = Camera { name: String::new(), projection };
    let view = View::new(&camera, look(Vec3::new(0.0, 3.0, 0.0), Vec3::ZERO), extent);
    with_gpu(|gpu| {
        // Four texels a pixel: what is as fine as a pixel stays, what is finer is averaged; also if the transform makes it so.
        for (side, scale) in [(128u32, 1.0f32), (64, 2.0)] {
            for (block, clear) in [(8, true), (4, true), (2, false), (1, false)] {
                let white = |i: u32| (i % side / block + i / side / block).is_multiple_of(2);
                let rgba = (0..side * side).map(|i| [if white(i) { 255 } else { 0 }; 4]).collect();
                let texture = Texture { name: String::new(), width: side, height: side, rgba };
                let mut scene = Scene { textures: vec![texture], ..Scene::default() };
                let transform = [scale, 0.0, 0.0, scale, 0.0, 0.0];
                let used = Some(TextureRef { transform, ..TextureRef::new(0) });
                let plain = Material { base_color_texture: used, ..Material::diffuse("", Vec3::ONE) };
                let plane = mesh(&mut scene, square(), plain);
                place(&mut scene, plane, Mat4::IDENTITY);
                let got = surfaces(gpu, &scene, &view, Settings::default());
                for (i, albedo) in got.albedo.iter().enumerate() {
                    let bright = albedo[1];
                    let right = if clear { !(0.02..=0.98).contains(&bright) } else { (bright - 0.5).abs() < 0.02 };
                    assert!(right, "blocks of {block} of {side}, pixel {i}: {bright}");
                }
            }
        }
    });
}
