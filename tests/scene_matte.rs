//! Mattes of chosen objects against rays and against the G-buffer.

use crate::scene_kit::*;
use glam::{Mat4, Vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    passes::{gbuffer, matte},
    resident::Resident,
    scene::{AlphaMode, Material, Node, Pose, Sampler, Scene, Texture, TextureRef, View, chosen::Chosen},
};

const EXTENT: [u32; 2] = [96, 64];

/// The mattes of objects by their names, and where there is a surface.
fn mattes(gpu: &Gpu, scene: &Scene, view: &View, names: &[&str]) -> (Vec<Vec<bool>>, Vec<bool>) {
    let mut resident = Resident::new(gpu, scene).unwrap();
    let mut graph = Graph::new("matte");
    let handles = resident.frame_in(&mut graph, scene, &Pose::rest(scene));
    let surfaces =
        gbuffer::draw(&mut graph, &handles, view, &gbuffer::Settings { mips: false, ..gbuffer::Settings::default() });
    let drawn: Vec<_> = names
        .iter()
        .map(|names| {
            let chosen = Chosen::by_names(scene, names).unwrap();
            let matte = matte::draw(&mut graph, &handles, &surfaces, view, &chosen);
            graph.read_image(matte)
        })
        .collect();
    let depth = graph.read_image(surfaces.depth);
    let mut frame = Runner::new(gpu).run(graph).unwrap();
    let mut values = |token| frame.take_floats(token).into_iter().map(|v| v[0]).collect::<Vec<f32>>();
    let found = drawn.into_iter().map(|token| {
        let matte = values(token);
        assert!(matte.iter().all(|v| *v == 0.0 || *v == 1.0));
        matte.into_iter().map(|v| v == 1.0).collect()
    });
    let found = found.collect();
    (found, values(depth).into_iter().map(|z| z < 1.0).collect())
}

fn named(scene: &mut Scene, name: &str, mesh: u32, at: Mat4) {
    let node = place(scene, mesh, at);
    scene.nodes[node].name = name.into();
}

#[test]
fn what_stands_behind_is_not_in_the_matte() {
    let mut scene = Scene::default();
    let ball = mesh(&mut scene, sphere(32), Material::diffuse("red", Vec3::X));
    let other = mesh(&mut scene, sphere(32), Material::diffuse("blue", Vec3::Z));
    named(&mut scene, "near", ball, Mat4::from_translation(Vec3::new(0.0, 0.0, 1.0)));
    named(&mut scene, "far", ball, Mat4::from_translation(Vec3::new(1.6, 0.0, -3.0)));
    named(&mut scene, "beside", other, Mat4::from_translation(Vec3::new(-2.5, 0.0, 0.0)));
    let view = view(Vec3::new(0.0, 0.0, 6.0), Vec3::ZERO, EXTENT);
    // The ball that a pixel's ray meets first.
    let first = |i: usize| {
        let [w, h] = EXTENT.map(|e| e as usize);
        let uv = glam::Vec2::new(((i % w) as f32 + 0.5) / w as f32, ((i / w) as f32 + 0.5) / h as f32);
        let (origin, to) = (view.world_from_depth(uv, 0.01), view.world_from_depth(uv, 1.0));
        let along = (to - origin).normalize();
        let balls = [Vec3::new(0.0, 0.0, 1.0), Vec3::new(1.6, 0.0, -3.0), Vec3::new(-2.5, 0.0, 0.0)];
        let hit = |centre: Vec3| {
            let b = (centre - origin).dot(along);
            let off = (origin + b * along).distance(centre);
            // Near the outline a polygonal sphere differs from a sphere.
            if (off - 1.0).abs() < 0.04 { None } else { Some((off < 1.0).then(|| b - (1.0 - off * off).sqrt())) }
        };
        let hits: Option<Vec<Option<f32>>> = balls.into_iter().map(hit).collect();
        let hits = hits?;
        Some((0..3).filter(|k| hits[*k].is_some()).min_by(|a, b| hits[*a].unwrap().total_cmp(&hits[*b].unwrap())))
    };
    with_gpu(|gpu| {
        let names = ["near", "far", "beside", "red", "far,blue"];
        let (found, _) = mattes(gpu, &scene, &view, &names);
        let mut seen = [0; 3];
        for (i, first) in (0..found[0].len()).filter_map(|i| Some((i, first(i)?))) {
            first.into_iter().for_each(|k| seen[k] += 1);
            let wanted = [first == Some(0), first == Some(1), first == Some(2)];
            assert_eq!([found[0][i], found[1][i], found[2][i]], wanted, "pixel {i}");
            assert_eq!(found[3][i], wanted[0] || wanted[1], "pixel {i}");
            assert_eq!(found[4][i], wanted[1] || wanted[2], "pixel {i}");
        }
        assert!(seen.iter().all(|count| *count > 30), "{seen:?}");
    });
}

#[test]
fn holes_show_the_object_behind_and_each_pixel_has_one_object() {
    let mut scene = Scene::default();
    // Every second column of the front square is a hole.
    let rgba = [[255, 255, 255, 255], [255, 255, 255, 0]].repeat(4);
    scene.textures.push(Texture { name: String::new(), width: 8, height: 1, rgba });
    for (name, alpha) in [("grid", AlphaMode::Mask { cutoff: 0.5 }), ("veil", AlphaMode::Blend)] {
        let mut material = Material { alpha, ..Material::diffuse(name, Vec3::ONE) };
        if name == "grid" {
            let sampler = Sampler { mag_linear: false, min_linear: false, ..Sampler::default() };
            material.base_color_texture =
                Some(TextureRef { texture: 0, uv_set: 0, transform: TextureRef::IDENTITY, sampler });
        } else {
            material.base_color = glam::Vec4::new(1.0, 1.0, 1.0, 0.5);
        }
        let square = mesh(&mut scene, square(), material);
        let at = if name == "grid" { Vec3::new(-1.2, 1.0, 0.0) } else { Vec3::new(1.2, 1.0, 0.0) };
        named(&mut scene, name, square, Mat4::from_translation(at));
    }
    let floor = mesh(&mut scene, square(), Material::diffuse("floor", Vec3::ONE));
    scene.nodes.push(Node { name: "room".into(), ..Node::default() });
    let parent = scene.nodes.len() as u32 - 1;
    named(&mut scene, "", floor, Mat4::from_scale(Vec3::splat(3.0)));
    scene.nodes.last_mut().unwrap().parent = Some(parent);
    let view = view(Vec3::new(0.0, 6.0, 0.1), Vec3::ZERO, EXTENT);
    with_gpu(|gpu| {
        let (found, surface) = mattes(gpu, &scene, &view, &["grid", "veil", "room", "grid,veil,floor"]);
        for i in 0..surface.len() {
            let count = (0..3).filter(|k| found[*k][i]).count();
            assert_eq!(count, usize::from(surface[i]), "pixel {i} shows {count} objects");
            assert_eq!(found[3][i], surface[i]);
        }
        let counted = |k: usize| found[k].iter().filter(|v| **v).count() as f32;
        // Half of each square is the floor behind it; both squares have the same size.
        assert!(counted(0) > 100.0 && (counted(0) / counted(1) - 1.0).abs() < 0.15, "{} {}", counted(0), counted(1));
    });
}
