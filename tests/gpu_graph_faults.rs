//! What goes wrong while a render graph runs becomes an error that names graph and pass.

use std::sync::Arc;

use gpu_common::fault::{self, Case, each, every_call, have_device, options};
use lucerna::{
    Error, Result,
    gpu::Gpu,
    graph::{Extent, Format, Frame, Graph, Runner, Targets},
    shaders::{test::*, types::Bias},
};

mod gpu_common;

fn child(task: &str) -> Result<()> {
    let (task, argument) = task.split_once(':').unwrap_or((task, ""));
    match task {
        "frames" => {
            let gpu = Gpu::new(options()?)?;
            let log = Arc::clone(gpu.log());
            let result = frames(&gpu);
            drop(gpu);
            let said: Vec<String> = log.unexpected().iter().map(ToString::to_string).collect();
            assert!(said.is_empty(), "{said:#?}\nafter {result:?}");
            result
        }
        "each" => {
            every_call(argument, frames);
            Ok(())
        }
        other => Err(Error::usage(format!("no task {other}"))),
    }
}

/// Three frames of compute, raster, history, upload and read-back, checked.
fn frames(gpu: &Gpu) -> Result<()> {
    let mut runner = Runner::new(gpu);
    for number in 0..3_u32 {
        let extent = Extent { width: 17, height: 9 };
        let mut graph = Graph::new("frame");
        let given = graph.buffer_from("given", &[number; 64]);
        let out = graph.buffer("out", 256);
        let bias = graph.uniform(&Bias { count: 64, bias: 1 });
        graph.compute(twice::Args { values: given, values_out: out, bias, spec: twice::Spec::default() }, 64);
        let (previous, next) = graph.history("count", Format::RGBA32F, extent);
        graph.compute(advance::Args { previous, next }, extent);
        let picture = graph.image("picture", Format::RGBA32F, extent);
        let push = tint::Push { color: [number as f32; 4] };
        graph.raster(
            Targets::new().color(picture, lucerna::graph::Load::Discard),
            Default::default(),
            tint::Args { push },
            lucerna::graph::Draw::fullscreen(),
        );
        let tokens = (graph.read_buffer(out), graph.read_image(next), graph.read_image(picture));
        let frame: Frame = runner.run(graph)?;
        assert!(frame.buffer::<u32>(tokens.0).iter().all(|v| *v == 2 * number + 1));
        assert!(frame.image(tokens.1).to_f32().iter().all(|v| v[0] == number as f32 + 1.0));
        assert!(frame.image(tokens.2).to_f32().iter().all(|v| *v == [number as f32; 4]));
    }
    Ok(())
}

/// Children come here; for others it does nothing.
#[test]
fn child_process() {
    fault::child_process(child);
}

#[test]
fn without_a_fault_it_works() {
    if have_device() {
        Case::new("frames").layer(&[]).run().succeeds();
    }
}

#[test]
fn errors_name_graph_and_pass() {
    if have_device() {
        for (rule, code, parts) in [
            ("vkCreateComputePipelines@2=UNKNOWN", 1, ["frame.test.advance: ", "vkCreateComputePipelines"]),
            ("vkCreateGraphicsPipelines=OOM_DEVICE", 5, ["frame.test.tint: ", "vkCreateGraphicsPipelines"]),
            ("vkCreateShaderModule@2=OOM_HOST", 5, ["frame.test.advance: ", "vkCreateShaderModule"]),
            ("vkAllocateMemory@1+=OOM_DEVICE", 5, ["frame: no memory for `", "Use a smaller image"]),
            ("vkQueueSubmit2@2=DEVICE_LOST", 6, ["frame: ", "vkQueueSubmit2 of `frame`, passes `"]),
            ("vkWaitForFences@2=DEVICE_LOST", 6, ["frame: ", "vkWaitForFences for `frame`, "]),
        ] {
            Case::new("frames").layer(&[("VKFAULT", rule)]).run().fails_with(code, &parts);
        }
    }
}

#[test]
fn a_wait_that_never_ends_names_the_pass() {
    if have_device() {
        let case = Case::new("frames").layer(&[("VKFAULT", "vkWaitForFences@2+=TIMEOUT")]);
        let outcome = case.env("LUCERNA_WAIT_LIMIT", "2").run();
        outcome.fails_with(6, &["frame: the device did not finish `frame` within ", "pass `"]);
    }
}

/// Threads of a CPU driver still work on the frame while the process ends: it must end with its own exit code.
#[test]
fn the_exit_code_survives_a_loss_in_the_middle_of_work() {
    if have_device() {
        for _ in 0..20 {
            let outcome = Case::new("frames").layer(&[("VKFAULT", "vkWaitForFences@2+=DEVICE_LOST")]).run();
            assert_eq!(outcome.code, Some(6), "{outcome:#?}");
        }
    }
}

#[test]
fn every_call_may_fail() {
    each(&[
        "vkAllocateMemory OOM_DEVICE",
        "vkCreateBuffer OOM_DEVICE",
        "vkCreateImage OOM_DEVICE",
        "vkCreateImageView OOM_HOST",
        "vkCreateComputePipelines OOM_HOST",
        "vkCreateGraphicsPipelines OOM_HOST",
        "vkAllocateDescriptorSets UNKNOWN",
        "vkCreateQueryPool OOM_HOST",
        "vkEndCommandBuffer OOM_HOST",
        "vkQueueSubmit2 DEVICE_LOST",
        "vkWaitForFences DEVICE_LOST",
        "vkGetQueryPoolResults DEVICE_LOST",
    ]);
}
