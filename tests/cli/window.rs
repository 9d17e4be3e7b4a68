//! A viewer under an X server without a screen, and what its window shows.

use std::{
    io::{BufRead, BufReader, Read},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use crate::{
    desktop::Desktop,
    support::{command, device, lucerna},
};
use lucerna::{
    image::{self, srgb},
    scene::Limits,
};

/// Pictures come within seconds. This bound finds those that never come: a machine that does much else besides is slow.
pub const BOUND: Duration = Duration::from_secs(120);
pub const SIZE: [u16; 2] = [160, 120];

pub const ESCAPE: u32 = 0xff1b;
pub const TAB: u32 = 0xff09;
pub const F1: u32 = 0xffbe;

/// A letter as a symbol of X.
pub fn letter(c: char) -> u32 {
    u32::from(c)
}

/// An X server that ends with the test. `None`: Xvfb is not installed, which fails if `CI` is set.
pub struct Server {
    pub process: Child,
    pub display: String,
}

impl Server {
    pub fn start() -> Option<Self> {
        let process = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1400x900x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let Ok(mut process) = process else {
            assert!(std::env::var_os("CI").is_none(), "Xvfb is not installed and CI is set");
            eprintln!("SKIPPED: Xvfb is not installed");
            return None;
        };
        let mut number = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut number).unwrap();
        Some(Self { process, display: format!(":{}", number.trim()) })
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A running viewer.
pub struct Viewer {
    pub child: Child,
    pub desktop: Desktop,
    pub folder: tempfile::TempDir,
    pub size: [u16; 2],
}

impl Viewer {
    /// Opens a window of some size without panels.
    pub fn open(server: &Server, size: [u16; 2], words: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut program = command(env!("CARGO_BIN_EXE_lucerna"));
        program.arg("view").args(words.split_whitespace());
        program.arg("--window").arg(format!("{}x{}", size[0], size[1])).current_dir(folder.path());
        program.env("DISPLAY", &server.display).env_remove("WAYLAND_DISPLAY").env("LUCERNA_VALIDATION", "core");
        let child = program.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let desktop = Desktop::find_on(Some(&server.display), "lucerna");
        desktop.focus();
        desktop.point(4, 4);
        Self { child, desktop, folder, size }
    }

    pub fn bare(server: &Server, words: &str) -> Self {
        Self::open(server, SIZE, &format!("--bare {words}"))
    }

    /// Processor time that it has used, seconds.
    pub fn processor_seconds(&self) -> f64 {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.child.id())).unwrap();
        let fields: Vec<f64> =
            stat.rsplit(')').next().unwrap().split_whitespace().map(|field| field.parse().unwrap_or(0.0)).collect();
        // utime and stime, in hundredths.
        (fields[11] + fields[12]) / 100.0
    }

    pub fn picture(&self) -> Vec<[u8; 3]> {
        self.desktop.picture([0, 0], self.size).unwrap_or_default()
    }

    /// Waits until the picture is as asked, and returns it.
    #[track_caller]
    pub fn until(&self, what: &str, good: impl Fn(&[[u8; 3]]) -> bool) -> Vec<[u8; 3]> {
        let begun = Instant::now();
        loop {
            let picture = self.picture();
            if good(&picture) {
                return picture;
            }
            assert!(begun.elapsed() < BOUND, "it never happened: {what}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits until the window shows exactly this.
    #[track_caller]
    pub fn shows(&self, what: &str, expected: &[[u8; 3]]) {
        self.until(what, |picture| picture == expected);
    }

    /// Closes the window. It ends soon, without an error and without a message of the validation layer.
    #[track_caller]
    pub fn close(mut self) {
        self.desktop.close();
        let begun = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            if begun.elapsed() > BOUND {
                self.child.kill().unwrap();
                panic!("the window does not close");
            }
            std::thread::sleep(Duration::from_millis(10));
        };
        let mut said = String::new();
        self.child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        assert!(status.success(), "{status}: {said}");
        for word in ["validation", "VUID", "panicked", "internal error", "error:"] {
            assert!(!said.contains(word), "{said}");
        }
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The codes of a picture that a command writes.
#[track_caller]
pub fn by_command(words: &str) -> Vec<[u8; 3]> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.png");
    let size = format!("{}x{}", SIZE[0], SIZE[1]);
    let words = words.split_whitespace().chain(["--size", &size, "-q", "-o"]).map(str::to_owned);
    lucerna(words.chain([file.display().to_string()])).expect(0, &[]);
    codes(&file)
}

pub fn codes(file: &Path) -> Vec<[u8; 3]> {
    let layers = image::read(file, &Limits::default()).unwrap();
    layers.layers[0].rgb_pixels().unwrap().into_iter().map(|pixel| pixel.map(srgb::encode_u8)).collect()
}

/// The first file with this ending, when it is complete.
pub fn written(folder: &Path, ending: &str) -> PathBuf {
    let begun = Instant::now();
    loop {
        let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let found: Vec<PathBuf> = files.filter(|file| file.to_string_lossy().ends_with(ending)).collect();
        if let Some(file) = found.into_iter().next() {
            return file;
        }
        assert!(begun.elapsed() < BOUND, "no file {ending}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

pub fn ready() -> Option<Server> {
    if device() { Server::start() } else { None }
}
