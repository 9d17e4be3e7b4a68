//! Acceleration structures in the graph: what a ray query finds after builds and refits, and that no barrier is too many.

use std::sync::Arc;

use glam::{Mat4, Vec3};
use lucerna::{
    ErrorKind,
    gpu::{
        AccelLayout, AccelLevel, BottomDesc, BufferDesc, GpuOptions, OwnedAccel, OwnedBuffer, RayQuery,
        testing::{with_gpu_options, with_ray_query},
    },
    graph::{
        Accel, BottomBuild, Buffer, Graph, MistakeKind, Plan, Runner, TopInstance, testing::every_barrier_matters,
    },
    shaders::{
        test::ray_query,
        types::{QueryHit, QueryRay},
    },
};

/// A unit square in z = 0, front to +z: one triangle below the diagonal, one above.
const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
const INDICES: [u32; 6] = [0, 1, 2, 0, 2, 3];

fn ray(x: f32, y: f32) -> QueryRay {
    QueryRay { origin: [x, y, 5.0], t_max: 100.0, direction: [0.0, 0.0, -1.0], mask: 0xff }
}

fn trace(graph: &mut Graph, accel: Accel, rays: &[QueryRay]) -> lucerna::graph::BufferRead {
    let count = rays.len() as u32;
    let rays = graph.buffer_from("rays", rays);
    let hits = graph.buffer("hits", u64::from(count) * size_of::<QueryHit>() as u64);
    graph.compute(ray_query::Args { top: accel, rays, hits, push: ray_query::Push { count } }, count);
    graph.read_buffer(hits)
}

fn build(positions: Buffer, indices: Buffer, refit: bool) -> BottomBuild {
    BottomBuild { bottom: 0, positions, first_vertex: 0, indices, first_index: 0, refit }
}

#[test]
fn queries_see_instances_sides_and_masks() {
    with_ray_query(|gpu| {
        let square = BottomDesc { triangles: 2, vertices: 4, deforms: false };
        let accel = OwnedAccel::new(gpu, "squares", &[square], 3).unwrap();
        let mirrored = Mat4::from_translation(Vec3::new(3.0, 0.0, 1.0)) * Mat4::from_scale(Vec3::new(-1.0, 2.0, 1.0));
        let instances = [
            TopInstance::new(accel.address(0), &Mat4::IDENTITY, 7, 1),
            // From x = 2 to 3, at z = 1, twice as high; mirrored, so its front looks the same way.
            TopInstance::new(accel.address(0), &mirrored, 8, 2),
            TopInstance::new(accel.address(0), &Mat4::from_translation(Vec3::new(5.0, 0.0, 0.0)), 1 << 23, 4),
        ];
        let mut runner = Runner::new(gpu);
        for frame in 0..2 {
            let mut graph = Graph::new("squares");
            let handle = graph.import_accel(&accel);
            assert_eq!(handle, graph.import_accel(&accel));
            if frame == 0 {
                let positions = graph.buffer_from("positions", &SQUARE);
                let indices = graph.buffer_from("indices", &INDICES);
                graph.build_bottoms(handle, &[build(positions, indices, false)]);
                graph.build_top(handle, &instances);
            }
            let mut rays = vec![ray(0.75, 0.25), ray(2.75, 1.5), ray(5.25, 0.75), ray(1.5, 0.5), ray(0.75, 0.25)];
            rays[4].mask = 2 | 4;
            rays.push(QueryRay { origin: [0.75, 0.25, -1.0], direction: [0.0, 0.0, 2.0], ..ray(0.0, 0.0) });
            let token = trace(&mut graph, handle, &rays);
            let hits: Vec<QueryHit> = runner.run(&graph).unwrap().buffer(token);
            let found: Vec<_> = hits.iter().map(|h| (h.t, h.instance, h.triangle, h.front)).collect();
            assert_eq!(
                found,
                [
                    (5.0, 7, 0, 1),
                    // The mirror turns the winding as seen, the object's own winding counts.
                    (4.0, 8, 1, 1),
                    (5.0, 1 << 23, 1, 1),
                    (-1.0, 0, 0, 0),
                    (-1.0, 0, 0, 0),
                    (0.5, 7, 0, 0)
                ],
                "frame {frame}"
            );
            assert!((hits[0].barycentrics[0] - 0.5).abs() < 1e-6 && (hits[0].barycentrics[1] - 0.25).abs() < 1e-6);
        }
    });
}

#[test]
fn refits_and_rebuilds_follow_moving_vertices_and_instances() {
    with_ray_query(|gpu| {
        let moving = BottomDesc { triangles: 2, vertices: 4, deforms: true };
        let still = BottomDesc { deforms: false, ..moving };
        let accel = OwnedAccel::new(gpu, "moving", &[moving, still], 2).unwrap();
        let mut runner = Runner::new(gpu);
        for frame in 0..6 {
            let z = frame as f32 * 0.5;
            let mut graph = Graph::new("moving");
            let handle = graph.import_accel(&accel);
            let moved = SQUARE.map(|[x, y, _]| [x + 2.0 * z, y, z]);
            let positions = graph.buffer_from("positions", &moved);
            let indices = graph.buffer_from("indices", &INDICES);
            let mut builds = vec![build(positions, indices, frame % 3 != 0)];
            if frame == 0 {
                builds.push(BottomBuild { bottom: 1, ..build(positions, indices, false) });
            }
            graph.build_bottoms(handle, &builds);
            let up = Mat4::from_translation(Vec3::new(0.0, 2.0 + z, 0.0));
            let instances = [
                TopInstance::new(accel.address(0), &Mat4::IDENTITY, 0, 1),
                TopInstance::new(accel.address(1), &up, 1, 1),
            ];
            graph.build_top(handle, &instances);
            if frame > 0 {
                // The still one was built by an earlier frame.
                every_barrier_matters(&graph);
            }
            let rays = [ray(0.25 + 2.0 * z, 0.5), ray(0.25, 2.5 + z), ray(0.25 + 2.0 * z, -0.5)];
            let token = trace(&mut graph, handle, &rays);
            every_barrier_matters(&graph);
            let hits: Vec<QueryHit> = runner.run(&graph).unwrap().buffer(token);
            let found: Vec<_> = hits.iter().map(|h| (h.t, h.instance, h.triangle)).collect();
            assert_eq!(found, [(5.0 - z, 0, 1), (5.0, 1, 1), (-1.0, 0, 0)], "frame {frame}");
        }
    });
}

#[test]
fn nothing_to_trace_is_hit_by_nothing() {
    with_ray_query(|gpu| {
        let accel = OwnedAccel::new(gpu, "nothing", &[], 0).unwrap();
        let mut graph = Graph::new("nothing");
        let handle = graph.import_accel(&accel);
        graph.build_top(handle, &[]);
        let token = trace(&mut graph, handle, &[ray(0.0, 0.0)]);
        let hits: Vec<QueryHit> = Runner::new(gpu).run(&graph).unwrap().buffer(token);
        assert_eq!(hits[0].t, -1.0);
    });
}

#[test]
fn switched_off_there_are_no_structures_and_no_pipelines() {
    with_gpu_options(GpuOptions { ray_query: RayQuery::Off, ..GpuOptions::default() }, |gpu| {
        assert!(!gpu.caps().ray_query);
        let error = OwnedAccel::new(gpu, "none", &[], 1).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Runtime);
        assert!(error.to_string().contains("`none` needs ray queries"), "{error}");
        let error = gpu.compute_pipeline(&ray_query::SHADER, &[]).unwrap_err();
        assert!(error.to_string().contains("`test.ray_query` traces by ray query, which is not on"), "{error}");
        let buffer = OwnedBuffer::with_contents(gpu, "vertices", &[0; 64]).unwrap();
        // Shaders read the scene by address all the same.
        assert!(buffer.address().is_some());
        let upload = OwnedBuffer::new(gpu, "upload", BufferDesc::upload(64)).unwrap();
        assert_eq!((upload.address(), upload.address_words()), (None, [0, 0]));
    });
}

/// Two bottom levels, one of which deforms; no device.
fn layout() -> Arc<AccelLayout> {
    let level = |from: u64, to: u64| AccelLevel { range: from..to, build_scratch: 1000, refit_scratch: 100 };
    let bottom = |deforms, from, to| (BottomDesc { triangles: 2, vertices: 4, deforms }, level(from, to));
    Arc::new(AccelLayout {
        bytes: 1024,
        bottoms: vec![bottom(false, 0, 256), bottom(true, 256, 512)],
        top: level(512, 1024),
        instances: 2,
        scratch_alignment: 128,
    })
}

#[test]
fn plans_order_builds_refits_and_rays() {
    let mut graph = Graph::new("plan");
    let accel = graph.import_accel_described("scene", &layout(), false);
    let positions = graph.buffer("positions", 48);
    graph.fill(positions, 0);
    let indices = graph.buffer_from("indices", &INDICES);
    let build = |bottom, refit| BottomBuild { bottom, ..build(positions, indices, refit) };
    graph.build_bottoms(accel, &[build(0, false), build(1, false)]);
    graph.build_top(accel, &[TopInstance::new(1, &Mat4::IDENTITY, 0, 1)]);
    trace(&mut graph, accel, &[ray(0.0, 0.0)]);
    graph.fill(positions, 1).named("move");
    graph.build_bottoms(accel, &[build(1, true)]);
    graph.build_top(accel, &[TopInstance::new(1, &Mat4::IDENTITY, 0, 1)]);
    trace(&mut graph, accel, &[ray(0.0, 0.0)]);
    let plan = every_barrier_matters(&graph);
    let list = plan.list_passes();
    for line in
        ["build scene bottoms  reads positions, indices", "refit scene bottoms  reads scene", "build scene top#2"]
    {
        assert!(list.contains(line), "{line}\nnot in\n{list}");
    }
    // The bottom level that stays as it is waits for no refit: no barrier on it after the first rays.
    let first = plan.passes.iter().position(|p| p.name == "move").unwrap();
    let touched = plan.barriers.iter().any(|b| b.before >= first && b.name == "scene" && b.region.a.0 < 256);
    assert!(!touched, "{:#?}", plan.barriers);
}

#[test]
fn mistakes_are_named() {
    let kinds = |declare: &dyn Fn(&mut Graph, Accel, Buffer, Buffer)| {
        let mut graph = Graph::new("mistakes");
        let accel = graph.import_accel_described("scene", &layout(), true);
        let positions = graph.import_buffer_described("positions", 48);
        let indices = graph.import_buffer_described("indices", 24);
        declare(&mut graph, accel, positions, indices);
        let mistakes = Plan::new(&graph).err().unwrap_or_default();
        mistakes.iter().map(|m| (m.kind, m.resource.clone())).collect::<Vec<_>>()
    };
    let scene = || "scene".to_owned();
    assert_eq!(kinds(&|g, a, p, i| g.build_bottoms(a, &[build(p, i, true)])), [(MistakeKind::ReadOnly, scene())]);
    assert_eq!(
        kinds(&|g, a, p, i| g.build_bottoms(a, &[BottomBuild { bottom: 9, ..build(p, i, false) }])),
        [(MistakeKind::Range, scene())]
    );
    assert_eq!(
        kinds(
            &|g, a, p, i| g.build_bottoms(a, &[BottomBuild { first_vertex: 1, first_index: 3, ..build(p, i, false) }])
        ),
        [(MistakeKind::Range, "positions".to_owned()), (MistakeKind::Range, "indices".to_owned())]
    );
    let three = [TopInstance::new(1, &Mat4::IDENTITY, 0, 1); 3];
    assert_eq!(kinds(&|g, a, _, _| g.build_top(a, &three)), [(MistakeKind::Range, scene())]);
    assert_eq!(
        kinds(&|g, _, _, _| {
            trace(g, Accel::NONE, &[ray(0.0, 0.0)]);
        }),
        [(MistakeKind::Shape, "top".to_owned())]
    );
    let twice = kinds(&|g, a, p, i| g.build_bottoms(a, &[build(p, i, false); 2]));
    assert_eq!(twice, [(MistakeKind::Conflict, scene())]);

    let mut graph = Graph::new("unbuilt");
    let accel = graph.import_accel_described("scene", &layout(), false);
    trace(&mut graph, accel, &[ray(0.0, 0.0)]);
    let mistakes = Plan::new(&graph).unwrap_err();
    assert_eq!(mistakes[0].kind, MistakeKind::ReadBeforeWrite);
}
