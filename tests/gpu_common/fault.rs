//! Starting a program with a fault in its environment, and failing every call of a function in turn.
#![allow(dead_code)]

use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::Arc,
    time::{Duration, Instant},
};

use lucerna::{
    Result,
    gpu::{self, Gpu, GpuOptions, Validation},
};

/// Says to a child what to do.
const TASK: &str = "LUCERNA_TEST_TASK";

/// If this process is a child: does its task and ends it with the exit code of the executables.
pub fn child_process(tasks: impl FnOnce(&str) -> Result<()>) {
    if let Ok(task) = std::env::var(TASK) {
        // Warnings of the engine are shown as a program shows them.
        let _ = log::set_logger(&ToStandardError).map(|()| log::set_max_level(log::LevelFilter::Warn));
        let code = match tasks(&task) {
            Ok(()) => 0,
            Err(error) => {
                eprintln!("error: {error}");
                i32::from(error.exit_code())
            }
        };
        // Not through the test harness: the exit code is what is tested.
        std::process::exit(code);
    }
}

struct ToStandardError;

impl log::Log for ToStandardError {
    fn enabled(&self, _: &log::Metadata<'_>) -> bool {
        true
    }

    fn log(&self, record: &log::Record<'_>) {
        eprintln!("warning: {}", record.args());
    }

    fn flush(&self) {}
}

/// With validation, and the environment's choices.
pub fn options() -> Result<GpuOptions> {
    Ok(GpuOptions { validation: Validation::Sync, print_messages: false, ..GpuOptions::from_env()? })
}

/// Fails the first call of `function`, then the second, and so on, once and from then on, until the work is done before the
/// fault comes. `argument`: `FUNCTION RESULT`. What `work` does must be made good or end in an error that names the call.
pub fn every_call(argument: &str, work: impl Fn(&Gpu) -> Result<()>) {
    let (function, fault) = argument.split_once(' ').unwrap();
    let report = PathBuf::from(std::env::var_os("VKFAULT_REPORT").unwrap());
    let mut runs = 0;
    for sticky in ["", "+"] {
        for n in 1.. {
            assert!(n < 400, "{function} is called without end");
            let _ = fs::remove_file(&report);
            // SAFETY: this process has one test thread, and the main thread waits for it.
            unsafe { std::env::set_var("VKFAULT", format!("{function}@{n}{sticky}={fault}")) };
            let begun = Instant::now();
            let mut log = None;
            let result = options().and_then(Gpu::new).and_then(|gpu| {
                log = Some(Arc::clone(gpu.log()));
                work(&gpu)
            });
            let what = format!("{function}@{n}{sticky}={fault} gave {result:?}");
            assert!(begun.elapsed() < Duration::from_secs(20), "slow: {what}");
            let said: Vec<String> =
                log.iter().flat_map(|log| log.unexpected()).map(|message| message.to_string()).collect();
            assert!(said.is_empty(), "{said:#?}\nafter {what}");
            runs += 1;
            let fired = fs::read_to_string(&report).unwrap_or_default();
            if fired.is_empty() {
                assert!(result.is_ok(), "no fault, but {what}");
                break;
            }
            if let Err(error) = result {
                let expected = match fault {
                    "OOM_HOST" | "OOM_DEVICE" => 5,
                    "DEVICE_LOST" => 6,
                    _ => 1,
                };
                assert_eq!(error.exit_code(), expected, "{what}");
                let text = error.to_string();
                assert!(expected == 1 || text.ends_with('.'), "no advice: {what}");
                let named = text.contains(function) || text.contains("no memory for `");
                assert!(named, "the call is not named: {what}");
            } else {
                // A single failure may be made good; a lasting one of something that is needed may not.
                assert!(sticky.is_empty() || function == "vkDeviceWaitIdle", "{what}");
            }
        }
    }
    println!("{function}: {runs} runs");
}

/// What a child left behind.
#[derive(Debug)]
pub struct Outcome {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl Outcome {
    #[track_caller]
    pub fn fails_with(&self, code: i32, parts: &[&str]) {
        assert_eq!(self.code, Some(code), "{self:#?}");
        let error = self.err.split("error: ").nth(1).unwrap_or_default();
        for part in parts {
            assert!(error.contains(part), "no `{part}` in {self:#?}");
        }
    }

    #[track_caller]
    pub fn succeeds(&self) {
        assert_eq!(self.code, Some(0), "{self:#?}");
    }
}

/// A child in preparation.
pub struct Case {
    command: Command,
    pub folder: tempfile::TempDir,
    variables: HashMap<String, String>,
}

impl Case {
    /// This test program, as a child with this task.
    pub fn new(task: &str) -> Self {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", "child_process", "--nocapture", "--test-threads=1"]).env(TASK, task);
        Self::of(command)
    }

    /// Any program.
    pub fn of(mut command: Command) -> Self {
        for (name, _) in gpu::ENVIRONMENT {
            if name != "LUCERNA_DEVICE" {
                command.env_remove(name);
            }
        }
        Self { command, folder: tempfile::tempdir().unwrap(), variables: HashMap::new() }
    }

    pub fn args(mut self, args: impl IntoIterator<Item = impl AsRef<std::ffi::OsStr>>) -> Self {
        self.command.args(args);
        self
    }

    pub fn env(mut self, name: &str, value: impl AsRef<std::ffi::OsStr>) -> Self {
        self.command.env(name, value);
        self
    }

    pub fn env_remove(mut self, name: &str) -> Self {
        self.command.env_remove(name);
        self
    }

    pub fn file(self, name: &str, contents: &str) -> Self {
        fs::write(self.folder.path().join(name), contents).unwrap();
        self
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Puts the fault layer in, with these rules.
    pub fn layer(mut self, rules: &[(&str, &str)]) -> Self {
        let library = std::env::current_exe().unwrap().parent().unwrap().join("liblucerna_fault_layer.so");
        assert!(library.exists(), "{} was not built with the tests", library.display());
        let manifest = format!(
            r#"{{"file_format_version":"1.2.0","layer":{{"name":"VK_LAYER_LUCERNA_fault","type":"GLOBAL",
            "library_path":"{}","api_version":"1.3.0","implementation_version":"1","description":"fault injection"}}}}"#,
            library.display()
        );
        fs::write(self.path("fault.json"), manifest).unwrap();
        for (name, value) in rules {
            self.variables.insert((*name).into(), (*value).into());
        }
        let mut folders = vec![self.folder.path().to_path_buf()];
        match std::env::var_os("VK_LAYER_PATH") {
            Some(path) => folders.extend(std::env::split_paths(&path)),
            None => folders.extend(
                [
                    "/usr/share/vulkan/explicit_layer.d",
                    "/etc/vulkan/explicit_layer.d",
                    "/usr/local/share/vulkan/explicit_layer.d",
                ]
                .map(PathBuf::from),
            ),
        }
        let report = self.path("report");
        self.env("VK_LAYER_PATH", std::env::join_paths(folders).unwrap())
            .env("VK_INSTANCE_LAYERS", "VK_LAYER_LUCERNA_fault")
            .env("VKFAULT_REPORT", report)
    }

    /// The faults that the layer has injected so far.
    pub fn fired(&self) -> String {
        fs::read_to_string(self.path("report")).unwrap_or_default()
    }

    /// Runs it, at most two minutes.
    pub fn run(mut self) -> Outcome {
        self.run_here()
    }

    /// [`Self::run`], so that the folder can be looked at afterwards.
    pub fn run_here(&mut self) -> Outcome {
        let (out, err) = (self.path("out"), self.path("err"));
        self.command
            .envs(&self.variables)
            .stdin(Stdio::null())
            .stdout(fs::File::create(&out).unwrap())
            .stderr(fs::File::create(&err).unwrap());
        let mut process = self.command.spawn().unwrap();
        let begun = Instant::now();
        let status = loop {
            if let Some(status) = process.try_wait().unwrap() {
                break Some(status);
            }
            if begun.elapsed() > Duration::from_secs(120) {
                process.kill().unwrap();
                process.wait().unwrap();
                break None;
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        let read = |path: &Path| String::from_utf8_lossy(&fs::read(path).unwrap()).into_owned();
        let outcome = Outcome { code: status.and_then(|s| s.code()), out: read(&out), err: read(&err) };
        assert!(status.is_some(), "the child hangs: {outcome:#?}");
        outcome
    }
}

/// Without a device here (and no `CI`), only the cases that need none are run.
pub fn have_device() -> bool {
    let has = gpu::list_devices().is_ok_and(|list| list.iter().any(|d| d.missing.is_empty()));
    if !has {
        assert!(std::env::var_os("CI").is_none(), "no Vulkan device, and CI is set");
        eprintln!("SKIPPED: this test needs a Vulkan device");
    }
    has
}

/// A child for each `FUNCTION RESULT`; its task `each:…` calls [`every_call`].
#[track_caller]
pub fn each(faults: &[&str]) {
    if have_device() {
        for fault in faults {
            let outcome = Case::new(&format!("each:{fault}")).layer(&[]).run();
            outcome.succeeds();
            print!(
                "{}",
                outcome.out.lines().filter(|l| l.contains(" runs")).map(|l| format!("{l}\n")).collect::<String>()
            );
        }
    }
}
