//! What the path tracer's layers tell of the first surface, and what of its textures decides the light, against closed forms.

use crate::tracer_lab::{Stage, deviation, flat_view, matt, mean, render};
use glam::{Mat4, Vec2, Vec3, Vec4, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    image::srgb,
    scene::{Material, Primitive, Texture, TextureRef, Transform},
    tracer::{Filter, Settings, Strategy},
};

/// One row of texels.
fn texture(rgba: &[[u8; 4]]) -> Texture {
    Texture { name: String::new(), width: rgba.len() as u32, height: 1, rgba: rgba.to_vec() }
}

/// A square of side 2 that looks up, with texture coordinates that are the same everywhere: set 0 the first of two texels, set 1 the
/// second.
fn square(stage: &mut Stage, material: u32, side: f32, world: Mat4) {
    let node = stage.quad(material, vec3(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0);
    stage.scene.nodes[node].local = Transform::Matrix(world);
    let mesh = stage.scene.nodes[node].mesh.unwrap() as usize;
    let primitive: &mut Primitive = &mut stage.scene.meshes[mesh].primitives[0];
    primitive.uvs = [0.25, 0.75].map(|u| vec![Vec2::new(u, 0.5); 4]).to_vec();
    primitive.colors = vec![Vec4::new(0.5, 1.0, 0.75, 1.0); 4];
    primitive.tangents = vec![Vec4::new(1.0, 0.0, 0.0, side); 4];
}

#[track_caller]
fn close(found: [f64; 3], wanted: Vec3, slack: f32) {
    let found = Vec3::from_array(found.map(|v| v as f32));
    assert!(found.abs_diff_eq(wanted, slack), "{found} instead of {wanted}");
}

#[test]
fn layers_tell_of_the_first_surface() {
    let codes = [[188, 120, 60, 255], [20, 102, 51, 255], [170, 90, 230, 255], [90, 188, 250, 255]];
    let [base, _, mapped, glow] = codes.map(|[r, g, b, _]| vec3(r.into(), g.into(), b.into()) / 255.0);
    let linear = |v: Vec3| Vec3::from_array(v.to_array().map(srgb::decode));
    // The second texel, of the second set of coordinates.
    let slot = |i: u32| Some(TextureRef { uv_set: 1, ..TextureRef::new(i) });
    let material = Material {
        base_color: vec3(0.8, 0.6, 0.4).extend(1.0),
        base_color_texture: slot(0),
        metallic: 0.5,
        roughness: 0.75,
        metallic_roughness_texture: slot(1),
        normal_texture: slot(2),
        normal_scale: 0.6,
        emissive: vec3(2.0, 3.0, 4.0),
        emissive_texture: slot(3),
        ..Material::default()
    };
    // Vertex colours multiply the base colour; metallic stands in blue.
    let base = vec3(0.8, 0.6, 0.4) * linear(base) * vec3(0.5, 1.0, 0.75);
    let albedo = base * (1.0 - 0.5 * 51.0 / 255.0);
    let glow = vec3(2.0, 3.0, 4.0) * linear(glow);
    let mapped = (mapped * 2.0 - 1.0) * vec3(0.6, 0.6, 1.0);
    let turned = Mat4::from_translation(vec3(0.3, 0.5, -0.2)) * Mat4::from_rotation_y(0.5);
    with_gpu(|gpu| {
        for world in [turned, turned * Mat4::from_scale(vec3(-1.5, 1.0, 1.0))] {
            for side in [1.0, -1.0] {
                let mut stage = Stage::new();
                stage.scene.textures.extend(codes.map(|code| texture(&[[255, 0, 255, 255], code])));
                let material = stage.material(material.clone());
                square(&mut stage, material, side, world);
                // One pixel, straight down.
                let above = flat_view(vec3(0.4, 3.0, -0.1), vec3(0.4, 0.0, -0.1), 1e-3, [1, 1]);
                let layers = render(gpu, &stage.scene, &above, &Settings { filter: Filter::Centre, ..matt(0) }, 3);
                let tangent = world.transform_vector3(Vec3::X).normalize();
                let bitangent = Vec3::Y.cross(tangent) * side * world.determinant().signum();
                let normal = (tangent * mapped.x + bitangent * mapped.y + Vec3::Y * mapped.z).normalize();
                close(mean(&layers, "normal"), normal, 1e-3);
                close(mean(&layers, "albedo"), albedo, 6e-3);
                close(mean(&layers, "emission"), glow, 0.04);
                close(mean(&layers, "position"), vec3(0.4, 0.5, -0.1), 1e-3);
                assert!((mean(&layers, "depth")[0] - 2.5).abs() < 1e-4);
                assert_eq!(mean(&layers, "samples")[0], 3.0);
            }
        }
    });
}

#[test]
fn roughness_stands_in_green_and_metallic_in_blue() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        // What is smooth and metallic is a mirror, which shows the lamp over it; red says nothing.
        for texel in [[255, 0, 255, 255], [0, 255, 255, 255], [0, 0, 0, 255]] {
            stage.scene.textures = vec![texture(&[[128, 128, 128, 255], texel])];
            stage.scene.nodes.clear();
            let used = Some(TextureRef { uv_set: 1, ..TextureRef::new(0) });
            let metal =
                Material { metallic: 1.0, roughness: 1.0, metallic_roughness_texture: used, ..Material::default() };
            let metal = stage.material(metal);
            square(&mut stage, metal, 1.0, Mat4::IDENTITY);
            let lamp = stage.emitter(vec3(3.0, 4.0, 5.0));
            stage.quad(lamp, vec3(-2.0, 4.0, -2.0), Vec3::X * 4.0, Vec3::Z * 4.0);
            let above = flat_view(vec3(0.1, 3.0, 0.1), vec3(0.1, 0.0, 0.1), 1e-3, [1, 1]);
            let settings = Settings { filter: Filter::Centre, bounces: 0, ..Settings::default() };
            let layers = render(gpu, &stage.scene, &above, &settings, 2);
            let shown = if texel[1] == 0 && texel[2] == 255 { vec3(1.5, 4.0, 3.75) } else { Vec3::ZERO };
            close(mean(&layers, "emission"), shown, 1e-3);
        }
    });
}

#[test]
fn single_sided_lamps_shine_from_their_front_alone() {
    with_gpu(|gpu| {
        let lit = |up: bool, double_sided: bool, strategy: Strategy| {
            let mut stage = Stage::new();
            let floor = stage.material(Material::diffuse("floor", Vec3::ONE));
            stage.quad(floor, vec3(-0.01, 0.0, -0.01), Vec3::Z * 0.02, Vec3::X * 0.02);
            let lamp = stage.material(Material { double_sided, ..Material::emitter("lamp", Vec3::splat(2.0)) });
            let (a, b) = if up { (Vec3::Z, Vec3::X) } else { (Vec3::X, Vec3::Z) };
            stage.quad(lamp, vec3(-0.5, 0.4, -0.5), a, b);
            let above = flat_view(vec3(0.0, 0.3, 0.0), Vec3::ZERO, 0.01, [8, 8]);
            let layers = render(gpu, &stage.scene, &above, &Settings { strategy, ..matt(0) }, 32);
            (mean(&layers, "direct")[1], deviation(&layers))
        };
        for strategy in [Strategy::Mis, Strategy::Lights, Strategy::Bsdf] {
            assert_eq!(lit(true, false, strategy).0, 0.0, "{strategy:?}: light from the back");
            let (one, sigma) = lit(false, false, strategy);
            let (two, other) = lit(true, true, strategy);
            // Four quarters of the form factor of a differential area under the corner of a rectangle (Howell, B-4).
            let x = 0.5f64 / 0.4;
            let slant = (1.0 + x * x).sqrt();
            let exact = 2.0 * 4.0 / std::f64::consts::PI * (x / slant) * (x / slant).atan();
            assert!((one - exact).abs() < 4.5 * sigma, "{strategy:?}: {one} ± {sigma} instead of {exact}");
            assert!((two - exact).abs() < 4.5 * other, "{strategy:?}: {two} ± {other} instead of {exact}");
        }
    });
}
