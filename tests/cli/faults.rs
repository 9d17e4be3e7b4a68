//! The executables when the device fails in the middle: the documented exit code, a message that says where, and no part of a
//! picture left behind. (The layer that injects the faults: `tests/fault-layer`.)

use std::process::Command;

use crate::fault::{Case, have_device};

/// A small picture of a small scene, in two formats, in the case's folder.
fn render(rule: &str) -> Case {
    let case = Case::of(Command::new(env!("CARGO_BIN_EXE_isr")));
    let (png, exr) = (case.path("picture.png"), case.path("picture.exr"));
    case.args(["render", "--builtin", "cornell", "--size", "48x32", "-o"])
        .args([png])
        .args(["-o"])
        .args([exr])
        .layer(&[("VKFAULT", rule)])
}

fn pictures(case: &Case) -> Vec<String> {
    let names = std::fs::read_dir(case.folder.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    names.filter(|name| name.contains("picture")).collect()
}

#[test]
fn without_a_fault_there_are_pictures() {
    if have_device() {
        let mut case = render("");
        case.run_here().succeeds();
        assert_eq!(pictures(&case).len(), 2);
    }
}

#[test]
fn each_fault_has_its_exit_code_and_names_its_place() {
    if have_device() {
        for (rule, code, parts) in [
            (
                "vkEnumeratePhysicalDevices@1+=INIT_FAILED",
                4,
                ["no Vulkan driver could list its devices", "mesa-vulkan-drivers"],
            ),
            ("vkCreateDevice=INIT_FAILED", 4, ["vkCreateDevice for ", "--device"]),
            ("vkAllocateMemory@1+=OOM_DEVICE", 5, ["no memory for `scene.", "Use a smaller image"]),
            ("vkCreateBuffer@3=OOM_HOST", 5, ["host memory ran out in vkCreateBuffer for `", "Use a smaller image"]),
            ("vkCreateComputePipelines=OOM_DEVICE", 5, ["isr.passes.", "vkCreateComputePipelines for shader `passes."]),
            ("vkCreateGraphicsPipelines=UNKNOWN", 1, ["isr.passes.", "vkCreateGraphicsPipelines for shader `passes."]),
            ("vkQueueSubmit2=DEVICE_LOST", 6, ["the device was lost in vkQueueSubmit2 of `", "choose another device"]),
            (
                "vkWaitForFences=DEVICE_LOST",
                6,
                ["the device was lost in vkWaitForFences for `", "choose another device"],
            ),
        ] {
            let mut case = render(rule);
            case.run_here().fails_with(code, &parts);
            assert_eq!(pictures(&case), [""; 0], "after {rule}");
        }
    }
}

#[test]
fn a_wait_that_never_ends_is_exit_code_6() {
    if have_device() {
        let mut case = render("vkWaitForFences@3+=TIMEOUT").env("LUCERNA_WAIT_LIMIT", "2");
        case.run_here().fails_with(6, &["the device did not finish `", "within "]);
        assert_eq!(pictures(&case), [""; 0]);
    }
}

#[test]
fn every_submission_and_wait_may_fail() {
    if have_device() {
        for (function, fault, code) in [
            ("vkQueueSubmit2", "DEVICE_LOST", 6),
            ("vkWaitForFences", "DEVICE_LOST", 6),
            ("vkEndCommandBuffer", "OOM_HOST", 5),
            ("vkCreateComputePipelines", "OOM_HOST", 5),
        ] {
            for n in 1..200 {
                let mut case = render(&format!("{function}@{n}+={fault}"));
                let outcome = case.run_here();
                if case.fired().is_empty() {
                    outcome.succeeds();
                    assert!(n > 3, "{function} was hardly called");
                    break;
                }
                outcome.fails_with(code, &[function]);
                assert_eq!(pictures(&case), [""; 0], "after call {n} of {function}");
            }
        }
    }
}
