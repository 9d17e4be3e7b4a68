//! Are barriers right, and none too many? On plans alone, without a device: the oracle checks each plan, then each plan
//! without one of its barriers.

use lucerna::{
    graph::{testing::every_barrier_matters, *},
    shaders::{test::*, types::*},
};

const SMALL: Extent = Extent::new(16, 12);

fn rgba(graph: &mut Graph, name: &str) -> Image {
    graph.image(name, Format::RGBA32F, SMALL)
}

fn write(graph: &mut Graph, image: Image) {
    graph.compute(pattern::Args { image_out: image, push: pattern::Push { tag: 1.0 } }, SMALL);
}

fn step(graph: &mut Graph, previous: Image, next: Image) {
    graph.compute(advance::Args { previous, next }, SMALL);
}

fn tinted(graph: &mut Graph, targets: Targets) {
    let args = tint::Args { push: tint::Push { color: [1.0; 4] } };
    graph.raster(targets, Raster::new(), args, Draw::fullscreen());
}

fn ramp_into(graph: &mut Graph, values: Buffer) {
    graph.compute(ramp::Args { values, push: ramp::Push { count: 4, first: 0, step_size: 1 } }, 4);
}

fn twice_into(graph: &mut Graph, values: Buffer, values_out: Buffer) {
    let bias = graph.uniform(&Bias { count: 4, bias: 0 });
    graph.compute(twice::Args { values, values_out, bias, spec: twice::Spec::default() }, 4);
}

/// Barriers of pass `pass` on what is named `name`.
fn at<'a>(plan: &'a Plan, pass: usize, name: &str) -> Vec<&'a Barrier> {
    plan.barriers_before(pass).iter().filter(|b| b.name == name).collect()
}

#[test]
fn read_after_write_waits_and_a_second_reader_does_not() {
    let mut graph = Graph::new("raw");
    let [a, b, c] = ["a", "b", "c"].map(|n| rgba(&mut graph, n));
    write(&mut graph, a);
    step(&mut graph, a, b);
    step(&mut graph, a, c);
    let plan = every_barrier_matters(&graph);
    let [barrier] = at(&plan, 1, "a")[..] else { panic!("{:?}", plan.barriers) };
    assert_eq!(barrier.src, Scope { stages: Stages::COMPUTE, access: Access::STORAGE_WRITE });
    assert_eq!(barrier.dst, Scope { stages: Stages::COMPUTE, access: Access::SAMPLED });
    assert_eq!((barrier.from, barrier.to), (Layout::General, Layout::ShaderRead));
    assert!(at(&plan, 2, "a").is_empty(), "reading after reading needs no barrier");
    // All that pass 2 waits for is the memory of `b`, which nobody reads and `c` takes over.
    assert!(plan.barriers_before(2).iter().all(|b| b.name == "c" && b.from == Layout::Undefined));
}

#[test]
fn one_barrier_serves_readers_of_different_stages() {
    let mut graph = Graph::new("stages");
    let a = graph.buffer("a", 64);
    let (color, id) = (rgba(&mut graph, "color"), graph.image("id", Format::RG32U, SMALL));
    let out = graph.buffer("out", 64);
    ramp_into(&mut graph, a);
    twice_into(&mut graph, a, out);
    let targets = Targets::new().color(color, Load::Discard).color(id, Load::Discard);
    let args = mesh::Args { corners: a, push: mesh::Push::default() };
    graph.raster(targets, Raster::new(), args, Draw::vertices(3));
    let plan = every_barrier_matters(&graph);
    assert_eq!(at(&plan, 1, "a")[0].dst.stages, Stages::COMPUTE | Stages::VERTEX);
    assert!(at(&plan, 2, "a").is_empty());
}

#[test]
fn write_after_read_waits_without_making_memory_available() {
    let mut graph = Graph::new("war");
    let (a, b) = (graph.buffer_from("a", &[1u32; 4]), graph.buffer("b", 16));
    twice_into(&mut graph, a, b);
    ramp_into(&mut graph, a);
    let plan = every_barrier_matters(&graph);
    // Pass 0 is the upload.
    let [barrier] = at(&plan, 2, "a")[..] else { panic!("{:?}", plan.barriers) };
    assert_eq!(barrier.src, Scope { stages: Stages::COMPUTE, access: Access::NONE });
    assert_eq!(barrier.dst.access, Access::STORAGE_WRITE);
}

#[test]
fn write_after_write_waits() {
    let mut graph = Graph::new("waw");
    let a = graph.buffer("a", 16);
    graph.fill(a, 0);
    ramp_into(&mut graph, a);
    let plan = every_barrier_matters(&graph);
    let [barrier] = at(&plan, 1, "a")[..] else { panic!("{:?}", plan.barriers) };
    assert_eq!(barrier.src, Scope { stages: Stages::TRANSFER, access: Access::TRANSFER_WRITE });
}

#[test]
fn attachments_are_loaded_stored_tested_and_sampled() {
    let mut graph = Graph::new("attachments");
    let (color, depth, out) =
        (rgba(&mut graph, "color"), graph.image("depth", Format::D32S8, SMALL), rgba(&mut graph, "out"));
    tinted(&mut graph, Targets::new().color(color, Load::Clear([0.0; 4])).depth(depth, Depth::Clear(0.0)));
    tinted(&mut graph, Targets::new().color(color, Load::Keep).depth(depth, Depth::Keep));
    tinted(&mut graph, Targets::new().color(color, Load::Keep).depth(depth, Depth::ReadOnly));
    let push = lookup::Push { reference: 0.5 };
    graph.compute(lookup::Args { depth, shadow: depth.shadow(), image_out: out, push }, SMALL);
    step(&mut graph, color, out);
    let plan = every_barrier_matters(&graph);
    assert_eq!(at(&plan, 1, "depth")[0].dst.access, Access::DEPTH_READ | Access::DEPTH_WRITE);
    assert_eq!(at(&plan, 2, "depth")[0].to, Layout::DepthRead);
    assert_eq!(at(&plan, 3, "depth")[0].to, Layout::ShaderRead);
    assert_eq!(at(&plan, 4, "color")[0].src.access, Access::COLOR_READ.and(Access::WRITES) | Access::COLOR_WRITE);
    assert_eq!(plan.physical[plan.physical_of(Resource::Image(1)).unwrap()].usage, Usage::DEPTH | Usage::SAMPLED);
}

#[test]
fn depth_may_be_tested_and_sampled_by_one_pass() {
    let mut graph = Graph::new("read only");
    let (color, depth) = (rgba(&mut graph, "color"), graph.image("depth", Format::D32F, SMALL));
    tinted(&mut graph, Targets::new().color(color, Load::Discard).depth(depth, Depth::Clear(0.0)));
    let targets = Targets::new().color(color, Load::Keep).depth(depth, Depth::ReadOnly);
    graph.raster(targets, Raster::new(), show::Args { image: depth }, Draw::fullscreen());
    let plan = every_barrier_matters(&graph);
    let [barrier] = at(&plan, 1, "depth")[..] else { panic!("{:?}", plan.barriers) };
    assert_eq!(barrier.dst.access, Access::DEPTH_READ | Access::SAMPLED);
    assert!(
        plan.passes[1].uses.iter().filter(|u| u.resource == Resource::Image(1)).all(|u| u.layout == Layout::DepthRead)
    );
}

#[test]
fn levels_and_layers_have_barriers_of_their_own() {
    let mut graph = Graph::new("ranges");
    let desc = ImageDesc::new(Format::RGBA32F, Extent::square(8)).layers(3).mips(3);
    let array = graph.image_with("array", desc);
    for layer in 0..3 {
        write(&mut graph, array.mip(0).layer(layer));
    }
    graph.mips(array);
    let out = rgba(&mut graph, "out");
    graph.compute(layers::Args { image: array, sum_out: out }, SMALL);
    let plan = every_barrier_matters(&graph);
    let level = |m: u32| Region::image(m..m + 1, 0..3);
    // Level 0 goes from three passes to the first blit as one barrier.
    assert!(at(&plan, 3, "array").iter().any(|b| b.region == level(0) && b.to == Layout::CopyFrom));
    assert!(at(&plan, 4, "array").iter().any(|b| b.region == level(1) && b.from == Layout::CopyTo));
    // At the end, two levels that were read and one that was written come together.
    let last: Vec<_> = at(&plan, 5, "array").iter().map(|b| (b.region.clone(), b.from)).collect();
    assert_eq!(last.len(), 2, "{last:?}");
    assert!(last.contains(&(Region::image(0..2, 0..3), Layout::CopyFrom)));
    assert!(last.contains(&(level(2), Layout::CopyTo)));
}

#[test]
fn parts_of_a_buffer_do_not_wait_for_each_other() {
    let mut graph = Graph::new("parts");
    let (a, out) = (graph.buffer("a", 1024), graph.buffer("out", 16));
    graph.fill(a.range(0..512), 1);
    graph.fill(a.range(512..1024), 2);
    twice_into(&mut graph, a.range(256..272), out);
    let plan = every_barrier_matters(&graph);
    assert!(plan.barriers_before(1).is_empty());
    let [barrier] = at(&plan, 2, "a")[..] else { panic!("{:?}", plan.barriers) };
    assert_eq!(barrier.region, Region::buffer(256..272));
}

#[test]
fn history_and_imports_are_left_as_the_next_frame_expects_them() {
    let mut graph = Graph::new("frames");
    let (previous, next) = graph.history("counter", Format::RGBA32F, SMALL);
    step(&mut graph, previous, next);
    let texture = graph.import_image_described("texture", ImageDesc::new(Format::RGBA32F, SMALL).layers(4).mips(2));
    let out = rgba(&mut graph, "out");
    graph.compute(layers::Args { image: texture, sum_out: out }, SMALL);
    graph.copy(out, texture.mip(0).layer(2));
    let (old, new) = graph.history_buffer("list", 64);
    graph.copy_buffer(old, new);
    let plan = every_barrier_matters(&graph);
    let before = at(&plan, 0, "counter.previous")[0];
    assert_eq!((before.src.stages, before.from), (Stages::ALL, Layout::General));
    let end = plan.barriers_before(plan.passes.len());
    assert!(end.iter().any(|b| b.name == "counter.previous" && b.to == Layout::General && b.dst.stages == Stages::ALL));
    let back: Vec<_> = end.iter().filter(|b| b.name == "texture").collect();
    assert_eq!(back.len(), 1, "only the written part changed its layout");
    assert_eq!((&back[0].region, back[0].to), (&Region::image(0..1, 2..3), Layout::ShaderRead));
}

#[test]
fn memory_is_shared_by_those_that_are_never_in_use_together() {
    let mut graph = Graph::new("aliases");
    let images: Vec<Image> = (0..5).map(|i| rgba(&mut graph, &format!("image {i}"))).collect();
    write(&mut graph, images[0]);
    for pair in images.windows(2) {
        step(&mut graph, pair[0], pair[1]);
    }
    let other = graph.image("other", Format::RGBA32F, Extent::square(7));
    write(&mut graph, other);
    let plan = every_barrier_matters(&graph);
    let shared: Vec<usize> = (0..5).map(|i| plan.physical_of(Resource::Image(i)).unwrap()).collect();
    assert_eq!(shared, [shared[0], shared[1], shared[0], shared[1], shared[0]]);
    assert_ne!(plan.physical_of(Resource::Image(5)).unwrap(), shared[0], "another extent");
    // Image 2 is written into the memory of image 0 after image 0 was read: contents may go, order may not.
    let [barrier] = at(&plan, 2, "image 2")[..] else { panic!("{:?}", plan.barriers) };
    assert_eq!((barrier.from, barrier.src.stages), (Layout::Undefined, Stages::COMPUTE));
}

#[test]
fn readbacks_reach_the_host() {
    let mut graph = Graph::new("host");
    let (image, buffer) = (rgba(&mut graph, "image"), graph.buffer("buffer", 64));
    write(&mut graph, image);
    ramp_into(&mut graph, buffer);
    graph.read_image(image);
    graph.read_buffer(buffer);
    // What is read is what was there at that point.
    write(&mut graph, image);
    let plan = every_barrier_matters(&graph);
    let end = plan.barriers_before(plan.passes.len());
    assert_eq!(end.len(), 2);
    assert!(end.iter().all(|b| b.dst == Scope { stages: Stages::HOST, access: Access::HOST_READ }));
}

#[test]
fn commands_and_indices_are_waited_for_where_they_are_fetched() {
    let mut graph = Graph::new("fetch");
    let (commands, indices, groups) =
        (graph.buffer("commands", 40), graph.buffer("indices", 64), graph.buffer("groups", 12));
    for buffer in [commands, indices, groups] {
        ramp_into(&mut graph, buffer);
    }
    let (color, id) = (rgba(&mut graph, "color"), graph.image("id", Format::RG32U, SMALL));
    let corners = graph.buffer_from("corners", &[0.0f32; 6]);
    let targets = Targets::new().color(color, Load::Discard).color(id, Load::Discard);
    let args = mesh::Args { corners, push: mesh::Push::default() };
    graph.raster(targets, Raster::new(), args, Draw::indexed_indirect(indices, commands, 2));
    let out = graph.buffer("out", 16);
    let bias = graph.uniform(&Bias::default());
    let args = twice::Args { values: indices, values_out: out, bias, spec: twice::Spec::default() };
    graph.compute_indirect(args, groups, 0);
    let plan = every_barrier_matters(&graph);
    let indirect = Scope { stages: Stages::INDIRECT, access: Access::INDIRECT_READ };
    assert_eq!(at(&plan, 4, "commands")[0].dst, indirect);
    assert_eq!(at(&plan, 5, "groups")[0].dst, indirect);
    // Fetched as indices, then read by a shader: one barrier for both.
    let both = Scope { stages: Stages::INDEX | Stages::COMPUTE, access: Access::INDEX_READ | Access::STORAGE_READ };
    assert_eq!(at(&plan, 4, "indices")[0].dst, both);
}

#[test]
fn a_wrong_plan_is_objected_to() {
    let mut graph = Graph::new("mutants");
    let [a, b] = ["a", "b"].map(|n| rgba(&mut graph, n));
    write(&mut graph, a);
    step(&mut graph, a, b);
    graph.read_image(b);
    let plan = every_barrier_matters(&graph);
    let objects = |change: &dyn Fn(&mut Plan)| {
        let mut plan = plan.clone();
        change(&mut plan);
        !oracle::check(&plan).is_empty()
    };
    assert!(!objects(&|_| ()));
    for i in 0..plan.barriers.len() {
        assert!(objects(&|p| p.barriers[i].dst.stages = Stages::INDEX), "{:?}", plan.barriers[i]);
        assert!(objects(&|p| p.barriers[i].dst.access = Access::NONE), "{:?}", plan.barriers[i]);
        assert!(objects(&|p| p.barriers[i].src.stages = Stages::HOST), "{:?}", plan.barriers[i]);
        if !plan.barriers[i].src.access.is_empty() {
            assert!(objects(&|p| p.barriers[i].src.access = Access::NONE), "{:?}", plan.barriers[i]);
        }
        if plan.barriers[i].to != Layout::Buffer {
            assert!(objects(&|p| p.barriers[i].to = Layout::Present), "{:?}", plan.barriers[i]);
        }
        if plan.barriers[i].before < plan.passes.len() {
            assert!(objects(&|p| p.barriers[i].before = plan.passes.len()), "{:?}", plan.barriers[i]);
        }
    }
    assert!(objects(&|p| p.barriers.iter_mut().filter(|b| b.before == 1).for_each(|b| b.from = Layout::Undefined)));
    assert!(objects(&|p| p.physical[0].occupants.push(Resource::Image(1))), "both in one memory");
}

/// The mistakes of a graph that `build` makes: kind, pass and resource of each.
fn mistakes(build: impl FnOnce(&mut Graph)) -> Vec<(MistakeKind, String, String)> {
    let mut graph = Graph::new("mistaken");
    build(&mut graph);
    let found = Plan::new(&graph).map(|_| Vec::new()).unwrap_or_else(|m| m);
    found.into_iter().map(|m| (m.kind, m.pass, m.resource)).collect()
}

fn one(kind: MistakeKind, pass: &str, resource: &str) -> Vec<(MistakeKind, String, String)> {
    vec![(kind, pass.to_owned(), resource.to_owned())]
}

#[test]
fn reading_what_nobody_wrote_is_a_mistake() {
    use MistakeKind::ReadBeforeWrite as Kind;
    let found = mistakes(|g| {
        let [a, b] = ["a", "b"].map(|n| rgba(g, n));
        step(g, a, b);
    });
    assert_eq!(found, one(Kind, "test.advance", "a"));
    let found = mistakes(|g| {
        let image = g.image_with("array", ImageDesc::new(Format::RGBA32F, Extent::square(8)).layers(2).mips(2));
        write(g, image.mip(0).layer(0));
        write(g, image.mip(0).layer(1));
        write(g, image.mip(1).layer(0));
        let out = rgba(g, "out");
        g.compute(layers::Args { image, sum_out: out }, SMALL);
    });
    assert_eq!(found, one(Kind, "test.layers", "array"), "one layer of one level is missing");
    let found = mistakes(|g| {
        let color = rgba(g, "color");
        tinted(g, Targets::new().color(color, Load::Keep));
    });
    assert_eq!(found, one(Kind, "test.tint", "color"));
    let found = mistakes(|g| {
        let (_, next) = g.history("h", Format::RGBA32F, SMALL);
        g.read_image(next);
    });
    assert_eq!(found, one(Kind, "read h", "h"));
    let found = mistakes(|g| {
        let (a, b) = (g.buffer("a", 32), g.buffer("b", 16));
        g.fill(a.range(0..12), 0);
        g.copy_buffer(a.range(0..16), b);
    });
    assert_eq!(found, one(Kind, "copy a", "a"), "four bytes are missing");
}

#[test]
fn reading_and_writing_one_resource_in_one_pass_is_a_mistake() {
    use MistakeKind::Conflict as Kind;
    let found = mistakes(|g| {
        let a = rgba(g, "a");
        write(g, a);
        step(g, a, a);
    });
    assert_eq!(found, one(Kind, "test.advance", "a"));
    let found = mistakes(|g| {
        let a = rgba(g, "a");
        write(g, a);
        g.raster(Targets::new().color(a, Load::Keep), Raster::new(), show::Args { image: a }, Draw::fullscreen());
    });
    assert_eq!(found, one(Kind, "test.show", "a"));
    let found = mistakes(|g| {
        let a = g.buffer_from("a", &[0u32; 16]);
        g.copy_buffer(a.range(0..32), a.range(16..48));
    });
    assert_eq!(found, one(Kind, "copy a", "a"));
    let apart = mistakes(|g| {
        let a = g.buffer_from("a", &[0u32; 16]);
        g.copy_buffer(a.range(0..32), a.range(32..64));
    });
    assert!(apart.is_empty(), "{apart:?}");
}

#[test]
fn last_frames_image_is_only_read() {
    let found = mistakes(|g| {
        let (previous, _) = g.history("h", Format::RGBA32F, SMALL);
        write(g, previous);
    });
    assert_eq!(found, one(MistakeKind::ReadOnly, "test.pattern", "h.previous"));
}

#[test]
fn formats_and_shapes_must_fit() {
    use MistakeKind::{Format as Wrong, Range, Shape};
    let small = |g: &mut Graph, name: &str, format| g.image(name, format, SMALL);
    let found = mistakes(|g| {
        let a = small(g, "a", Format::RGBA8Srgb);
        write(g, a);
    });
    assert_eq!(found[0], one(Wrong, "test.pattern", "a")[0], "storage of sRGB");
    let found = mistakes(|g| {
        let (a, b) = (rgba(g, "a"), g.image("b", Format::RGBA32F, Extent::square(4)));
        tinted(g, Targets::new().color(a, Load::Discard).depth(b, Depth::Clear(0.0)));
    });
    assert_eq!(found.len(), 2, "another extent, and no depth: {found:?}");
    let found = mistakes(|g| {
        let (a, b) = (rgba(g, "a"), small(g, "b", Format::RGBA16F));
        write(g, a);
        g.copy(a, b);
    });
    assert_eq!(found, one(Wrong, "copy a", "b"));
    let found = mistakes(|g| {
        let (a, b) = (rgba(g, "a"), rgba(g, "b"));
        write(g, a);
        step(g, a.shadow(), b);
    });
    assert_eq!(found, one(Wrong, "test.advance", "a"), "comparison of colours");
    let found = mistakes(|g| {
        let a = small(g, "a", Format::RGBA16F);
        write(g, a);
    });
    assert_eq!(found, one(Wrong, "test.pattern", "a"), "the shader says rgba32f");
    let found = mistakes(|g| {
        let (a, b) = (small(g, "a", Format::RGBA32U), rgba(g, "b"));
        g.clear(a, [0.0; 4]);
        step(g, a, b);
    });
    assert_eq!(found, one(Wrong, "test.advance", "a"), "the shader samples floats");
    let found = mistakes(|g| {
        let image = g.image_with("array", ImageDesc::new(Format::RGBA32F, SMALL).layers(2));
        write(g, image);
    });
    assert_eq!(found, one(Shape, "test.pattern", "array"), "two layers as one image");
    let found = mistakes(|g| {
        let image = rgba(g, "a");
        tinted(g, Targets::new().color(image, Load::Discard).stencil(StencilLoad::Keep));
    });
    assert_eq!(found, one(Shape, "test.tint", "-"), "stencil of no depth");
    for layers in [1, 7] {
        let found = mistakes(|g| {
            let image = g.image_with("a", ImageDesc::new(Format::RGBA32F, SMALL).layers(layers));
            tinted(g, Targets::new().color(image, Load::Discard).views());
        });
        assert_eq!(found, one(Shape, "test.tint", "a"), "{layers} layers as views");
    }
    let found = mistakes(|g| {
        let image = rgba(g, "a");
        write(g, image.mip(1));
    });
    assert_eq!(found, one(Range, "test.pattern", "a"));
    let found = mistakes(|g| {
        let image = rgba(g, "a");
        tinted(g, Targets::new().color(image, Load::Discard).color(image, Load::Discard));
    });
    assert!(found.iter().any(|m| m.0 == Shape && m.2 == "-"), "the shader writes one colour: {found:?}");
    let found = mistakes(|g| {
        let (a, b) = (g.buffer_from("a", &[0u8; 64]), g.buffer("b", 16));
        twice_into(g, a.range(4..20), b);
    });
    assert_eq!(found, one(Range, "test.twice", "a"), "not aligned");
    let found = mistakes(|g| {
        let image = g.image_with("a", ImageDesc::new(Format::RGBA32F, SMALL).mips(9));
        write(g, image.mip(0));
    });
    assert_eq!(found, one(Shape, "-", "a"), "more levels than 16 pixels have");
}

#[test]
fn handles_of_another_graph_are_named() {
    let mut other = Graph::new("other");
    let foreign = rgba(&mut other, "x");
    let mut graph = Graph::new("mistaken");
    let b = rgba(&mut graph, "b");
    step(&mut graph, foreign, b);
    let found = Plan::new(&graph).unwrap_err();
    assert_eq!(found[0].kind, MistakeKind::Foreign);
    let text = found[0].to_string();
    assert!(text.contains("`mistaken`") && text.contains("`test.advance`") && text.contains("`other`"), "{text}");
    let panic = std::panic::catch_unwind(|| graph.extent(foreign)).unwrap_err();
    let text = panic.downcast_ref::<String>().unwrap();
    assert!(text.contains("`other`") && text.contains("`mistaken`"), "{text}");
}

#[test]
fn plans_are_listed_as_text() {
    let mut graph = Graph::new("list");
    let [a, b] = ["a", "b"].map(|n| rgba(&mut graph, n));
    graph.scope("first", |g| write(g, a));
    step(&mut graph, a, b);
    let plan = every_barrier_matters(&graph);
    let lines = plan.list_passes();
    let lines: Vec<&str> = lines.lines().collect();
    assert_eq!(lines[0], "  0  first / test.pattern  writes a  (2 barriers)");
    assert_eq!(lines[1], "  1  test.advance  reads a  writes b  (1 barrier)");
    assert_eq!(plan.list_memory().lines().count(), 2);
    assert_eq!(plan.warnings, ["image `b` is written and never read"]);
}
