//! Precomputed transfer: how the light of the samples reaches the pixels.

use crate::{
    prt_lab::{baked, closed, diffuse, small},
    tracer_lab::{Stage, flat_view, view},
};
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    image::Layers,
    scene::{Camera, Material, Pose, Projection, Scene, View},
    technique::{Ready, Shot},
    techniques::prt::{Baked, Baking, Direct, PictureSettings, Prt, Spread, Stored, Tree},
};

const WAYS: [Spread; 3] = [Spread::Gather, Spread::Splats, Spread::Vertices];

/// A picture, its passes, and the numbers of its cost.
struct Shown {
    layers: Layers,
    passes: String,
    numbers: Vec<(&'static str, f64)>,
}

impl Shown {
    fn layer(&self, name: &str) -> &[f32] {
        &self.layers.layer(name).unwrap().data
    }

    fn number(&self, name: &str) -> f64 {
        self.numbers.iter().find(|(other, _)| *other == name).unwrap().1
    }
}

fn picture(gpu: &Gpu, scene: &Scene, stored: &Stored, view: &View, settings: &PictureSettings) -> Shown {
    let baked = Baked::new(stored.clone());
    let mut ready = Ready::<Prt>::new(gpu, scene, settings, Some(&baked), &mut |_, _| true).unwrap();
    let mut graph = Graph::new("prt");
    let picture = ready.frame(&mut graph, (scene, &Pose::rest(scene)), view, Shot::default(), settings).unwrap();
    let reading = picture.read(&mut graph, true, false);
    let frame = Runner::new(gpu).run(&graph).unwrap();
    let passes = graph.plan().unwrap().list_passes();
    Shown { layers: reading.layers(&frame), passes, numbers: reading.numbers(&frame) }
}

fn by(spread: Spread) -> PictureSettings {
    let mut settings = diffuse();
    settings.prt.spread = spread;
    settings
}

/// Mean difference of two layers, as a share of the mean of the second one.
fn apart(a: &[f32], b: &[f32]) -> f32 {
    let sum: f32 = b.iter().sum();
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>() / sum
}

/// The inside of a room and a block in it, of quads of about `step` metres.
fn divided(step: f32) -> Scene {
    let mut stage = Stage::new();
    let white = stage.material(Material::diffuse("white", Vec3::splat(0.7)));
    let red = stage.material(Material::diffuse("red", vec3(0.7, 0.1, 0.1)));
    let mut cuboid = |material: u32, low: Vec3, high: Vec3, inside: bool| {
        let size = high - low;
        for side in 0..6 {
            let unit = |i: usize| Vec3::from_array(std::array::from_fn(|k| if k == i % 3 { size[k] } else { 0.0 }));
            let (a, b) = (unit(side / 2 + 1), unit(side / 2 + 2));
            let corner = if side % 2 == 1 { low + unit(side / 2) } else { low };
            let (a, b) = if (side % 2 == 1) != inside { (a, b) } else { (b, a) };
            let [n, m] = [a, b].map(|edge| (edge.length() / step).ceil() as u32);
            let place = |i: u32| corner + a * ((i % (n + 1)) as f32 / n as f32) + b * ((i / (n + 1)) as f32 / m as f32);
            let positions: Vec<Vec3> = (0..(n + 1) * (m + 1)).map(place).collect();
            let quad = |i: u32| {
                let first = i / n * (n + 1) + i % n;
                [first, first + 1, first + n + 2, first, first + n + 2, first + n + 1]
            };
            let normals = vec![a.cross(b).normalize(); positions.len()];
            stage.mesh(if side == 0 { red } else { material }, positions, normals, (0..n * m).flat_map(quad).collect());
        }
    };
    cuboid(white, vec3(-2.0, 0.0, -1.5), vec3(2.0, 2.5, 1.5), true);
    cuboid(white, vec3(0.3, 0.001, -0.6), vec3(0.9, 1.0, 0.2), false);
    stage.point(vec3(-0.4, 1.6, 0.4), Vec3::splat(5.0));
    stage.scene
}

#[test]
fn weights_sum_to_one_so_even_light_stays_even() {
    with_gpu(|gpu| {
        // Six lights: more than one image of visibilities holds.
        let mut scene = closed(Vec3::splat(0.5));
        let mut stage = Stage { scene: std::mem::take(&mut scene) };
        for i in 0..5 {
            stage.point(vec3(0.3 * i as f32 - 0.6, -0.2, 0.1 * i as f32), Vec3::new(1.0, 0.2 * i as f32, 0.5));
        }
        let scene = stage.scene;
        let stored = baked(gpu, &scene, &Baking { samples: 1500, rays: 64, examples: 60, ..small() });
        let eye = view(vec3(0.9, 0.8, 0.9), vec3(-0.5, -0.6, -0.4), 80.0, [48, 36]);
        let mut all = Vec::new();
        for spread in WAYS {
            // The narrowest splats leave holes, which are filled, too.
            for splat in [0.3, 0.6, 1.0] {
                let mut settings = by(spread);
                settings.prt.splat = splat;
                // Every sample sees every light.
                settings.prt.bias = 1.0;
                let shown = picture(gpu, &scene, &stored, &eye, &settings);
                assert!(shown.layer("shadow").iter().all(|share| (share - 1.0).abs() < 1e-3), "{spread:?} {splat}");
                all.push(shown);
            }
        }
        for shown in &all[1..] {
            let off = apart(shown.layer("direct"), all[0].layer("direct"));
            assert!(off < 1e-3, "{off}");
        }
    });
}

#[test]
fn three_ways_show_the_same_room_and_splats_have_the_same_bits_again() {
    with_gpu(|gpu| {
        let scene = divided(0.1);
        let stored = baked(gpu, &scene, &Baking { samples: 4000, cluster: 500, ..small() });
        let eye = view(vec3(1.6, 1.9, 1.2), vec3(-0.6, 0.7, -0.6), 75.0, [64, 48]);
        let [gather, splats, vertices] = WAYS.map(|spread| picture(gpu, &scene, &stored, &eye, &by(spread)));
        for (name, most) in [("indirect", 0.02), ("direct", 0.03)] {
            for other in [&splats, &vertices] {
                let off = apart(other.layer(name), gather.layer(name));
                // Ways that do nothing would not differ.
                assert!(off > 1e-5 && off < most, "{name}: {off}");
            }
        }
        assert!(splats.number("splats") > 1000.0 && vertices.number("vertices") > 5000.0);
        let again = picture(gpu, &scene, &stored, &eye, &by(Spread::Splats));
        assert_eq!(again.layers.layers, splats.layers.layers);
    });
}

#[test]
fn far_away_a_splat_stands_for_many_samples() {
    with_gpu(|gpu| {
        let scene = divided(1.0);
        let stored = baked(gpu, &scene, &small());
        let sized = |away: f32, least: f32| {
            let eye = view(vec3(1.6, 1.9, 1.2) * away, vec3(-0.6, 0.7, -0.6), 60.0 / away, [64, 48]);
            let mut settings = by(Spread::Splats);
            settings.prt.splat_pixels = least;
            picture(gpu, &scene, &stored, &eye, &settings)
        };
        let (fine, coarse) = (sized(8.0, 0.0), sized(8.0, 8.0));
        let [many, few] = [&fine, &coarse].map(|shown| shown.number("splats"));
        let off = ["direct", "indirect"].map(|name| apart(coarse.layer(name), fine.layer(name)));
        assert!(few < 0.25 * many, "{few} of {many}");
        assert!(off.into_iter().all(|off| off < 0.1), "{off:?}");
        // Near samples have splats of their own.
        assert_eq!(sized(1.0, 0.5).number("splats"), sized(1.0, 0.0).number("splats"));
    });
}

#[test]
fn splats_of_a_cut_have_the_area_of_all_samples_at_any_size() {
    with_gpu(|gpu| {
        let scene = divided(1.0);
        let stored = baked(gpu, &scene, &Baking { rays: 16, examples: 16, directions: 16, ..small() });
        let tree = Tree::new(&stored.samples, &stored.plan.clusters, stored.plan.radius);
        let count = stored.samples.len();
        let whole: f64 = stored.samples.iter().map(|sample| f64::from(sample.area)).sum();
        // 59 m² of walls, floor and ceiling, and five sides of the block.
        assert!((whole / (59.0 + 2.0 * (0.6 + 0.8) + 0.6 * 0.8) - 1.0).abs() < 0.02, "{whole}");
        // Sides are along the axes, so each one faces one of two opposite views along a diagonal. Both see all of the room.
        let middle = vec3(0.0, 1.25, 0.0);
        let eyes = [20.0, -20.0].map(|away| flat_view(middle + away * Vec3::ONE, middle, 12.0, [64, 48]));
        let mut before = usize::MAX;
        for least in [0.0, 0.1, 0.5, 1.0, 2.0, 4.0, 16.0, 64.0] {
            let cut: Vec<u32> = eyes.iter().flat_map(|eye| tree.cut(eye, least, 1.8)).collect();
            let splats = || cut.iter().map(|number| &tree.splats[*number as usize]);
            let members = splats().flat_map(|s| &tree.members[s.first as usize..(s.first + s.count) as usize]);
            let mut members: Vec<u32> = members.copied().collect();
            let area: f64 = members.iter().map(|member| f64::from(stored.samples[*member as usize].area)).sum();
            assert!((area / whole - 1.0).abs() < 1e-9, "{least}: {area} of {whole}");
            // The area is that of all samples because each one is there, once.
            members.sort_unstable();
            assert!(members.into_iter().eq(0..count as u32), "{least}");
            // Discs are as large as those that they stand for.
            let discs: f64 = splats().map(|splat| f64::from(splat.spacing).powi(2)).sum();
            let wanted = count as f64 * f64::from(stored.plan.radius).powi(2);
            assert!((discs / wanted - 1.0).abs() < 1e-4, "{least}: {discs} {wanted}");
            assert!(cut.len() <= before && (least > 0.0 || cut.len() == count), "{least}: {}", cut.len());
            before = cut.len();
        }
        assert!(before < count / 5, "{before} of {count}");
    });
}

#[test]
fn two_eyes_see_what_each_sees_alone_and_share_the_light() {
    with_gpu(|gpu| {
        let scene = divided(0.5);
        let stored = baked(gpu, &scene, &Baking { samples: 1500, rays: 64, examples: 60, ..small() });
        // The far plane of the camera is its own, so that depths have the same bits in all views.
        let projection = Projection::Perspective { yfov: 1.2, aspect: None, znear: 0.01, zfar: Some(10.0) };
        let world = Mat4::from_translation(vec3(-0.2, 1.3, 1.3)) * Mat4::from_rotation_y(-0.3);
        let [width, height] = [40, 32];
        let camera = Camera { name: String::new(), projection };
        let view = View::new(&camera, world, [width, height]);
        let mut ways = vec![by(Spread::Gather), by(Spread::Splats), by(Spread::Vertices), by(Spread::Gather)];
        ways[3].prt.direct = Direct::Maps;
        for mut settings in ways {
            let singles = [-0.1, 0.1].map(|way| {
                let there = Mat4::from_translation(way * world.x_axis.truncate()) * world;
                let expected = View::new(&camera, there, [width, height]);
                let eye = view.beside(way);
                let off = eye.position.distance(expected.position);
                assert!(off < 1e-6 && eye.view_from_world.abs_diff_eq(expected.view_from_world, 1e-6));
                picture(gpu, &scene, &stored, &eye, &settings)
            });
            settings.prt.eyes = 0.2;
            let both = picture(gpu, &scene, &stored, &view, &settings);
            assert_eq!([both.layers.width, both.layers.height], [2 * width, height]);
            assert!(singles[0].layers.layers[0].data != singles[1].layers.layers[0].data);
            for (index, layer) in both.layers.layers.iter().enumerate() {
                let of = layer.channels.len();
                for (i, values) in layer.data.chunks_exact(of).enumerate() {
                    let (x, y) = (i % (2 * width as usize), i / (2 * width as usize));
                    let (eye, x) = (x / width as usize, x % width as usize);
                    let alone = &singles[eye].layers.layers[index];
                    let at = (y * width as usize + x) * of;
                    assert_eq!(values, &alone.data[at..at + of], "{} at {x} {y} of eye {eye}", layer.name);
                }
            }
            // One pass over the surfaces where the device can, and the same pixels as by two.
            settings.prt.multiview = false;
            let apart = picture(gpu, &scene, &stored, &view, &settings);
            assert_eq!(apart.layers, both.layers);
            let surfaces =
                |passes: &str| passes.split_whitespace().filter(|word| word.starts_with("passes.gbuffer.")).count();
            let views = if gpu.caps().multiview { 2 } else { 1 };
            assert!(surfaces(&both.passes) > 0);
            assert_eq!(surfaces(&apart.passes), views * surfaces(&both.passes));
            let count = |passes: &str, of: &str| passes.split_whitespace().filter(|word| *word == of).count();
            let of = |name: &str| count(&both.passes, name);
            let lit = if settings.prt.direct == Direct::Maps { "prt.lit_by_maps" } else { "prt.lit" };
            assert_eq!((of(lit), of(&format!("{lit}#2")), of("prt.pixels"), of("prt.pixels#2")), (1, 0, 1, 1));
            let maps = usize::from(settings.prt.direct == Direct::Maps);
            assert_eq!((of("passes.shadow.map0"), of("passes.shadow.map0#2")), (maps, 0));
            assert_eq!(of("prt.at_vertices#2"), 0);
            if settings.prt.spread == Spread::Splats {
                assert_eq!(both.number("splats"), singles[0].number("splats") + singles[1].number("splats"));
            }
        }
    });
}
