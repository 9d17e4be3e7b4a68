//! `isr render` from the outside: every exit code, the same bytes twice, nothing half written. Needs a device (each test says
//! so when there is none).

use std::{
    fs,
    path::Path,
    process::Stdio,
    time::{Duration, Instant},
};

use crate::support::{command, device, files, isr, lucerna, ran};
use lucerna::{image, scene::Limits};

const SMALL: [&str; 6] = ["render", "--builtin", "cornell", "--size", "48x40", "-q"];

fn with<'a>(more: &[&'a str]) -> Vec<&'a str> {
    SMALL.iter().copied().chain(more.iter().copied()).collect()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn path(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).to_str().unwrap().to_owned()
}

#[test]
fn wrong_usage_is_exit_code_2() {
    isr::<&str>([]).expect(2, &["Usage: isr"]);
    isr(["render"]).expect(2, &["--builtin"]);
    isr(["render", "--builtin", "cornel"]).expect(2, &["cornell"]);
    for (arguments, part) in [
        (&["--size", "0x5"][..], "WIDTHxHEIGHT"),
        (&["--size", "many"], "WIDTHxHEIGHT"),
        (&["--frames", "5..2"], "A..B"),
        (&["--time", "nan"], "finite"),
        (&["--fps", "0"], "above zero"),
        (&["--camera", "frnt"], "did you mean 'front'"),
        (&["--camera", "99"], "0 'front'"),
        (&["-D", "sampels=24"], "did you mean 'isr.samples'"),
        (&["-D", "samples=many"], "u32"),
        (&["-D", "samples=47"], "24, 48, 80"),
        (&["-D", "samples"], "key=value"),
        (&["--mode", "all"], "occlusion"),
        (&["-o", "x.tga"], ".exr"),
        (&["-o", "x"], ".exr"),
        (&["-o", "{what}.png"], "{frame:04}"),
        (&["-o", "x.png", "--frames", "0..3"], "{frame:04}"),
        (&["--progress", "loud"], "plain"),
    ] {
        let ran = isr(with(arguments)).expect(2, &[part]);
        assert!(ran.stdout.is_empty(), "{arguments:?}: {}", ran.stdout);
    }
    isr(["render", "--help"]).expect(0, &[]);
}

#[test]
fn unreadable_input_is_exit_code_3() {
    isr(["render", "no/such.glb", "-o", "x.png"]).expect(3, &["no/such.glb"]);
    isr(with(&["--settings", "no/such.toml"])).expect(3, &["no/such.toml"]);
    isr(with(&["--camera", "no/such.toml"])).expect(3, &["no/such.toml"]);
    isr(with(&["--environment", "no/such.hdr"])).expect(3, &["no/such.hdr"]);
    let folder = folder();
    let settings = path(&folder, "s.toml");
    fs::write(&settings, "[isr]\nsampels = 24\n").unwrap();
    isr(with(&["--settings", &settings])).expect(3, &["s.toml", "did you mean 'isr.samples'"]);
    fs::write(&settings, "[isr\n").unwrap();
    isr(with(&["--settings", &settings])).expect(3, &["s.toml"]);
}

#[test]
fn no_device_is_exit_code_4_and_leaves_nothing() {
    let folder = folder();
    let mut none = command(env!("CARGO_BIN_EXE_isr"));
    none.args(with(&["-o", &path(&folder, "x.png")]));
    none.env("VK_DRIVER_FILES", "/nowhere.json").env("VK_ICD_FILENAMES", "/nowhere.json");
    ran(&mut none).expect(4, &["driver"]);
    assert!(files(folder.path()).is_empty());
    isr(with(&["-o", &path(&folder, "x.png"), "--device", "no such device"])).expect(4, &["no such device"]);
    assert!(files(folder.path()).is_empty());
}

#[test]
fn settings_are_printed_and_read_back() {
    let folder = folder();
    // Defaults < preset < file < -D.
    let preset = isr(["render", "--print-config", "--preset", "best", "-D", "layers=2"]).expect(0, &[]).stdout;
    assert!(
        preset.contains("samples = 80") && preset.contains("cameras = 3") && preset.contains("layers = 2"),
        "{preset}"
    );
    isr(["render", "--print-config", "--preset", "bets"]).expect(2, &["fast, balanced, best"]);
    isr(["render", "--print-config", "--preset", "best", "--paper"]).expect(2, &["cannot be used with"]);
    let printed = isr(["render", "--print-config", "--paper", "-D", "samples=80"]).expect(0, &[]).stdout;
    assert!(printed.contains("samples = 80") && printed.contains("sender = \"albedo\""), "{printed}");
    let settings = path(&folder, "s.toml");
    fs::write(&settings, &printed).unwrap();
    let over = isr(["render", "--print-config", "--preset", "fast", "--settings", &settings]).expect(0, &[]).stdout;
    assert!(over.contains("samples = 80"), "{over}");
    let again = isr(["render", "--print-config", "--settings", &settings]).expect(0, &[]).stdout;
    assert_eq!(again, printed);
    // -D wins over the file, which wins over the defaults.
    let third =
        isr(["render", "--print-config", "--settings", &settings, "-D", "isr.samples=24"]).expect(0, &[]).stdout;
    assert_eq!(third, printed.replace("samples = 80", "samples = 24"));
}

#[test]
fn the_same_command_twice_gives_the_same_bytes_and_rerun_agrees() {
    if !device() {
        return;
    }
    let folder = folder();
    for ending in ["exr", "png", "hdr"] {
        let (a, b) = (path(&folder, &format!("a.{ending}")), path(&folder, &format!("b.{ending}")));
        for name in [&a, &b] {
            isr(with(&["-o", name, "-D", "samples=24", "--camera", "1", "--exposure", "0.5"])).expect(0, &[]);
        }
        assert!(fs::read(&a).unwrap() == fs::read(&b).unwrap(), "two runs gave different .{ending} files");
        let report = lucerna(["rerun", "--json", "-q", &a]).expect(0, &[]).json();
        assert_eq!(report["same_file"], true, "{report}");
        assert_eq!(report["metadata"], serde_json::json!([]), "{report}");
        let metadata = image::metadata(Path::new(&a)).unwrap();
        assert!(metadata.shader_compiler.starts_with("shaderc"), "{metadata:?}");
    }
    // Another picture under the same name must be noticed.
    let a = path(&folder, "a.exr");
    let mut layers = image::read(&a, &Limits::default()).unwrap();
    layers.layers[0].data[100] += 0.25;
    image::write(Path::new(&a), &layers, &image::WriteOptions { overwrite: true, ..Default::default() }).unwrap();
    let report = lucerna(["rerun", "--json", "-q", &a]).expect(7, &["a.exr"]).json();
    assert_eq!((&report["different"], &report["same_pixels"]), (&1.into(), &false.into()));
    lucerna(["rerun", "-q", &a, "--tolerance", "0.3"]).expect(0, &[]);
    lucerna(["rerun", "-q", &a, "--tolerance", "0.2"]).expect(7, &[]);
}

#[test]
fn an_exr_holds_all_layers_with_their_meaning() {
    if !device() {
        return;
    }
    let folder = folder();
    let name = path(&folder, "a.exr");
    let json = isr(with(&["-o", &name, "--json"])).expect(0, &[]).json();
    assert_eq!(json["complete"], true);
    assert_eq!(json["frames"][0]["files"], serde_json::json!([name]));
    assert!(json["median_ms"].as_f64() > Some(0.0) && json["phases_ms"]["upload"].is_number());
    let layers = image::read(&name, &Limits::default()).unwrap();
    assert_eq!((layers.width, layers.height), (48, 40));
    let values = |name: &str| layers.layer(name).unwrap_or_else(|| panic!("no layer {name:?}")).data.clone();
    let picture = layers.main().unwrap().rgb_pixels().unwrap();
    let count = 48 * 40;
    let (direct, indirect, normal, depth) = (values("direct"), values("indirect"), values("normal"), values("depth"));
    let (occlusion, albedo) = (values("occlusion"), values("albedo"));
    assert_eq!((occlusion.len(), depth.len(), normal.len()), (count, count, count * 3));
    let mut surfaces = 0;
    for i in (0..count).filter(|&i| depth[i] < 1e9) {
        surfaces += 1;
        // The front camera stands 0.8 m before a box 0.56 m deep.
        assert!((0.7..1.5).contains(&depth[i]), "depth {}", depth[i]);
        let n = &normal[i * 3..i * 3 + 3];
        let length = n.iter().map(|x| x * x).sum::<f32>().sqrt();
        assert!((length - 1.0).abs() < 0.02, "normal {n:?}");
        assert!((0.0..=1.0).contains(&occlusion[i]) && (0.0..=1.0).contains(&albedo[i * 3]));
        for c in 0..3 {
            // Default settings: what is seen is direct plus indirect light. Half floats keep three digits.
            let sum = direct[i * 3 + c] + indirect[i * 3 + c];
            assert!((picture[i][c] - sum).abs() <= 2e-3 * sum.max(0.05), "pixel {i}: {} is not {sum}", picture[i][c]);
        }
    }
    assert!(surfaces > count / 2);
    assert!(indirect.iter().sum::<f32>() > 0.0 && direct.iter().sum::<f32>() > indirect.iter().sum::<f32>());
}

#[test]
fn frames_and_layers_get_their_own_files() {
    if !device() {
        return;
    }
    let folder = folder();
    let ran =
        isr(with(&["-o", &path(&folder, "{scene}.{frame:03}.{layer}.pfm"), "--frames", "2..4", "--progress", "plain"]));
    let ran = ran.expect(0, &[]);
    let names = files(folder.path());
    assert!(names.contains(&"cornell.002.picture.pfm".to_owned()), "{names:?}");
    assert!(names.contains(&"cornell.003.depth.pfm".to_owned()), "{names:?}");
    assert_eq!(names.len() % 2, 0);
    assert_eq!(ran.stderr.lines().filter(|line| line.starts_with("frame ")).count(), 2, "{}", ran.stderr);
}

#[test]
fn nothing_is_overwritten_unasked_and_missing_folders_are_made() {
    if !device() {
        return;
    }
    let folder = folder();
    let name = path(&folder, "a.png");
    fs::write(&name, "precious").unwrap();
    isr(with(&["-o", &name])).expect(1, &["a.png", "exists"]);
    assert_eq!(fs::read_to_string(&name).unwrap(), "precious");
    isr(with(&["-o", &name, "--overwrite"])).expect(0, &[]);
    assert!(fs::read(&name).unwrap().starts_with(b"\x89PNG"));
    isr(with(&["-o", &path(&folder, "a.png/under/b.png")])).expect(1, &["a.png/under"]);
    isr(with(&["-o", &path(&folder, "b.png"), "--timings", &path(&folder, "a.png/t.csv")])).expect(1, &["t.csv"]);
    assert_eq!(files(folder.path()), ["a.png"]);
    let (csv, dumped) = (path(&folder, "times/t.csv"), path(&folder, "all/images"));
    isr(with(&["-o", &path(&folder, "new/folder/a.png"), "--timings", &csv, "--dump", &dumped])).expect(0, &[]);
    assert!(fs::exists(path(&folder, "new/folder/a.png")).unwrap() && fs::exists(&csv).unwrap());
    assert!(!files(Path::new(&dumped)).is_empty());
}

#[test]
fn the_timings_name_every_pass() {
    if !device() {
        return;
    }
    let folder = folder();
    let csv = path(&folder, "t.csv");
    let name = path(&folder, "{frame}.png");
    let json = isr(with(&["-o", &name, "--frames", "0..2", "--timings", &csv, "--repeat", "3", "--json"]))
        .expect(0, &[])
        .json();
    assert_eq!(json["frames"][1]["runs"].as_array().unwrap().len(), 3);
    let text = fs::read_to_string(&csv).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("frame,scope,pass,gpu_ms,cpu_ms"));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    for frame in ["0", "1"] {
        for pass in ["passes.gbuffer", "isr.gather"] {
            assert!(
                rows.iter().any(|row| row[0] == frame && row[2].starts_with(pass)),
                "{pass} of frame {frame}: {text}"
            );
        }
    }
    assert!(rows.iter().all(|row| row.len() == 5 && row[4].parse::<f64>().is_ok()), "{text}");
}

#[test]
fn every_image_of_the_graph_can_be_looked_at() {
    if !device() {
        return;
    }
    let folder = folder();
    let listed = isr(with(&["--list-passes", "-o", "no/such/folder/x.png"])).expect(0, &[]).stdout;
    assert!(listed.contains("isr.gather") && listed.contains("reads") && listed.contains("writes"), "{listed}");
    isr(with(&["--view", "gbufer.depth", "-o", &path(&folder, "x.png")])).expect(2, &["--view", "gbuffer.depth"]);
    isr(with(&["--view", "gbuffer.depth", "-o", &path(&folder, "z.exr")])).expect(0, &[]);
    let view = image::read(path(&folder, "z.exr"), &Limits::default()).unwrap();
    let raw = &view.layer("raw").unwrap().data;
    assert!(raw.len() == 48 * 40 && raw.iter().all(|z| (0.0..=1.0).contains(z)) && raw.iter().any(|z| *z < 0.99));
    let under = path(&folder, "z.exr/all");
    isr(with(&["--dump", &under, "-o", &path(&folder, "y.png")])).expect(1, &["z.exr/all", "cannot be made"]);
    let dumped = folder.path().join("dump");
    isr(with(&["--dump", dumped.to_str().unwrap(), "-o", &path(&folder, "y.png")])).expect(0, &[]);
    let names = files(&dumped);
    for image in ["gbuffer.depth", "gbuffer.normal", "isr.gathered"] {
        assert!(names.contains(&format!("0000-{image}.exr")), "{names:?}");
    }
    assert_eq!(image::read(dumped.join("0000-isr.gathered.exr"), &Limits::default()).unwrap().width, 24);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_exit_code_1_and_leaves_nothing() {
    if !device() {
        return;
    }
    let folder = folder();
    for name in ["x.png", "x.exr"] {
        std::os::unix::fs::symlink("/dev/full", folder.path().join(name)).unwrap();
        isr(with(&["-o", &path(&folder, name)])).expect(1, &[name, "No space left"]);
    }
    assert_eq!(files(folder.path()), ["x.exr", "x.png"]);
    let full = || Stdio::from(fs::File::options().write(true).open("/dev/full").unwrap());
    let mut json = command(env!("CARGO_BIN_EXE_isr"));
    json.args(with(&["-o", &path(&folder, "y.png"), "--json"])).stdout(full()).stderr(Stdio::null());
    assert_eq!(json.status().unwrap().code(), Some(1));
}

/// A disk that is full in the middle of the file.
#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_fills_up_keeps_no_half_file() {
    if !device() {
        return;
    }
    let folder = folder();
    let script = "mount -t tmpfs -o size=64k tmpfs \"$0\" || exit 99; \"$@\"; code=$?; ls -A \"$0\"; exit $code";
    let root = command("id").arg("-u").output().is_ok_and(|id| id.stdout == b"0\n");
    let mut limited = command("unshare");
    limited.args(if root { &["-m"][..] } else { &["-Urm"] }).args(["sh", "-c", script]).arg(folder.path());
    limited.arg(env!("CARGO_BIN_EXE_isr")).args(["render", "--builtin", "cornell", "--size", "400x300", "-q"]);
    let Ok(output) = limited.args(["-o", &path(&folder, "big.exr")]).output() else {
        eprintln!("SKIPPED: there is no unshare");
        return;
    };
    let said = String::from_utf8_lossy(&output.stderr);
    if output.status.code() == Some(99) || said.contains("unshare") {
        eprintln!("SKIPPED: no file system can be mounted here: {said}");
        return;
    }
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("big.exr") && said.contains("No space left"), "{said}");
    assert_eq!(String::from_utf8_lossy(&output.stdout), "", "something was left behind");
}

/// Starts a long run, waits until it has written `after` files, sends a signal, and returns its exit code and the files.
#[cfg(unix)]
fn interrupted(signal: &str, after: usize) -> (Option<i32>, Vec<String>, tempfile::TempDir) {
    let folder = folder();
    let mut long = command(env!("CARGO_BIN_EXE_isr"));
    long.args(["render", "--builtin", "cornell", "--size", "160x120", "-q", "--frames", "0..100000"]);
    let mut child =
        long.args(["-o", &path(&folder, "{frame}.exr")]).stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
    let begun = Instant::now();
    let count = || files(folder.path()).iter().filter(|name| name.ends_with(".exr")).count();
    while count() < after && begun.elapsed() < Duration::from_secs(240) {
        assert!(child.try_wait().unwrap().is_none(), "the run ended by itself");
        std::thread::sleep(Duration::from_millis(5));
    }
    let kill = command("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let code = child.wait().unwrap().code();
    (code, files(folder.path()), folder)
}

#[cfg(unix)]
#[test]
fn interrupted_runs_leave_only_whole_files() {
    if !device() {
        return;
    }
    for (signal, expected) in [("-INT", Some(8)), ("-TERM", Some(8)), ("-KILL", None)] {
        let (code, names, folder) = interrupted(signal, 3);
        assert_eq!(code, expected, "{signal}");
        let written: Vec<&String> = names.iter().filter(|name| name.ends_with(".exr")).collect();
        assert!(written.len() >= 3);
        for name in written {
            let layers = image::read(folder.path().join(name), &Limits::default()).unwrap();
            assert_eq!((layers.width, layers.height), (160, 120), "{name}");
        }
        // Only a kill can leave a temporary file, under a name that no one takes for a picture.
        let rest: Vec<&String> = names.iter().filter(|name| !name.ends_with(".exr")).collect();
        assert!(rest.iter().all(|name| signal == "-KILL" && name.starts_with(".lucerna-")), "{signal}: {rest:?}");
    }
}

#[cfg(unix)]
#[test]
fn interrupted_before_the_first_picture_is_exit_code_130_or_143() {
    if !device() {
        return;
    }
    for (signal, expected) in [("-INT", 130), ("-TERM", 143)] {
        let folder = folder();
        let mut slow = command(env!("CARGO_BIN_EXE_isr"));
        slow.args(["render", "--builtin", "cornell", "--size", "2048x2048", "--frames", "0..100"]);
        slow.args(["-o", &path(&folder, "{frame}.png"), "--progress", "none"]).stdout(Stdio::null());
        let mut child = slow.stderr(Stdio::piped()).spawn().unwrap();
        // The line about the device comes after the handlers are installed and before the first frame.
        let mut said = std::io::BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        while !line.contains("Vulkan") {
            line.clear();
            assert!(std::io::BufRead::read_line(&mut said, &mut line).unwrap() > 0, "the run ended by itself");
        }
        assert!(command("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(expected), "{signal}");
        assert!(files(folder.path()).is_empty());
    }
}
