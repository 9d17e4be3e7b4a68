//! Plans and reports as text.

use std::fmt::{self, Write};

use super::{
    frame::Report,
    plan::{Plan, Shape, Source},
    vocab::{Resource, Use},
};

impl Plan {
    /// One line for each pass: number, name, what it reads and writes, and the barriers it waits for.
    pub fn list_passes(&self) -> String {
        let mut text = String::new();
        for (index, pass) in self.passes.iter().enumerate() {
            let scope: String = pass.scope.iter().map(|s| format!("{s} / ")).collect();
            let list = |wanted: &dyn Fn(&Use) -> bool| {
                let mut names: Vec<&str> = Vec::new();
                for u in pass.uses.iter().filter(|u| wanted(u)) {
                    let name = self.name(u.resource);
                    if !names.contains(&name) {
                        names.push(name);
                    }
                }
                names.join(", ")
            };
            let (reads, writes) = (list(&|u| u.reads()), list(&|u| u.writes()));
            // Writing into a String cannot fail.
            let _ = write!(text, "{index:3}  {scope}{}", pass.name);
            if !reads.is_empty() {
                let _ = write!(text, "  reads {reads}");
            }
            if !writes.is_empty() {
                let _ = write!(text, "  writes {writes}");
            }
            match self.barriers_before(index).len() {
                0 => {}
                1 => text.push_str("  (1 barrier)"),
                n => {
                    let _ = write!(text, "  ({n} barriers)");
                }
            }
            text.push('\n');
        }
        text
    }

    /// One line for each image and buffer in memory: its size, where it comes from, and whose it is in turn.
    pub fn list_memory(&self) -> String {
        let mut text = String::new();
        for physical in &self.physical {
            let names: Vec<&str> = physical.occupants.iter().map(|r: &Resource| self.name(*r)).collect();
            let shape = match physical.shape {
                Shape::Image(d) => {
                    format!("{:?} {} × {} levels × {} layers", d.format, d.extent, d.mips, d.layers * d.depth)
                }
                Shape::Buffer(bytes) => format!("{bytes} bytes"),
            };
            let source = match &physical.source {
                Source::Pool => "transient",
                Source::History { .. } => "history",
                Source::Imported(_) => "imported",
            };
            let _ = writeln!(text, "{source:9}  {shape}  {}", names.join(" / "));
        }
        text
    }
}

impl Report {
    /// Milliseconds on the device of all passes; `None` if it has no timestamps.
    pub fn gpu_ms(&self) -> Option<f64> {
        self.passes.iter().map(|p| p.gpu_ms).sum()
    }
}

impl fmt::Display for Report {
    /// A table: one line for each pass, and the sums.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "graph `{}` on {}", self.graph, self.device)?;
        let ms = |v: Option<f64>| v.map_or_else(|| "-".to_owned(), |v| format!("{v:.3}"));
        writeln!(f, "{:>10} {:>10} {:>8}  pass", "GPU ms", "CPU ms", "launches")?;
        for pass in &self.passes {
            let scope: String = pass.scope.iter().map(|s| format!("{s} / ")).collect();
            writeln!(f, "{:>10} {:>10.3} {:>8}  {scope}{}", ms(pass.gpu_ms), pass.cpu_ms, pass.launches, pass.name)?;
        }
        writeln!(f, "{:>10} {:>10.3} {:>8}  all passes", ms(self.gpu_ms()), self.record_ms, "")?;
        write!(
            f,
            "plan {:.3} ms, record {:.3} ms, wait {:.3} ms, {} barriers, {:.1} MiB transient",
            self.plan_ms,
            self.record_ms,
            self.wait_ms,
            self.barriers,
            self.transient_bytes as f64 / f64::from(1 << 20)
        )
    }
}
