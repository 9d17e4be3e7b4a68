//! `--timings FILE.csv`: the time of every pass of every frame.

use std::{fmt::Write, path::Path};

use lucerna::{Result, graph::Report, image};

/// Rows of a CSV file: frame, scope, pass, milliseconds on the device (empty if it has no timestamps) and on the CPU.
#[derive(Debug)]
pub struct Timings {
    csv: String,
}

impl Default for Timings {
    fn default() -> Self {
        Self { csv: "frame,scope,pass,gpu_ms,cpu_ms\n".into() }
    }
}

impl Timings {
    /// Adds the passes of a frame.
    pub fn add(&mut self, frame: u32, report: &Report) {
        for pass in &report.passes {
            let gpu = pass.gpu_ms.map_or(String::new(), |ms| format!("{ms:.6}"));
            let (scope, name) = (quoted(&pass.scope.join("/")), quoted(&pass.name));
            // Writing into a String cannot fail.
            let _ = writeln!(self.csv, "{frame},{scope},{name},{gpu},{:.6}", pass.cpu_ms);
        }
    }

    /// Writes the file as a whole or not at all.
    pub fn write(&self, path: &Path) -> Result<()> {
        image::write_atomic(path, self.csv.as_bytes(), true)
    }
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use lucerna::graph::PassTime;

    use super::*;

    #[test]
    fn a_row_for_each_pass() {
        let pass = |name: &str, gpu_ms| PassTime {
            name: name.into(),
            scope: vec!["a".into(), "b".into()],
            launches: 1,
            gpu_ms,
            cpu_ms: 0.25,
            started: None,
        };
        let report = Report { passes: vec![pass("x", Some(1.5)), pass("y, \"z\"", None)], ..Report::default() };
        let mut timings = Timings::default();
        timings.add(7, &report);
        let rows: Vec<&str> = timings.csv.lines().collect();
        assert_eq!(rows[1..], ["7,a/b,x,1.500000,0.250000", "7,a/b,\"y, \"\"z\"\"\",,0.250000"]);
    }
}
