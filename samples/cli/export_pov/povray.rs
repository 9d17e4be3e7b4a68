//! Runs POV-Ray, if it is installed.

use std::{
    fs::File,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use lucerna::{Error, ErrorKind, Result, image, scene::Limits};

use super::Export;
use crate::{args::Size, signals::Interrupt};

/// Options of a run of POV-Ray.
#[derive(Clone, Debug)]
pub struct Options {
    /// POV-Ray is stopped after this time.
    pub time_limit: Duration,
    /// Threads; 0: as many as there are cores. The radiosity of POV-Ray depends on their number and timing.
    pub threads: u32,
    /// The number of rays per pixel is the square of this value; 1: one ray, through the centre.
    pub subpixels: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self { time_limit: Duration::from_secs(3600), threads: 0, subpixels: 1 }
    }
}

/// The result of a run of POV-Ray.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// Linear radiance, W/(sr·m²), in half precision.
    pub picture: image::Layers,
    pub seconds: f64,
    /// `POV-Ray 3.7.0.10.unofficial`.
    pub version: String,
}

/// The program on PATH.
///
/// # Errors
/// `Usage` if there is none.
pub fn find() -> Result<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).map(|folder| folder.join("povray")).find(|file| file.is_file()).ok_or_else(|| {
        Error::usage("the program `povray` is not on PATH").help("Install POV-Ray 3.7, on Debian the package povray")
    })
}

/// Its name and version.
///
/// # Errors
/// `Runtime` if it does not start.
pub fn version(program: &Path) -> Result<String> {
    let output = Command::new(program)
        .arg("--version")
        .stdin(Stdio::null())
        .output()
        .map_err(|error| failed("could not be started").in_file(program).caused_by(error))?;
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    let line = text.lines().find(|line| line.starts_with("POV-Ray") || line.starts_with("Persistence"));
    Ok(line.unwrap_or("POV-Ray").trim().to_owned())
}

/// Renders an exported scene in a folder of its own and returns the linear picture.
///
/// # Errors
/// `Usage` if POV-Ray is not installed, `Runtime` with its message if it fails or takes too long.
pub fn render(export: &Export, size: Size, options: &Options) -> Result<Rendered> {
    let program = find()?;
    let folder = tempfile::Builder::new()
        .prefix("lucerna-pov-")
        .tempdir()
        .map_err(|error| Error::new(ErrorKind::Output, "no folder for temporary files").caused_by(error))?;
    export.write(&folder.path().join("scene.pov"), false)?;
    let log = folder.path().join("log.txt");
    let open = || File::create(&log).map_err(|error| failed("no log file").in_file(&log).caused_by(error));
    let mut command = Command::new(&program);
    command
        .args(["+Iscene.pov", "+Oscene.exr", "+FE", "-D", "-P", "-V", "Pause_When_Done=off"])
        .args([format!("+W{}", size.width), format!("+H{}", size.height)]);
    match options.subpixels {
        0 | 1 => command.arg("-A"),
        // No threshold: every pixel gets the same regular grid, without jitter.
        n => command.args(["+A0.0".to_owned(), "+AM1".into(), format!("+R{}", n.min(9)), "-J".into()]),
    };
    if options.threads > 0 {
        command.arg(format!("+WT{}", options.threads.min(512)));
    }
    // On a stop, the child process and the temporary folder must be removed.
    let stop = Interrupt::stop();
    let begun = Instant::now();
    let mut child = command
        .current_dir(folder.path())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(open()?)
        .spawn()
        .map_err(|error| failed("could not be started").in_file(&program).caused_by(error))?;
    let status = loop {
        let ended = child.try_wait().map_err(|error| failed("was lost").in_file(&program).caused_by(error))?;
        if let Some(status) = ended {
            break status;
        }
        let asked = stop.check();
        if asked.is_err() || begun.elapsed() > options.time_limit {
            // Ignores the error if the process has just ended.
            let _ = child.kill();
            let _ = child.wait();
            asked?;
            let seconds = options.time_limit.as_secs_f64();
            return Err(failed(format!("POV-Ray was stopped after {seconds} s"))
                .help("Allow more time, or lower pov.count or the picture's size"));
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    if !status.success() {
        // The first lines of the log have the error message; the log may be long.
        let text = image::read_head_checked(&log, 1 << 20).unwrap_or_default();
        let text = String::from_utf8_lossy(&text);
        return Err(failed(format!("POV-Ray ended with {status}: {}", message(&text))));
    }
    let picture = image::read(folder.path().join("scene.exr"), &Limits::default())?;
    Ok(Rendered { picture, seconds: begun.elapsed().as_secs_f64(), version: version(&program)? })
}

fn failed(what: impl Into<String>) -> Error {
    Error::new(ErrorKind::Runtime, what)
}

/// The lines of the log with error messages.
fn message(log: &str) -> String {
    let wrong = |line: &&str| line.contains("Error") || line.contains("error") || line.contains("Fatal");
    let lines: Vec<&str> = log.lines().map(str::trim).filter(|l| !l.is_empty()).collect();
    let found: Vec<&str> = lines.iter().copied().filter(wrong).take(3).collect();
    let shown = if found.is_empty() { lines.iter().rev().take(3).rev().copied().collect() } else { found };
    shown.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_message_is_the_error_and_not_the_banner() {
        let log =
            "POV-Ray 3.7\n\nFile 'a.pov' line 3: Parse Error: No matching }\nFatal error in parser\nRender failed";
        assert!(message(log).starts_with("File 'a.pov' line 3: Parse Error"), "{}", message(log));
        assert_eq!(message("one\n\ntwo"), "one; two");
    }
}
