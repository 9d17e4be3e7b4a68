//! Opens windows on an X server of its own and looks at them.
//!
//! A process can open a window only once, so each scene runs in a process of its own: this program again, with the
//! scene's name in an environment variable.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod desktop;
mod scenes;

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

const SCENE: &str = "LUCERNA_WINDOW_SCENE";
const LONGEST_SCENE: Duration = Duration::from_secs(180);

/// An X server without a screen that one could see. It stops when this value is dropped.
struct Server {
    process: Child,
    display: String,
}

impl Server {
    fn start() -> Self {
        let mut process = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1600x1200x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb must be installed");
        let mut number = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut number).unwrap();
        Self { process, display: format!(":{}", number.trim()) }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn succeeds(name: &str, server: &Server) -> bool {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.env(SCENE, name).env("DISPLAY", &server.display).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    match name {
        "no_display" => command.env_remove("DISPLAY"),
        "dead_display" => command.env("DISPLAY", ":98765"),
        _ => &mut command,
    };
    let lavapipe = "/usr/share/vulkan/icd.d/lvp_icd.json";
    if std::env::var_os("VK_DRIVER_FILES").is_none() && std::path::Path::new(lavapipe).exists() {
        command.env("VK_DRIVER_FILES", lavapipe).env("VK_ICD_FILENAMES", lavapipe);
    }
    // Both spellings: one for the layer of Debian 12, one for that of Debian 13.
    command.env(
        "VK_LAYER_ENABLES",
        "VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT:VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT",
    );
    let mut process = command.spawn().unwrap();
    let start = Instant::now();
    let status = loop {
        if let Some(status) = process.try_wait().unwrap() {
            break Some(status);
        }
        if start.elapsed() > LONGEST_SCENE {
            let _ = process.kill();
            break None;
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    let good = status.is_some_and(|s| s.success());
    let seconds = start.elapsed().as_secs_f64();
    println!("{} {name} ({seconds:.1} s)", if good { "ok    " } else { "FAILED" });
    good
}

fn main() -> ExitCode {
    if let Ok(name) = std::env::var(SCENE) {
        let (_, scene) = scenes::ALL.iter().find(|(n, _)| *n == name).expect("a scene of this name");
        scene();
        return ExitCode::SUCCESS;
    }
    let filter = std::env::args().skip(1).find(|a| !a.starts_with('-')).unwrap_or_default();
    let server = Server::start();
    let failures = scenes::ALL.iter().filter(|(n, _)| n.contains(&filter) && !succeeds(n, &server)).count();
    if failures == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
