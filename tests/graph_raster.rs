//! Do raster passes, images, levels, layers and history do what graphs declare? On a device, with synchronisation
//! validation; every value is exact.

use lucerna::{
    gpu::{Gpu, ImageDesc as OwnedDesc, OwnedImage, Region, testing::with_gpu},
    graph::*,
    shaders::{test::*, types::*},
};

const SMALL: Extent = Extent::new(16, 12);

fn run(gpu: &Gpu, graph: Graph) -> Frame {
    Runner::new(gpu).run(graph).unwrap_or_else(|e| panic!("{e}"))
}

/// Left half of clip space, then the top half: two triangles each, counter-clockwise with +Y up.
fn corners() -> Vec<Corner> {
    let quad = |x0: f32, y0: f32, x1: f32, y1: f32| {
        [[x0, y0], [x1, y0], [x1, y1], [x0, y0], [x1, y1], [x0, y1]].map(|at| Corner { at })
    };
    [quad(-1.0, -1.0, 0.0, 1.0), quad(-1.0, 0.0, 1.0, 1.0)].concat()
}

#[test]
fn mrt_depth_stencil_and_the_flip() {
    with_gpu(|gpu| {
        let mut graph = Graph::new("mrt");
        let color = graph.image("color", Format::RGBA32F, SMALL);
        let id = graph.image("id", Format::RG32U, SMALL);
        let depth = graph.image("depth", Format::D32S8, SMALL);
        let corners = graph.buffer_from("corners", &corners());
        // Instance 0 draws the left half at depth 0.25; instance 1 the top half at 0.5, nearer under reversed Z.
        let call = |first_vertex, first_instance| DrawCall { first_vertex, vertices: 6, first_instance, instances: 1 };
        let targets = Targets::new()
            .color(color, Load::Clear([0.0; 4]))
            .color(id, Load::ClearUint([9; 4]))
            .depth(depth, Depth::Clear(0.0))
            .stencil(StencilLoad::Clear(3));
        let state = Raster::new().cull(Cull::Back).stencil(Stencil::write(1));
        let args = mesh::Args { corners, push: mesh::Push { depth_step: 0.25 } };
        graph.raster(targets, state, args, Draw::calls(vec![call(6, 1), call(0, 0)]));
        // A full-screen tint where nothing was drawn: stencil still 3.
        let targets = Targets::new().color(color, Load::Keep).depth(depth, Depth::ReadOnly);
        let state = Raster::new().stencil(Stencil::equals(3)).depth_compare(Compare::Always);
        graph.raster(targets, state, tint::Args { push: tint::Push { color: [0.25; 4] } }, Draw::fullscreen());
        let seen = graph.image("seen", Format::RGBA32F, SMALL);
        let push = lookup::Push { reference: 0.3 };
        graph.compute(lookup::Args { depth, shadow: depth.shadow(), image_out: seen, push }, SMALL);
        let tokens = [color, id, depth, seen].map(|i| graph.read_image(i));
        let frame = run(gpu, graph);
        let [color, id, depth, seen] = tokens.map(|t| frame.image(t));
        for y in 0..12 {
            for x in 0..16 {
                // Row 0 is the top; clip-space +Y is up.
                let (left, top) = (x < 8, y < 6);
                let expected = match (left, top) {
                    (_, true) => ([1.0, 0.5, y as f32 + 0.5, 1.0], [1.0, 7.0], 0.5),
                    (true, false) => ([1.0, 0.0, y as f32 + 0.5, 1.0], [0.0, 7.0], 0.25),
                    (false, false) => ([0.25; 4], [9.0, 9.0], 0.0),
                };
                assert_eq!(color.at(x, y, 0).unwrap(), expected.0, "colour at {x}, {y}");
                assert_eq!(id.at(x, y, 0).unwrap()[..2], expected.1, "id at {x}, {y}");
                assert_eq!(depth.at(x, y, 0).unwrap()[0], expected.2, "depth at {x}, {y}");
                let lit = f32::from(u8::from(0.3 >= expected.2));
                let [plain, compared, ..] = seen.at(x, y, 0).unwrap();
                assert_eq!(plain, expected.2, "sampled depth at {x}, {y}");
                // Filtering mixes at edges of the depth.
                if (1..5).contains(&y) || y > 6 && (1..7).contains(&x) || y > 6 && x > 8 {
                    assert_eq!(compared, lit, "comparison at {x}, {y}");
                }
            }
        }
    });
}

#[test]
fn back_faces_are_culled_and_areas_are_kept_to() {
    with_gpu(|gpu| {
        let mut graph = Graph::new("cull");
        let color = graph.image("color", Format::RGBA32F, SMALL);
        let id = graph.image("id", Format::RG32U, SMALL);
        let corners = graph.buffer_from("corners", &corners());
        let args = mesh::Args { corners, push: mesh::Push::default() };
        let indices = graph.buffer_from("indices", &[0u32, 2, 1, 0, 1, 2]);
        let indexed = |first_index| {
            let call = IndexedCall { first_index, indices: 3, vertex_offset: 0, first_instance: 0, instances: 1 };
            Draw::indexed(indices, vec![call])
        };
        let targets = |load| Targets::new().color(color, load).color(id, Load::Discard);
        let state = Raster::new().cull(Cull::Back);
        graph.raster(targets(Load::Clear([0.5; 4])), state, args, indexed(0));
        let token = graph.read_image(color);
        graph.raster(targets(Load::Keep).area(8, 4, 8, 8), state, args, indexed(3)).named("front");
        let after = graph.read_image(color);
        let frame = run(gpu, graph);
        assert!(frame.image(token).to_f32().iter().all(|p| *p == [0.5; 4]), "a back face was drawn");
        let after = frame.image(after);
        // Corner of the lower left half triangle inside the area: row 11 from column 8 on.
        assert_eq!(after.at(8, 11, 0).unwrap()[3], 1.0);
        assert_eq!(after.at(7, 11, 0).unwrap(), [0.5; 4]);
        assert_eq!(after.at(15, 4, 0).unwrap(), [0.5; 4]);
    });
}

#[test]
fn levels_and_layers_are_apart() {
    with_gpu(|gpu| {
        let mut graph = Graph::new("levels");
        let desc = ImageDesc::new(Format::RGBA32F, Extent::square(8)).layers(3).mips(2);
        let array = graph.image_with("array", desc);
        for layer in 0..3 {
            let push = pattern::Push { tag: layer as f32 };
            graph.compute(pattern::Args { image_out: array.layer(layer).mip(0), push }, Extent::square(8));
        }
        graph.mips(array);
        let sum = graph.image("sum", Format::RGBA32F, Extent::square(4));
        graph.compute(layers::Args { image: array, sum_out: sum }, Extent::square(4));
        let (level, sum) = (graph.read_image(array.mip(1)), graph.read_image(sum));
        let frame = run(gpu, graph);
        let level = frame.image(level);
        assert_eq!((level.extent, level.layers), (Extent::square(4), 3));
        for (layer, y, x) in (0..3).flat_map(|l| (0..4).flat_map(move |y| (0..4).map(move |x| (l, y, x)))) {
            let expected = [2.0 * x as f32 + 0.5, 2.0 * y as f32 + 0.5, layer as f32, 1.0];
            assert_eq!(level.at(x, y, layer).unwrap(), expected);
        }
        let sum = frame.image(sum).at(3, 1, 0).unwrap();
        assert_eq!(sum, [3.0 * (6.0 + 6.5), 3.0 * (2.0 + 2.5), 6.0, 6.0]);
    });
}

#[test]
fn history_counts_frames_and_starts_from_zero_when_the_extent_changes() {
    with_gpu(|gpu| {
        let mut runner = Runner::new(gpu);
        for (frame, extent) in [(0, SMALL), (1, SMALL), (2, SMALL), (3, SMALL), (0, Extent::square(4))] {
            let mut graph = Graph::new("history");
            let (previous, next) = graph.history("counter", Format::RGBA32F, extent);
            graph.compute(advance::Args { previous, next }, extent);
            let token = graph.read_image(next);
            let result = runner.run(graph).unwrap();
            let expected = frame as f32 + 1.0;
            assert!(result.image(token).to_f32().iter().all(|p| *p == [expected; 4]), "frame {frame} at {extent}");
        }
        runner.forget_history();
        let mut graph = Graph::new("history");
        let (previous, next) = graph.history("counter", Format::RGBA32F, Extent::square(4));
        graph.compute(advance::Args { previous, next }, Extent::square(4));
        let token = graph.read_image(next);
        assert_eq!(runner.run(graph).unwrap().image(token).at(0, 0, 0).unwrap(), [1.0; 4]);
    });
}

#[test]
fn aliased_images_do_not_disturb_each_other_and_runs_repeat_bit_by_bit() {
    with_gpu(|gpu| {
        let build = || {
            let mut graph = Graph::new("aliases");
            let mut last = graph.image("step 0", Format::RGBA32F, SMALL);
            graph.compute(pattern::Args { image_out: last, push: pattern::Push { tag: 0.5 } }, SMALL);
            for i in 1..6 {
                let next = graph.image(format!("step {i}"), Format::RGBA32F, SMALL);
                graph.compute(advance::Args { previous: last, next }, SMALL);
                last = next;
            }
            let token = graph.read_image(last);
            (graph, token)
        };
        let (graph, _) = build();
        let plan = Plan::new(&graph).unwrap();
        let images = plan.physical.iter().filter(|p| matches!(p.shape, Shape::Image(_))).count();
        assert_eq!(images, 2, "six images, each needed until the next is written, fit into two");
        let mut runner = Runner::new(gpu);
        let mut first = None;
        for _ in 0..3 {
            let (graph, token) = build();
            let pixels = runner.run(graph).unwrap().image(token);
            assert_eq!(pixels.at(3, 2, 0).unwrap(), [8.0, 7.0, 5.5, 6.0]);
            assert_eq!(*first.get_or_insert_with(|| pixels.bytes.clone()), pixels.bytes);
        }
    });
}

#[test]
fn indirect_commands_written_by_a_pass_launch_another() {
    with_gpu(|gpu| {
        let mut graph = Graph::new("indirect");
        // values: 2, 1, 0 … as group counts; draws of 6 vertices need their own.
        let groups = graph.buffer("groups", 12);
        graph.compute(ramp::Args { values: groups, push: ramp::Push { count: 3, first: 1, step_size: 0 } }, 3);
        let (ramp_in, out) = (graph.buffer("ramp", 1024), graph.buffer("out", 1024));
        graph.compute(ramp::Args { values: ramp_in, push: ramp::Push { count: 256, first: 0, step_size: 1 } }, 256);
        graph.fill(out, 77);
        let bias = graph.uniform(&Bias { count: 256, bias: 0 });
        let args = twice::Args { values: ramp_in, values_out: out, bias, spec: twice::Spec::default() };
        graph.compute_indirect(args, groups, 0);
        // Six vertices, six instances from vertex 6: all of them at the same place.
        let draws = graph.buffer("draws", 16);
        graph.compute(ramp::Args { values: draws, push: ramp::Push { count: 4, first: 6, step_size: 0 } }, 4);
        graph.fill(draws.range(12..16), 0);
        let color = graph.image("color", Format::RGBA32F, SMALL);
        let id = graph.image("id", Format::RG32U, SMALL);
        let corners = graph.buffer_from("corners", &corners());
        let targets = Targets::new().color(color, Load::Clear([0.0; 4])).color(id, Load::ClearUint([9; 4]));
        let args = mesh::Args { corners, push: mesh::Push::default() };
        graph.raster(targets, Raster::new(), args, Draw::indirect(draws, 1));
        let (out, id) = (graph.read_buffer(out), graph.read_image(id));
        let frame = run(gpu, graph);
        let out = frame.buffer::<u32>(out);
        // One group of 64 threads.
        assert!(out[..64].iter().enumerate().all(|(i, v)| *v == 2 * i as u32));
        assert!(out[64..].iter().all(|v| *v == 77));
        let id = frame.image(id);
        assert_eq!(id.at(2, 2, 0).unwrap()[..2], [5.0, 7.0], "the last of six instances");
        assert_eq!(id.at(2, 9, 0).unwrap()[..2], [9.0, 9.0]);
    });
}

#[test]
fn copies_clears_and_imported_images() {
    with_gpu(|gpu| {
        let desc = OwnedDesc::new(Format::RGBA8.to_vk(), 4, 4).mips(2);
        let bytes: Vec<u8> = (0..64).collect();
        let owned = OwnedImage::with_contents(
            gpu,
            "texture",
            desc,
            &[Region { mip: 0, layer: 0, bytes: &bytes }, Region { mip: 1, layer: 0, bytes: &bytes[..16] }],
        )
        .unwrap();
        let mut runner = Runner::new(gpu);
        for _ in 0..2 {
            let mut graph = Graph::new("copies");
            let texture = graph.import_image(&owned);
            let copy = graph.image_with("copy", graph.desc(texture));
            graph.copy(texture, copy);
            let cleared = graph.image("cleared", Format::R32U, SMALL);
            graph.clear(cleared, [5.0, 0.0, 0.0, 0.0]);
            let tokens = [graph.read_image(copy.mip(0)), graph.read_image(copy.mip(1)), graph.read_image(cleared)];
            let frame = runner.run(graph).unwrap();
            let [a, b, c] = tokens.map(|t| frame.image(t));
            assert_eq!(a.bytes, bytes);
            assert_eq!(b.bytes, bytes[..16]);
            assert!(c.to_f32().iter().all(|p| p[0] == 5.0));
        }
    });
}

#[test]
fn an_image_that_was_never_written_can_be_imported_and_written() {
    with_gpu(|gpu| {
        use ash::vk::ImageUsageFlags as U;
        let desc = OwnedDesc::new(Format::RGBA32F.to_vk(), 16, 12).mips(3).also(U::STORAGE);
        let owned = OwnedImage::new(gpu, "target", desc).unwrap();
        let mut runner = Runner::new(gpu);
        let mut graph = Graph::new("first");
        let image = graph.import_image(&owned);
        graph.compute(pattern::Args { image_out: image.mip(0), push: pattern::Push { tag: 3.0 } }, SMALL);
        runner.run(graph).unwrap();
        let mut graph = Graph::new("second");
        let image = graph.import_image(&owned);
        let token = graph.read_image(image.mip(0));
        assert_eq!(runner.run(graph).unwrap().image(token).at(15, 11, 0).unwrap(), [15.0, 11.0, 3.0, 1.0]);
    });
}

#[test]
fn every_pass_has_a_time_and_a_name() {
    with_gpu(|gpu| {
        let mut graph = Graph::new("times");
        let image = graph.image("image", Format::RGBA32F, Extent::square(256));
        let args = pattern::Args { image_out: image, push: pattern::Push { tag: 0.0 } };
        graph.scope("outer", |graph| {
            graph.compute(args, Extent::square(256));
            graph.scope("inner", |graph| graph.compute(args, Extent::square(256)).named("again").name().to_owned());
        });
        graph.compute(args, Extent::square(256));
        let frame = run(gpu, graph);
        let names: Vec<&str> = frame.report.passes.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ["test.pattern", "again", "test.pattern#2"]);
        assert_eq!(frame.report.passes[1].scope, ["outer", "inner"]);
        assert!(frame.report.passes.iter().all(|p| p.gpu_ms.is_some_and(|ms| (0.0..10_000.0).contains(&ms))));
        assert!(frame.report.passes.iter().any(|p| p.gpu_ms > Some(0.0)), "no clock ticks");
        assert!(!frame.report.device.is_empty());
    });
}

#[test]
fn mistakes_are_errors_that_name_pass_and_resource() {
    with_gpu(|gpu| {
        let mut graph = Graph::new("wrong");
        let (a, b) = (graph.image("a", Format::RGBA32F, SMALL), graph.image("b", Format::RGBA32F, SMALL));
        graph.compute(advance::Args { previous: a, next: b }, SMALL).named("too early");
        let error = Runner::new(gpu).run(graph).unwrap_err().to_string();
        assert!(error.contains("pass `too early`, resource `a`"), "{error}");
    });
}

#[test]
fn any_image_can_be_looked_at_by_name() {
    with_gpu(|gpu| {
        let mut graph = Graph::new("tap");
        let [a, b] = ["scene.a", "scene.normal"].map(|n| graph.image(n, Format::RGBA32F, SMALL));
        let half = graph.image_with("half", ImageDesc::new(Format::RGBA32F, SMALL).layers(2));
        let depth = graph.image("depth", Format::D32F, SMALL);
        graph.clear(a, [2.0; 4]);
        graph.clear(b, [-1.0, 0.0, 1.0, 1.0]);
        graph.clear(half.layer(0), [1.0; 4]);
        graph.clear(depth, [0.125, 0.0, 0.0, 0.0]);
        assert_eq!(graph.image_names(), ["scene.a", "scene.normal", "depth"], "`half` has a layer without contents");
        let error = graph.view("scene.b").unwrap_err().to_string();
        assert!(error.contains("`scene.b`") && error.contains("scene.normal"), "{error}");
        let view = graph.view("scene.normal").unwrap();
        let dump = graph.dump();
        // Reads are of that point: this clear comes later.
        graph.clear(a, [0.0; 4]);
        let frame = run(gpu, graph);
        assert_eq!(frame.image(view).picture()[0], [0.0, 0.5, 1.0, 1.0]);
        let names: Vec<&str> = dump.iter().map(|(n, _)| n.as_str()).collect();
        assert_eq!(names, ["scene.a", "scene.normal", "depth"]);
        assert_eq!(frame.image(dump[0].1).picture()[0], [2.0; 4]);
        let depth = frame.image(dump[2].1);
        assert_eq!((depth.to_f32()[5][0], depth.picture()[5]), (0.125, [1.0; 4]));
        let table = frame.report.to_string();
        assert!(table.contains("clear scene.a#2") && table.contains("barriers"), "{table}");
    });
}

#[test]
fn volumes_and_cubes_are_seen_in_their_shapes() {
    with_gpu(|gpu| {
        let mut graph = Graph::new("shapes");
        let volume = graph.image_with("volume", ImageDesc::volume(Format::RGBA32F, Extent::new(4, 6), 8));
        graph.compute(slices::Args { volume_out: volume }, [4, 6, 8]);
        let sky = graph.image_with("sky", ImageDesc::cube(Format::RGBA32F, 8));
        for face in 0..6 {
            let push = pattern::Push { tag: face as f32 };
            graph.compute(pattern::Args { image_out: sky.layer(face), push }, Extent::square(8));
        }
        let seen = graph.buffer("seen", 7 * 16);
        graph.compute(shapes::Args { volume, sky, seen }, 1);
        let (seen, volume) = (graph.read_buffer(seen), graph.read_image(volume));
        let frame = run(gpu, graph);
        let volume = frame.image(volume);
        assert_eq!((volume.layers, volume.at(3, 5, 7)), (8, Some([3.0, 5.0, 7.0, 1.0])));
        let seen = frame.buffer::<[f32; 4]>(seen);
        assert_eq!(seen[0], [1.5, 2.5, 3.5, 1.0], "the middle of the volume");
        for (face, value) in seen[1..].iter().enumerate() {
            // Faces in the order +X, -X, +Y, -Y, +Z, -Z.
            assert_eq!(*value, [3.5, 3.5, face as f32, 1.0]);
        }
    });
}

#[test]
fn depth_is_tested_and_sampled_by_one_pass() {
    with_gpu(|gpu| {
        let mut graph = Graph::new("read only");
        let (color, depth) = (graph.image("color", Format::RGBA32F, SMALL), graph.image("depth", Format::D32S8, SMALL));
        let (other, id) = (graph.image("other", Format::RGBA32F, SMALL), graph.image("id", Format::RG32U, SMALL));
        let corners = graph.buffer_from("corners", &corners());
        // The left half at depth 0.25.
        let targets =
            Targets::new().color(other, Load::Discard).color(id, Load::Discard).depth(depth, Depth::Clear(0.0));
        let args = mesh::Args { corners, push: mesh::Push::default() };
        graph.raster(targets, Raster::new(), args, Draw::vertices(6));
        // At depth 0.125, in front of what is empty; its colour is the depth it samples.
        let targets = Targets::new().color(color, Load::Clear([9.0; 4])).depth(depth, Depth::ReadOnly);
        let args = show::Args { image: depth.nearest() };
        graph.raster(targets, Raster::new(), args, Draw::fullscreen_at(0.125));
        let (color, depth) = (graph.read_image(color), graph.read_image(depth));
        let frame = run(gpu, graph);
        let (color, depth) = (frame.image(color), frame.image(depth));
        for x in 0..16 {
            let (seen, stored) = if x < 8 { (9.0, 0.25) } else { (0.0, 0.0) };
            assert_eq!(color.at(x, 5, 0).unwrap()[0], seen, "column {x}");
            assert_eq!(depth.at(x, 5, 0).unwrap()[0], stored, "column {x}: nothing was written");
        }
    });
}

#[test]
fn indexed_draws_come_from_buffers_that_passes_wrote() {
    with_gpu(|gpu| {
        let mut graph = Graph::new("indexed");
        let (color, id) = (graph.image("color", Format::RGBA32F, SMALL), graph.image("id", Format::RG32U, SMALL));
        let corners = graph.buffer_from("corners", &corners());
        let indices = graph.buffer("indices", 24);
        graph.compute(ramp::Args { values: indices, push: ramp::Push { count: 6, first: 0, step_size: 1 } }, 6);
        // Two draws: instance 3 on the left half, instance 4 (vertices from 6 on) on the top half.
        let commands = graph.buffer_from("commands", &[6u32, 1, 0, 0, 3, 6, 1, 0, 6, 4]);
        let targets = Targets::new().color(color, Load::Clear([0.0; 4])).color(id, Load::ClearUint([9; 4]));
        let args = mesh::Args { corners, push: mesh::Push::default() };
        graph.raster(targets, Raster::new(), args, Draw::indexed_indirect(indices, commands, 2));
        let id = graph.read_image(id);
        let frame = run(gpu, graph);
        let id = frame.image(id);
        let at = |x, y| id.at(x, y, 0).unwrap()[0];
        assert_eq!([at(2, 9), at(12, 2), at(2, 2), at(12, 9)], [3.0, 4.0, 4.0, 9.0]);
    });
}
