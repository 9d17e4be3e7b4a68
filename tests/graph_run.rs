//! Do graphs run as declared? On a device, with synchronisation validation; every value is exact.

use lucerna::{
    gpu::{Gpu, OwnedBuffer, testing::with_gpu},
    graph::*,
    shaders::{test::*, types::*},
};

fn run(gpu: &Gpu, graph: Graph) -> Frame {
    Runner::new(gpu).run(graph).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn buffers_pass_from_compute_to_compute_to_host() {
    with_gpu(|gpu| {
        let mut graph = Graph::new("buffers");
        let (ramp_out, result) = (graph.buffer("ramp", 400), graph.buffer("result", 400));
        graph.compute(ramp::Args { values: ramp_out, push: ramp::Push { count: 100, first: 5, step_size: 3 } }, 100);
        let bias = graph.uniform(&Bias { count: 100, bias: 7 });
        let spec = twice::Spec { factor: 4 };
        graph.compute(twice::Args { values: ramp_out, values_out: result, bias, spec }, 100);
        let token = graph.read_buffer(result);
        let frame = run(gpu, graph);
        let expected: Vec<u32> = (0..100).map(|i| 4 * (5 + 3 * i) + 7).collect();
        assert_eq!(frame.buffer::<u32>(token), expected);
    });
}

#[test]
fn uploads_arrive_and_copies_and_fills_do_what_they_say() {
    with_gpu(|gpu| {
        let mut graph = Graph::new("uploads");
        let given: Vec<u32> = (0..64).map(|i| i * i).collect();
        let up = graph.buffer_from("given", &given);
        let empty = graph.buffer_from::<u32>("empty", &[]);
        let copy = graph.buffer("copy", 512);
        graph.fill(copy, 0xABCD_0123);
        graph.copy_buffer(up.range(128..256), copy.range(256..384));
        let (token, nothing) = (graph.read_buffer(copy), graph.read_buffer(empty));
        let frame = run(gpu, graph);
        let read = frame.buffer::<u32>(token);
        assert!(read[..64].iter().chain(&read[96..]).all(|v| *v == 0xABCD_0123));
        assert_eq!(read[64..96], given[32..]);
        assert!(frame.buffer::<u32>(nothing).is_empty());
    });
}

#[test]
fn imported_buffers_keep_what_graphs_write() {
    with_gpu(|gpu| {
        let owned = OwnedBuffer::with_contents(gpu, "owned", bytemuck::cast_slice(&[1u32, 2, 3, 4])).unwrap();
        let mut runner = Runner::new(gpu);
        for round in 0..2 {
            let mut graph = Graph::new("imports");
            let buffer = graph.import_buffer(&owned);
            assert_eq!(buffer, graph.import_buffer(&owned), "the same handle");
            let out = graph.buffer("out", 16);
            let bias = graph.uniform(&Bias { count: 4, bias: round });
            let spec = twice::Spec::default();
            graph.compute(twice::Args { values: buffer, values_out: out, bias, spec }, 4);
            graph.copy_buffer(out, buffer);
            runner.run(graph).unwrap();
        }
        let now = owned.read().unwrap();
        assert_eq!(bytemuck::pod_collect_to_vec::<u8, u32>(&now), [5, 9, 13, 17]);
    });
}
