//! The progress of long work, on stderr: one meter for all commands.

use std::{
    io::IsTerminal,
    time::{Duration, Instant},
};

use serde_json::{Map, Value, json};

use crate::console;

/// Width of a bar, in characters.
const BAR: usize = 20;
/// Time between two lines of work that is not counted item by item.
const PAUSE: Duration = Duration::from_secs(5);
/// The same for a bar, which overwrites itself.
const BAR_PAUSE: Duration = Duration::from_millis(200);

/// Work that takes less has no bar within its items.
const PATIENCE: Duration = Duration::from_secs(1);

/// How progress is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum ProgressMode {
    /// A bar on a terminal, plain lines elsewhere; nothing with -q.
    #[default]
    Auto,
    /// A bar.
    Bar,
    /// One line per item of work, or every five seconds.
    Plain,
    /// The same as JSON, one object per line.
    Json,
    /// Lines that Open Job Description schedulers read (openjd_progress, openjd_status).
    #[value(name = "openjd")]
    OpenJd,
    None,
}

impl ProgressMode {
    /// Resolves `Auto`. A bar consists of escape codes, so it is shown on terminals only. `few`: there is too little work for a bar.
    fn resolved(self, terminal: bool, quiet: bool, few: bool) -> Self {
        match self {
            Self::Auto if quiet => Self::None,
            Self::Auto if terminal && !few => Self::Bar,
            Self::Bar if terminal => Self::Bar,
            Self::Auto | Self::Bar => Self::Plain,
            mode => mode,
        }
    }
}

/// A moment of the work.
#[derive(Clone, Debug)]
pub struct Moment {
    /// Finished items, with those of earlier runs.
    pub done: f64,
    pub total: f64,
    /// Plural noun of the items: `samples`.
    pub unit: &'static str,
    /// Estimated remaining seconds; `None` if nothing is known.
    pub seconds_left: Option<f64>,
    /// The line for people: after the bar, or as the whole line.
    pub text: String,
    /// Further facts for programs, by name.
    pub facts: Map<String, Value>,
    /// No further line follows.
    pub last: bool,
}

/// Shows progress in the way that the user chose.
#[derive(Debug)]
pub struct Meter {
    mode: ProgressMode,
    /// A bar on this terminal would have too little work.
    few: bool,
    started: Instant,
    shown: Instant,
}

impl Meter {
    /// `quiet`: `-q` was given. `few`: there is too little work for a bar.
    pub fn new(mode: ProgressMode, quiet: bool, few: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let few = few && terminal && mode == ProgressMode::Auto;
        let mode = mode.resolved(terminal, quiet, few);
        Self { mode, few, started: Instant::now(), shown: Instant::now() }
    }

    /// Whether anything is shown at all.
    pub fn shows(&self) -> bool {
        self.mode != ProgressMode::None
    }

    /// Whether a line of work that is not counted item by item is due.
    pub fn due(&self) -> bool {
        let pause = if self.mode == ProgressMode::Bar { BAR_PAUSE } else { PAUSE };
        self.shows() && self.shown.elapsed() >= pause
    }

    /// Whether a line within an item of work is due: on terminals that is a bar, which the item's own line replaces.
    pub fn due_within(&self) -> bool {
        let soon = self.mode_within() == ProgressMode::Bar && self.seconds() >= PATIENCE.as_secs_f64();
        self.shows() && self.shown.elapsed() >= if soon { BAR_PAUSE } else { PAUSE }
    }

    /// Work with few items has a line for each, but a bar within them.
    fn mode_within(&self) -> ProgressMode {
        if self.few && self.mode == ProgressMode::Plain { ProgressMode::Bar } else { self.mode }
    }

    /// Shows a line within an item of work.
    pub fn show_within(&mut self, moment: &Moment) {
        self.show_as(self.mode_within(), moment);
    }

    /// Whether the items that need no work are shown too: lines about them would hide the other lines.
    pub fn shows_idle_items(&self) -> bool {
        self.mode != ProgressMode::Plain
    }

    /// Time is counted from `begun`.
    pub fn since(&mut self, begun: Instant) {
        self.started = begun;
    }

    /// Seconds since the work began.
    pub fn seconds(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// Shows a line.
    pub fn show(&mut self, moment: &Moment) {
        self.show_as(self.mode, moment);
    }

    fn show_as(&mut self, mode: ProgressMode, moment: &Moment) {
        self.shown = Instant::now();
        let text = line(mode, moment, self.seconds());
        match mode {
            ProgressMode::Auto | ProgressMode::None => {}
            ProgressMode::Bar => console::stderr_bar(&text, moment.last),
            _ => console::stderr_line(&text),
        }
    }
}

impl Drop for Meter {
    fn drop(&mut self) {
        console::end_bar();
    }
}

/// The line of a moment, without its end.
fn line(mode: ProgressMode, moment: &Moment, seconds: f64) -> String {
    let Moment { done, total, unit, seconds_left, text, facts, last } = moment;
    let share = if *last { 1.0 } else { done / total.max(f64::MIN_POSITIVE) };
    let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
    // Names in the text may come from untrusted files: they must not begin another line.
    let text = console::legible(text).replace('\n', " ");
    match mode {
        ProgressMode::Auto | ProgressMode::None => String::new(),
        ProgressMode::Plain => text,
        ProgressMode::Bar => {
            let filled = (share * BAR as f64) as usize;
            format!("{}{} {text}", "█".repeat(filled), "░".repeat(BAR - filled))
        }
        ProgressMode::OpenJd => format!("openjd_progress: {:.1}\nopenjd_status: {text}", 100.0 * share),
        ProgressMode::Json => {
            let left = if *last { Some(0.0) } else { *seconds_left };
            let mut object = json!({
                "done": number(*done), "total": number(*total), "unit": unit, "seconds": seconds, "seconds_left": left, "last": last,
            });
            for (name, value) in facts {
                object[name] = value.clone();
            }
            object.to_string()
        }
    }
}

/// A count as a whole number where it is one.
fn number(value: f64) -> Value {
    if value.fract() == 0.0 && (0.0..9e15).contains(&value) { json!(value as u64) } else { json!(value) }
}

/// Counts frames or pictures, which take about the same time.
#[derive(Debug)]
pub struct Frames {
    meter: Meter,
    total: u64,
    done: u64,
}

impl Frames {
    /// For `total` frames.
    pub fn new(mode: ProgressMode, quiet: bool, total: u64) -> Self {
        Self { meter: Meter::new(mode, quiet, total <= 1), total, done: 0 }
    }

    /// Reports a finished frame: its number, its time in milliseconds, and the files written.
    pub fn frame(&mut self, frame: u32, milliseconds: f64, files: &[String]) {
        self.step(&format!("frame {frame}"), json!(frame), milliseconds, files);
    }

    /// Reports a finished picture by its name, like [`Frames::frame`].
    pub fn named(&mut self, name: &str, milliseconds: f64, files: &[String]) {
        self.step(name, json!(name), milliseconds, files);
    }

    /// Reports how much of the next frame is done, 0 to 1, if a line is due: a slow frame must not look like one that has stopped.
    pub fn within(&mut self, frame: u32, share: f64) {
        if !self.meter.due_within() {
            return;
        }
        let (done, total) = (self.done as f64 + share, self.total as f64);
        let seconds = self.meter.seconds();
        let seconds_left = (share > 0.0).then(|| seconds / done * (total - done).max(0.0));
        let left = seconds_left.map_or(String::new(), |left| format!(", {} left", span(left)));
        let next = self.done + 1;
        self.meter.show_within(&Moment {
            done,
            total,
            unit: "frames",
            seconds_left,
            text: format!("frame {frame} ({next}/{}): {:.0} %{left}", self.total, 100.0 * share),
            facts: into_facts(json!({ "frame": frame })),
            last: false,
        });
    }

    fn step(&mut self, name: &str, frame: Value, milliseconds: f64, files: &[String]) {
        self.done += 1;
        let Self { done, total, .. } = *self;
        let left = self.meter.seconds() / done as f64 * total.saturating_sub(done) as f64;
        let wrote = if files.is_empty() { String::new() } else { format!(", wrote {}", files.join(" ")) };
        let rest = if done < total { format!(", {} left", span(left)) } else { String::new() };
        let facts = json!({ "frame": frame, "ms": milliseconds, "files": files });
        self.meter.show(&Moment {
            done: done as f64,
            total: total as f64,
            unit: "frames",
            seconds_left: Some(left),
            text: format!("{name} ({done}/{total}): {milliseconds:.0} ms{rest}{wrote}"),
            facts: into_facts(facts),
            last: done >= total,
        });
    }
}

/// The members of a JSON object.
pub fn into_facts(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(facts) => facts,
        _ => Map::new(),
    }
}

/// A time span: `12 s`, `4 min 10 s`, `3 h 20 min`.
pub fn span(seconds: f64) -> String {
    let seconds = if seconds.is_finite() { seconds.max(0.0).round() as u64 } else { return "unknown time".into() };
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {:02} s", seconds / 60, seconds % 60),
        _ => format!("{} h {:02} min", seconds / 3600, seconds % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moment(last: bool) -> Moment {
        Moment {
            done: 3.0,
            total: 8.0,
            unit: "frames",
            seconds_left: Some(5.0),
            text: "frame 2".into(),
            facts: into_facts(json!({ "ms": 4 })),
            last,
        }
    }

    #[test]
    fn spans_are_told_in_two_units_at_most() {
        let all =
            [(59.4, "59 s"), (61.0, "1 min 01 s"), (4200.0, "1 h 10 min"), (-1.0, "0 s"), (f64::NAN, "unknown time")];
        all.iter().for_each(|(seconds, text)| assert_eq!(span(*seconds), *text));
    }

    #[test]
    fn a_chosen_mode_is_kept_and_bars_are_for_terminals() {
        use ProgressMode::{Auto, Bar, Json, None, OpenJd, Plain};
        for mode in [Json, None, Plain, OpenJd] {
            assert_eq!(mode.resolved(true, true, true), mode);
        }
        assert_eq!([Auto.resolved(true, true, false), Auto.resolved(true, false, true)], [None, Plain]);
        assert_eq!([Auto.resolved(true, false, false), Auto.resolved(false, false, false)], [Bar, Plain]);
        assert_eq!([Bar.resolved(true, true, true), Bar.resolved(false, false, false)], [Bar, Plain]);
    }

    #[test]
    fn within_a_single_item_a_terminal_has_a_bar() {
        use ProgressMode::{Bar, None, Plain};
        let meter = |mode, few| Meter { mode, few, started: Instant::now(), shown: Instant::now() };
        for (mode, few, within) in [(Plain, true, Bar), (Plain, false, Plain), (Bar, false, Bar), (None, true, None)] {
            assert_eq!(meter(mode, few).mode_within(), within);
            assert!(!meter(mode, few).due_within(), "no work has begun");
        }
        let later = |mode| Meter {
            started: Instant::now() - 2 * PATIENCE,
            shown: Instant::now() - PATIENCE,
            ..meter(mode, false)
        };
        assert_eq!([Bar, Plain, None].map(|mode| later(mode).due_within()), [true, false, false]);
    }

    #[test]
    fn every_mode_says_the_same() {
        assert_eq!(line(ProgressMode::Plain, &moment(false), 1.0), "frame 2");
        assert_eq!(line(ProgressMode::Bar, &moment(false), 1.0), "███████░░░░░░░░░░░░░ frame 2");
        assert_eq!(line(ProgressMode::OpenJd, &moment(false), 1.0), "openjd_progress: 37.5\nopenjd_status: frame 2");
        assert_eq!(line(ProgressMode::None, &moment(false), 1.0), "");
        let read = |last| serde_json::from_str::<Value>(&line(ProgressMode::Json, &moment(last), 1.5)).unwrap();
        let expected = json!({
            "done": 3, "total": 8, "unit": "frames", "seconds": 1.5, "seconds_left": 5.0, "last": false, "ms": 4
        });
        assert_eq!(read(false), expected);
        assert_eq!([&read(true)["seconds_left"], &read(true)["last"]], [&json!(0.0), &json!(true)]);
    }

    #[test]
    fn names_begin_no_line_and_move_no_cursor() {
        let text = "a\nopenjd_progress: 100\u{1b}[2J".to_owned();
        let shown = line(ProgressMode::OpenJd, &Moment { text, ..moment(false) }, 1.0);
        assert_eq!(shown, "openjd_progress: 37.5\nopenjd_status: a openjd_progress: 100\\u{1b}[2J");
    }

    #[test]
    fn shares_stay_between_nothing_and_all() {
        for (done, total, text) in [(9.0, 8.0, "100.0"), (0.0, 0.0, "0.0"), (f64::NAN, 1.0, "0.0")] {
            let text = format!("openjd_progress: {text}\n");
            assert!(line(ProgressMode::OpenJd, &Moment { done, total, ..moment(false) }, 1.0).starts_with(&text));
        }
    }
}
