//! The device's path tracer against the CPU's, which was written apart from it and has neither weights between strategies nor
//! importance sampling of lights: layer by layer, for every light and material.

use crate::common;
use crate::reference_kit::{Task, corner, disagreements, expect_agreement, eye, panel, point, sky, spot_and_sun};
use crate::tracer_lab;
use glam::{Mat4, Vec2, Vec3, Vec4};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{AlphaMode, LightKind, Material, Pose, Texture, TextureRef, Transform, View, load},
    tracer::Sources,
};

fn matt() -> Material {
    Material::diffuse("floor", Vec3::new(0.6, 0.65, 0.5))
}

fn gloss(roughness: f32, metallic: f32) -> Material {
    Material { roughness, metallic, ..Material::diffuse("gloss", Vec3::new(0.8, 0.6, 0.4)) }
}

#[test]
fn lights_of_every_kind() {
    let mut punctual = corner(gloss(0.5, 0.0));
    point(&mut punctual);
    spot_and_sun(&mut punctual);
    let box_ = punctual.material(matt());
    punctual.cuboid(box_, Vec3::new(-0.6, 0.0, -0.6), Vec3::new(0.1, 0.8, 0.1), false);
    let mut lamp = corner(matt());
    panel(&mut lamp, Vec3::new(5.0, 4.0, 3.0));
    let mut open = corner(matt());
    open.scene.environment = Some(sky());
    let mut everything = corner(gloss(0.4, 0.5));
    point(&mut everything);
    panel(&mut everything, Vec3::new(2.0, 3.0, 4.0));
    everything.scene.environment = Some(sky());
    // Lamps of which each place sees another choice, behind a wall and in front of it.
    let mut crowd = corner(gloss(0.5, 0.0));
    for i in 0..30 {
        let at = Vec3::new(-1.3 + 0.5 * (i % 6) as f32, 0.3 + 0.3 * (i / 6) as f32, -1.3 + 0.45 * (i * 7 % 6) as f32);
        let color = Vec3::new(0.2 + 0.1 * (i % 3) as f32, 0.3, 0.1 * (i % 4) as f32);
        let turned = Mat4::from_translation(at) * Mat4::from_rotation_x(-1.3) * Mat4::from_rotation_y(i as f32);
        let range = (i % 3 == 0).then_some(0.9);
        let kind =
            if i % 2 == 0 { LightKind::Point { range } } else { LightKind::Spot { range, inner: 0.1, outer: 0.9 } };
        crowd.light(kind, color, 0.4, turned);
    }
    let wall = crowd.material(matt());
    crowd.cuboid(wall, Vec3::new(-0.2, 0.0, -1.5), Vec3::new(-0.1, 1.2, 0.4), false);
    panel(&mut crowd, Vec3::new(2.0, 2.5, 3.0));
    let few = Task { samples: [1500, 24], ..Task::default() };
    with_gpu(|gpu| {
        let alone = |sources| Task { sources, diffuse_only: true, bounces: 1, samples: [800, 24], ..Task::default() };
        expect_agreement(
            gpu,
            &[
                ("point, spot and sun", &punctual.scene, eye(), Task { jitter: false, ..Task::default() }),
                ("panel, rays on the CPU", &lamp.scene, eye(), few),
                ("panel, points on the CPU", &lamp.scene, eye(), Task { sample_lamps: true, ..Task::default() }),
                ("sky", &open.scene, eye(), few),
                ("everything", &everything.scene, eye(), Task { sample_lamps: true, ..few }),
                ("a crowd of lamps", &crowd.scene, eye(), Task { sample_lamps: true, samples: [400, 48], ..few }),
                ("everything, punctual alone", &everything.scene, eye(), alone(Sources::Punctual)),
                ("everything, lamps alone", &everything.scene, eye(), alone(Sources::Emissive)),
                ("everything, sky alone", &everything.scene, eye(), alone(Sources::Environment)),
            ],
        );
    });
}

#[test]
fn materials_of_every_kind() {
    let with = |material: Material| {
        let mut stage = corner(matt());
        point(&mut stage);
        panel(&mut stage, Vec3::new(3.0, 3.0, 2.0));
        stage.scene.environment = Some(sky());
        let material = stage.material(material);
        stage.cuboid(material, Vec3::new(-0.6, 0.1, -0.5), Vec3::new(0.3, 0.9, 0.3), false);
        stage.scene
    };
    let metal = with(gloss(0.25, 1.0));
    let mirror = with(gloss(0.0, 1.0));
    let glass = with(Material { transmission: 1.0, ior: 1.5, ..Material::diffuse("", Vec3::new(0.9, 1.0, 0.8)) });
    let thin = with(Material {
        transmission: 0.7,
        ior: 1.4,
        double_sided: true,
        ..Material::diffuse("", Vec3::new(0.6, 0.8, 1.0))
    });
    let unlit = with(Material { unlit: true, ..Material::diffuse("", Vec3::new(0.3, 0.9, 0.6)) });
    let blended = with(Material {
        alpha: AlphaMode::Blend,
        base_color: Vec4::new(0.7, 0.7, 0.2, 0.4),
        ..Material::diffuse("", Vec3::ONE)
    });
    let glowing = with(Material { emissive: Vec3::new(0.5, 0.2, 1.0), double_sided: true, ..matt() });
    let task = Task { sample_lamps: true, samples: [1000, 24], bounces: 1, ..Task::default() };
    with_gpu(|gpu| {
        expect_agreement(
            gpu,
            &[
                ("rough metal", &metal, eye(), task),
                ("mirror", &mirror, eye(), task),
                ("mirror, matt", &mirror, eye(), Task { diffuse_only: true, ..task }),
                ("glass", &glass, eye(), task),
                ("glass, one sharp event", &glass, eye(), Task { specular_bounces: 1, ..task }),
                ("thin glass", &thin, eye(), task),
                ("unlit", &unlit, eye(), task),
                ("blended", &blended, eye(), task),
                ("glowing", &glowing, eye(), Task { sample_lamps: false, ..task }),
            ],
        );
    });
}

/// A texture of 4 × 4 texels, some of them cut out.
fn checker() -> Texture {
    let rgba = (0..16u8).map(|i| [40 * (i % 4) + 60, 200 - 10 * i, 90, if i % 3 == 0 { 0 } else { 255 }]).collect();
    Texture { name: "checker".into(), width: 4, height: 4, rgba }
}

#[test]
fn attributes_and_transforms() {
    let mut stage = corner(matt());
    point(&mut stage);
    stage.scene.environment = Some(sky());
    stage.scene.textures.push(checker());
    let texture = Some(TextureRef::new(0));
    let masked = stage.material(Material {
        base_color_texture: texture,
        alpha: AlphaMode::Mask { cutoff: 0.5 },
        double_sided: true,
        ..matt()
    });
    let shown = stage.material(Material { emissive: Vec3::new(3.0, 2.0, 1.0), emissive_texture: texture, ..matt() });
    let colored = stage.material(gloss(0.6, 0.2));
    stage.quad(masked, Vec3::new(-0.9, 0.2, 0.5), Vec3::X, Vec3::Y);
    stage.quad(shown, Vec3::new(-0.9, 0.9, -1.4), Vec3::X, Vec3::Y * 0.8);
    let uvs = vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let n = stage.scene.meshes.len();
    for mesh in &mut stage.scene.meshes[n - 2..] {
        mesh.primitives[0].uvs = vec![uvs.clone()];
    }
    stage.sphere(colored, Vec3::ZERO, 0.4, 12, false);
    let sphere = &mut stage.scene.meshes.last_mut().unwrap().primitives[0];
    sphere.colors = sphere.normals.iter().map(|n| (*n * 0.5 + 0.5).extend(1.0)).collect();
    // Mirrored and stretched.
    stage.scene.nodes.last_mut().unwrap().local = Transform::Matrix(
        Mat4::from_translation(Vec3::new(0.6, 0.5, 0.0)) * Mat4::from_scale(Vec3::new(-1.0, 1.2, 0.8)),
    );
    stage.scene.validate().unwrap();
    let task = Task { samples: [1500, 24], bounces: 1, ..Task::default() };
    with_gpu(|gpu| {
        expect_agreement(
            gpu,
            &[
                ("attributes", &stage.scene, eye(), task),
                ("attributes, centres", &stage.scene, eye(), Task { jitter: false, slack: 3e-3, ..task }),
            ],
        );
    });
}

#[test]
fn models_with_odd_materials() {
    let Some(assets) = common::assets() else { return };
    let wanted = std::env::var("LUCERNA_MODELS").ok();
    let few = "BoxVertexColors TwoSidedPlane AlphaBlendModeTest CornellBox-Emissive emissive-triangle roughness-scale";
    let names: Vec<&str> = wanted.as_deref().unwrap_or(few).split_whitespace().collect();
    with_gpu(|gpu| {
        let mut wrong = Vec::new();
        for name in names {
            let folder = assets.join("gltf").join(name);
            let Some(file) = model(&folder) else { continue };
            let mut scene = load(&file, &Default::default()).unwrap();
            scene.environment = Some(sky());
            let pose = Pose::rest(&scene);
            let bvh = lucerna::scene::bvh::Bvh::build(&scene, &pose);
            let (low, high) = bvh.bounds().unwrap();
            let (centre, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
            let from = centre + Vec3::new(0.5, 0.4, 1.0).normalize() * radius * 2.2;
            let view: View = tracer_lab::view(from, centre, 45.0, [24, 16]);
            // Rays hit the box's small lamp too rarely.
            let sample_lamps = name == "CornellBox-Emissive";
            let task = Task { samples: [400, 24], bounces: 1, sample_lamps, ..Task::default() };
            let found = disagreements(gpu, &scene, &view, &task);
            println!("{name}: {} disagreements", found.len());
            found.iter().take(6).for_each(|text| println!("    {text}"));
            wrong.extend(found.first().map(|text| format!("{name}: {text}")));
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    });
}

/// The first glTF file under a folder.
fn model(folder: &std::path::Path) -> Option<std::path::PathBuf> {
    let mut entries: Vec<_> = std::fs::read_dir(folder).ok()?.flatten().map(|e| e.path()).collect();
    entries.sort();
    let is_model = |p: &std::path::PathBuf| p.extension().is_some_and(|e| e == "gltf" || e == "glb");
    entries
        .iter()
        .find(|p| is_model(p))
        .cloned()
        .or_else(|| entries.iter().filter(|p| p.is_dir()).find_map(|p| model(p)))
}
