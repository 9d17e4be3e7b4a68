//! Lightmaps of two-sided surfaces: each side has its own light.

use crate::{
    daylight_lightmap::{baking, lightmap_lit_by, planned, range, seen},
    tracer_lab::{Stage, view},
};
use glam::{Mat4, Quat, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{Material, Node, Transform, View},
    techniques::daylight::{Backs, Baked, Baking, Group, Sources, Transport, lightmap},
};

/// A box of two metres that glows in its upper and in its lower half, parted by a grey sheet with two sides; its front is up.
struct Parted {
    stage: Stage,
    lamps: [u32; 2],
    grey: u32,
}

impl Parted {
    /// `mirrored`: the node of the sheet mirrors it.
    fn new(radiances: [f32; 2], mirrored: bool) -> Self {
        let mut stage = Stage::new();
        let lamps = radiances.map(|radiance| stage.emitter(Vec3::splat(radiance)));
        for (lamp, low) in lamps.into_iter().zip([0.0, -1.0]) {
            stage.cuboid(lamp, vec3(-1.0, low, -1.0), vec3(1.0, low + 1.0, 1.0), true);
        }
        // The floor of the upper half and the ceiling of the lower one.
        let nodes = &mut stage.scene.nodes;
        nodes.remove(6 + 3);
        nodes.remove(2);
        let grey = stage.material(Material { double_sided: true, ..Material::diffuse("grey", Vec3::splat(0.5)) });
        let sheet = stage.quad(grey, vec3(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0);
        if mirrored {
            stage.scene.nodes[sheet].local = Transform::Matrix(Mat4::from_scale(vec3(-1.0, 1.0, 1.0)));
        }
        Self { stage, lamps, grey }
    }

    /// Cameras above the sheet and below it.
    fn cameras() -> [View; 2] {
        [0.9, -0.9].map(|height| view(vec3(0.1, height, 0.2), vec3(0.0, 0.0, 0.1), 60.0, [32, 32]))
    }

    fn bake(&self, gpu: &lucerna::gpu::Gpu, settings: Baking) -> Baked {
        lightmap_lit_by(gpu, &self.stage.scene, &self.lamps, settings)
    }
}

#[test]
fn both_sides_of_a_sheet_have_their_own_light() {
    with_gpu(|gpu| {
        let radiances = [1.0, 0.5];
        for (mirrored, backs) in [(false, true), (true, true), (false, false)] {
            let parted = Parted::new(radiances, mirrored);
            let baked = parted.bake(gpu, Baking { backs, tolerance: 0.001, density: 4.0, ..baking(4096) });
            for (camera, radiance) in Parted::cameras().into_iter().zip(radiances) {
                let wanted = std::f32::consts::PI * if backs { radiance } else { radiances[0] };
                let ratios: Vec<f32> =
                    seen(gpu, &parted.stage.scene, camera, &baked).iter().map(|(_, e)| e / wanted).collect();
                let mean = ratios.iter().sum::<f32>() / ratios.len() as f32;
                let [least, most] = range(ratios.iter().copied());
                println!("mirrored {mirrored}, backs {backs}, {radiance}: {mean:.4}, {least:.4} to {most:.4}");
                assert!(ratios.len() == 32 * 32 && (mean - 1.0).abs() < 0.02, "{mean}");
                assert!(least > 0.93 && most < 1.07, "{least} to {most}");
            }
        }
    });
}

#[test]
fn a_back_that_no_light_reaches_is_black_and_has_no_texels() {
    with_gpu(|gpu| {
        let mut parted = Parted::new([1.0, 0.0], false);
        let alone = parted.bake(gpu, baking(64));
        assert_eq!(alone.stored.corners.backs, Some(Vec::new()), "no back is lit");
        let without = parted.stage.scene.clone();
        // The same sheet, smaller and lit from both sides.
        let nodes = &mut parted.stage.scene.nodes;
        let small = nodes.len();
        let place = Mat4::from_scale_rotation_translation(Vec3::splat(0.1), Quat::IDENTITY, vec3(0.7, 0.3, -0.7));
        nodes.push(Node { local: Transform::Matrix(place), ..nodes[small - 1].clone() });
        let baked = parted.bake(gpu, baking(64));
        let first = lightmap::triangles(&parted.stage.scene)[..small].iter().sum::<u32>();
        let backs: Vec<u32> = baked.stored.corners.backs.iter().flatten().map(|(triangle, _)| *triangle).collect();
        assert_eq!(backs, [first, first + 1]);
        let without = Parted { stage: Stage { scene: without }, lamps: parted.lamps, grey: parted.grey };
        for (parted, baked) in [(&without, &alone), (&parted, &baked)] {
            let [above, below] = Parted::cameras()
                .map(|camera| range(seen(gpu, &parted.stage.scene, camera, baked).into_iter().map(|(_, e)| e)));
            assert!(above[0] > 2.0 && below == [0.0, 0.0], "{above:?} {below:?}");
        }
    });
}

#[test]
fn the_inside_of_a_closed_solid_needs_no_texels() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let lamp = stage.emitter(Vec3::ONE);
        stage.cuboid(lamp, Vec3::splat(-3.0), Vec3::splat(3.0), true);
        let grey = stage.material(Material { double_sided: true, ..Material::diffuse("grey", Vec3::splat(0.5)) });
        stage.sphere(grey, vec3(1.0, 0.0, 0.0), 0.5, 8, false);
        let lamps = [Group { name: "lamps".into(), lights: Vec::new(), materials: vec![lamp] }];
        let lit = |stage: &Stage| Backs::lit(gpu, &stage.scene, &lamps, &baking(64)).unwrap().lit.unwrap();
        assert!(!lit(&stage).contains(&true));
        // A sheet beside it, and a sphere without its last triangle.
        let sheet = stage.quad(grey, Vec3::NEG_X, Vec3::X * 0.5, Vec3::Y * 0.5);
        stage.sphere(grey, vec3(1.0, 1.5, 0.0), 0.5, 8, false);
        let indices = &mut stage.scene.meshes.last_mut().unwrap().primitives[0].indices;
        indices.truncate(indices.len() - 3);
        let found = lit(&stage);
        let mut first = 0;
        for (node, count) in lightmap::triangles(&stage.scene).into_iter().enumerate() {
            let of_node = &found[first as usize..(first + count) as usize];
            // Nodes 0 to 5 are the one-sided walls, 6 is the closed sphere.
            assert!(of_node.iter().all(|lit| *lit == (node >= sheet)), "node {node}: {of_node:?}");
            first += count;
        }
        let off = Backs::lit(gpu, &stage.scene, &lamps, &Baking { backs: false, ..baking(64) }).unwrap();
        assert_eq!(off.lit, None);
    });
}

#[test]
fn a_back_that_little_light_reaches_has_texels() {
    with_gpu(|gpu| {
        // A black box of 2 m around a sheet; a hole of 8 cm in its floor, 1 m below the back of the sheet, is the only way to the light.
        let mut stage = Stage::new();
        let lamp = stage.emitter(Vec3::ONE);
        stage.cuboid(lamp, Vec3::splat(-4.0), Vec3::splat(4.0), true);
        let black = stage.material(Material { double_sided: false, ..Material::diffuse("black", Vec3::ZERO) });
        stage.cuboid(black, vec3(-1.0, -1.0, -1.0), Vec3::ONE, true);
        let floor = stage.scene.nodes.len() - 4;
        stage.scene.nodes.remove(floor);
        for (corner, size) in [
            (vec3(-1.0, -1.0, -1.0), vec3(2.0, 0.0, 0.96)),
            (vec3(-1.0, -1.0, 0.04), vec3(2.0, 0.0, 0.96)),
            (vec3(-1.0, -1.0, -0.04), vec3(0.96, 0.0, 0.08)),
            (vec3(0.04, -1.0, -0.04), vec3(0.96, 0.0, 0.08)),
        ] {
            stage.quad(black, corner, Vec3::Z * size.z, Vec3::X * size.x);
        }
        let grey = stage.material(Material { double_sided: true, ..Material::diffuse("grey", Vec3::splat(0.5)) });
        stage.quad(grey, vec3(-0.2, 0.0, -0.2), Vec3::Z * 0.4, Vec3::X * 0.4);
        let lamps = [Group { name: "lamps".into(), lights: Vec::new(), materials: vec![lamp] }];
        let lit = Backs::lit(gpu, &stage.scene, &lamps, &baking(64)).unwrap().lit.unwrap();
        assert_eq!(lit.iter().filter(|lit| **lit).count(), 2, "of {}", lit.len());
    });
}

#[test]
fn the_transport_of_the_search_gathers_the_light_of_a_new_one() {
    with_gpu(|gpu| {
        let Parted { stage: Stage { scene }, lamps, .. } = Parted::new([1.0, 0.5], false);
        let (plan, unwrapped) = planned(gpu, &scene, &lamps, baking(16));
        let sources = || Sources::Lightmap(Box::new(unwrapped.by_tile(plan.side())));
        let searched = Backs::lit(gpu, &scene, &plan.lamps, &plan.settings).unwrap();
        let mut searched = searched.transport(gpu, &scene, &plan, sources()).unwrap();
        let mut new = Transport::new(gpu, &scene, &plan, sources()).unwrap();
        assert!(!plan.times.is_empty() && plan.tile_count() > 0);
        for tile in 0..plan.tile_count() {
            assert_eq!(searched.tile(&plan, tile).unwrap(), new.tile(&plan, tile).unwrap());
        }
    });
}
