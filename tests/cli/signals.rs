//! What is asked to stop answers at once and ends soon, wherever it is, with nothing half written.
#![cfg(unix)]

mod support;

use std::{
    fs,
    io::{BufRead, BufReader, Read},
    path::Path,
    process::{Child, ChildStderr, Command, Stdio},
    time::{Duration, Instant},
};

use lucerna::image::{self, Layers, WriteOptions};
use support::{command, device, files, ran};

/// Programs end within two seconds. This bound finds those that never end: a machine that does much else besides makes them slow, too.
const BOUND: Duration = Duration::from_secs(40);
/// The answer.
const WORD: &str = "stopping; complete output is kept";

/// A program that works.
struct Running {
    child: Child,
    said: BufReader<ChildStderr>,
}

impl Running {
    /// Starts it and waits until it says `event`.
    fn until(command: &mut Command, event: &str) -> Self {
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let mut running = Self { said: BufReader::new(child.stderr.take().unwrap()), child };
        running.hears(event);
        running
    }

    fn hears(&mut self, event: &str) {
        let mut line = String::new();
        while !line.contains(event) {
            line.clear();
            assert!(self.said.read_line(&mut line).unwrap() > 0, "it ended before it said '{event}'");
        }
    }

    fn signal(&self, signal: &str) {
        assert!(command("kill").args([signal, &self.child.id().to_string()]).status().unwrap().success());
    }

    /// Its exit code; it ended within [`BOUND`] of now.
    fn ends(mut self, about: &str) -> Option<i32> {
        let begun = Instant::now();
        let code = loop {
            match self.child.try_wait().unwrap() {
                Some(status) => break status.code(),
                None if begun.elapsed() > BOUND => {
                    self.child.kill().unwrap();
                    self.child.wait().unwrap();
                    panic!("{about}: it goes on after {BOUND:?}");
                }
                None => std::thread::sleep(Duration::from_millis(5)),
            }
        };
        eprintln!("{about}: ended {:.2} s after the signal with {code:?}", begun.elapsed().as_secs_f64());
        let mut rest = String::new();
        self.said.read_to_string(&mut rest).unwrap();
        assert!(!rest.contains("error:") && !rest.contains("panicked"), "{about}: {rest}");
        code
    }

    /// Asks it to stop, `after` the event; it says that it heard, and ends.
    fn stopped(mut self, after: Duration, about: &str) -> Option<i32> {
        std::thread::sleep(after);
        assert!(self.child.try_wait().unwrap().is_none(), "{about}: it ended by itself");
        self.signal("-INT");
        let begun = Instant::now();
        self.hears(WORD);
        let answered = begun.elapsed();
        eprintln!("{about}: answered after {:.3} s", answered.as_secs_f64());
        assert!(answered < BOUND / 2, "{about}: it answered after {answered:?}");
        self.ends(about)
    }
}

/// Light over three decades.
fn picture(folder: &Path, width: u32, height: u32) -> String {
    let light = |i: u32| 10f32.powf((i % 997) as f32 / 300.0 + (i / width % 31) as f32 / 60.0);
    let path = folder.join("light.exr");
    let data = (0..width * height).flat_map(|i| [light(i); 3]).collect();
    image::write(&path, &Layers::rgb(width, height, data), &WriteOptions::default()).unwrap();
    path.display().to_string()
}

#[test]
fn one_long_dispatch_does_not_keep_a_program() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let input = picture(folder.path(), 1500, 1000);
    let output = folder.path().join("out.png").display().to_string();
    let mut long = command(env!("CARGO_BIN_EXE_tonemap"));
    long.args([&input, "-o", &output, "--operator", "ashikhmin", "--local", "literal"]);
    let running = Running::until(&mut long, "Vulkan");
    assert_eq!(running.stopped(Duration::from_secs(2), "tonemap literal"), Some(130));
    assert_eq!(files(folder.path()), ["light.exr"]);
}

#[test]
fn vectors_that_were_computed_are_kept() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let (out, environment) = (at("a.fiv"), picture(folder.path(), 64, 32));
    let mut long = command(env!("CARGO_BIN_EXE_fiv"));
    long.args(["precompute", "--builtin", "furnace-sphere", "--env", &environment, "-o", &out, "--progress", "plain"]);
    long.args(["-D", "fiv.azimuths=256", "-D", "fiv.polars=129", "-D", "fiv.radii=64", "-D", "fiv.size=16"]);
    let running = Running::until(&mut long, "samples of");
    // Before the first unit there is nothing to be kept; the next start goes on wherever this one was.
    let code = running.stopped(Duration::from_secs(3), "fiv precompute");
    assert!(code == Some(8) || code == Some(130), "{code:?}");
    let names = files(folder.path());
    assert!(names.iter().all(|name| ["a.fiv.parts", "light.exr"].contains(&name.as_str())), "{names:?}");
    let parts = folder.path().join("a.fiv.parts");
    let kept = parts.exists() && files(&parts).iter().any(|name| name.ends_with(".unit"));
    assert_eq!(code == Some(8), kept);
}

#[test]
fn a_huge_picture_is_left_wherever_it_is() {
    if !device() {
        return;
    }
    for (seconds, signals) in [(0.1, 1), (3.0, 1), (1.0, 2)] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out.exr").display().to_string();
        let mut long = command(env!("CARGO_BIN_EXE_isr"));
        long.args(["render", "--builtin", "cornell", "--size", "3000x3000", "-o", &out]);
        let running = Running::until(&mut long, "Vulkan");
        let about = format!("isr 3000x3000 after {seconds} s");
        let code = match signals {
            1 => running.stopped(Duration::from_secs_f64(seconds), &about),
            _ => {
                std::thread::sleep(Duration::from_secs_f64(seconds));
                running.signal("-INT");
                running.signal("-INT");
                running.ends("two signals")
            }
        };
        assert_eq!(code, Some(130), "{about}");
        assert!(files(folder.path()).is_empty(), "{about}");
    }
}

/// Writing is where half files come from.
#[test]
fn what_is_being_written_is_not_left_behind() {
    let folder = tempfile::tempdir().unwrap();
    let input = picture(folder.path(), 3000, 2000);
    if !device() {
        return;
    }
    for round in 0..6 {
        let out = tempfile::tempdir().unwrap();
        let names = ["a.exr", "b.pfm", "c.png", "d.exr"].map(|name| out.path().join(name).display().to_string());
        let mut long = command(env!("CARGO_BIN_EXE_tonemap"));
        long.args([input.as_str(), "--f32"]).args(names.iter().flat_map(|name| ["-o", name]));
        let running = Running::until(&mut long, "Vulkan");
        // The first file, or the temporary one before it.
        while files(out.path()).is_empty() {
            std::thread::sleep(Duration::from_millis(1));
        }
        running.signal("-TERM");
        if round % 2 == 1 {
            running.signal("-TERM");
        }
        let code = running.ends("tonemap that writes");
        assert!([Some(0), Some(8), Some(143)].contains(&code), "{code:?}");
        for name in files(out.path()) {
            assert!(!name.ends_with(".tmp"), "{name}");
            let path = out.path().join(&name);
            if name.ends_with(".json") {
                // What a .pfm file says about itself.
                let text = fs::read_to_string(&path).unwrap();
                assert!(serde_json::from_str::<serde_json::Value>(&text).is_ok(), "{name}: {text}");
                continue;
            }
            let read = image::read(&path, &lucerna::scene::Limits::default());
            assert_eq!(read.map(|layers| layers.width).unwrap(), 3000, "{name}");
        }
    }
}

#[test]
fn an_experiment_is_left_and_goes_on() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("e.toml"), folder.path().join("out"));
    let text = "title = \"T\"\nsize = \"160x120\"\nmeasures = [\"mae\"]\n[[scene]]\nname = \"cornell\"\nbuiltin = \
                \"cornell\"\ncameras = [\"0\"]\n[[technique]]\nname = \"p\"\nkind = \"path\"\nsettings = { bounces = 1 }\n\
                matrix = { samples = [1, 100000] }\n";
    fs::write(&file, text).unwrap();
    let mut long = command(env!("CARGO_BIN_EXE_lucerna"));
    long.arg("reproduce").arg(&file).arg("-o").arg(&out).args(["--progress", "plain"]);
    // The second picture takes hours, on the CPU, in one call.
    let running = Running::until(&mut long, "samples = 1");
    assert_eq!(running.stopped(Duration::from_millis(500), "lucerna reproduce"), Some(8));
    let names = files(&out.join("runs"));
    assert!(names.len() == 2 && names.iter().all(|name| !name.contains(".tmp")), "{names:?}");
    let dry = command(env!("CARGO_BIN_EXE_lucerna"))
        .arg("reproduce")
        .arg(&file)
        .arg("-o")
        .arg(&out)
        .arg("--dry-run")
        .output();
    assert!(String::from_utf8_lossy(&dry.unwrap().stdout).contains("2 runs, 1 of them exist"));
}

/// A program that nobody waits for, and that says nothing: it ends at once, as by default, but tidies up.
#[test]
fn programs_that_keep_nothing_end_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let input = picture(folder.path(), 3000, 2000);
    let mut long = command(env!("CARGO_BIN_EXE_lucerna"));
    long.args(["compare", &input, &input, "--metric", "all", "-v"]);
    let running = Running::until(&mut long, "light.exr");
    running.signal("-INT");
    assert_eq!(running.ends("lucerna compare"), Some(130));
    // One that had ended before is no different.
    ran(command(env!("CARGO_BIN_EXE_lucerna")).args(["compare", "none.exr", &input])).expect(3, &["none.exr"]);
}
