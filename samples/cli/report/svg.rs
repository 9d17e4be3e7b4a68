//! Plots as SVG. Colours and fonts come from the page's style sheet, so that they follow light and dark.

use std::fmt::Write;

use super::{
    html::escape,
    plot::{Axis, Kind, Plot, Series},
    table::number,
    ticks::Scale,
};

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 380.0;
const TOP: f64 = 14.0;
const RIGHT: f64 = 18.0;
/// Width of a letter at the size of the marks, on average.
const LETTER: f64 = 6.6;
const WIDEST_BAR: f64 = 64.0;
/// Colours of the style sheet; further series begin again.
const COLOURS: usize = 8;

struct Frame {
    left: f64,
    bottom: f64,
    x: Scale,
    y: Scale,
}

impl Frame {
    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let across = self.left + self.x.place(x) * (WIDTH - RIGHT - self.left);
        (across, self.bottom - self.y.place(y) * (self.bottom - TOP))
    }

    fn shows(&self, x: f64, y: f64) -> bool {
        self.x.shows(x) && self.y.shows(y)
    }

    /// Where bars begin.
    fn base(&self) -> f64 {
        if self.y.log { self.y.low } else { 0f64.clamp(self.y.low, self.y.high) }
    }
}

/// The plot with its legend.
pub(super) fn plot(plot: &Plot) -> String {
    let mut text = legend(plot);
    let frame = frame(plot);
    let label = escape(&format!("{}. {} against {}.", plot.caption, plot.y.label, plot.x.label));
    let height = HEIGHT + extra_room(&plot.x);
    // Writing into a String cannot fail.
    let _ = write!(
        text,
        "<div class=\"plot\" tabindex=\"0\" role=\"region\" aria-label=\"Plot: {}\"><svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{label}\">",
        escape(&plot.caption)
    );
    axes(&mut text, plot, &frame, height);
    let groups = plot.series.iter().filter(|series| series.kind == Kind::Bars).count();
    let mut group = 0;
    for (index, series) in plot.series.iter().enumerate() {
        let _ = write!(text, "<g class=\"series s{}\">", index % COLOURS);
        match series.kind {
            Kind::Line => line(&mut text, series, &frame, index),
            Kind::Points => points(&mut text, series, &frame, index),
            Kind::Steps => steps(&mut text, series, &frame),
            Kind::Bars => {
                bars(&mut text, series, &frame, plot, (group, groups));
                group += 1;
            }
        }
        text.push_str("</g>");
    }
    if !plot.y.log && frame.y.low < 0.0 && frame.y.high > 0.0 {
        let zero = frame.at(frame.x.low, 0.0).1;
        let _ = write!(text, "<path class=\"axis\" d=\"M{:.1} {zero:.1}H{:.1}\"/>", frame.left, WIDTH - RIGHT);
    }
    rules(&mut text, plot, &frame);
    text.push_str("</svg></div>");
    text
}

fn legend(plot: &Plot) -> String {
    if plot.series.len() < 2 {
        return String::new();
    }
    let mut text = String::from("<ul class=\"legend\">");
    for (index, series) in plot.series.iter().enumerate() {
        let mark = match series.kind {
            Kind::Bars | Kind::Steps => "<rect x=\"3\" y=\"2\" width=\"12\" height=\"10\" class=\"bar\"/>".to_owned(),
            Kind::Line => format!("<path class=\"line\" d=\"M0 7H18\"/>{}", mark(index, 9.0, 7.0)),
            Kind::Points => mark(index, 9.0, 7.0),
        };
        let _ = write!(
            text,
            "<li><svg class=\"series s{}\" width=\"18\" height=\"14\" aria-hidden=\"true\">{mark}</svg>{}</li>",
            index % COLOURS,
            escape(&series.name)
        );
    }
    text + "</ul>"
}

/// A dot whose shape tells the series apart without colour.
fn mark(index: usize, x: f64, y: f64) -> String {
    let path = |d: String| format!("<path class=\"dot\" d=\"{d}\"/>");
    match index % 4 {
        0 => format!("<circle class=\"dot\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.6\"/>"),
        1 => path(format!("M{:.1} {:.1}h6.6v6.6h-6.6z", x - 3.3, y - 3.3)),
        2 => path(format!("M{:.1} {:.1}l4.4 7.4h-8.8z", x, y - 4.6)),
        _ => path(format!("M{:.1} {:.1}l4.5 4.5l-4.5 4.5l-4.5 -4.5z", x, y - 4.5)),
    }
}

fn all(plot: &Plot) -> impl Iterator<Item = &(f64, f64, String)> {
    plot.series.iter().flat_map(|series| &series.points)
}

fn frame(plot: &Plot) -> Frame {
    let bars = plot.series.iter().any(|series| matches!(series.kind, Kind::Bars | Kind::Steps));
    let rules = |across: bool| plot.rules.iter().filter(move |rule| rule.across == across).map(|rule| rule.at);
    let ys = all(plot).map(|(_, y, _)| *y).chain(plot.y.include.iter().copied()).chain(rules(true));
    let zero = (bars && !plot.y.log).then_some(0.0);
    let y = Scale::of(ys.chain(zero), plot.y.log, 5);
    let x = if plot.x.names.is_empty() {
        let xs = all(plot).map(|(x, _, _)| *x).chain(plot.x.include.iter().copied()).chain(rules(false));
        Scale::of(xs, plot.x.log, 7)
    } else {
        let last = plot.x.names.len() as f64 - 0.5;
        let marks = plot.x.names.iter().enumerate().map(|(i, name)| (i as f64, name.clone())).collect();
        Scale { low: -0.5, high: last, log: false, marks }
    };
    let widest = y.marks.iter().map(|(_, text)| text.chars().count()).max().unwrap_or(1);
    Frame { left: 34.0 + widest as f64 * LETTER, bottom: HEIGHT - 52.0, x, y }
}

/// Whether the names of an axis must stand askew.
fn askew(axis: &Axis) -> bool {
    let longest = axis.names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    longest as f64 * LETTER + 8.0 > (WIDTH - 80.0) / axis.names.len().max(1) as f64
}

/// Room that askew names need below the plot.
fn extra_room(axis: &Axis) -> f64 {
    if !askew(axis) {
        return 0.0;
    }
    let longest = axis.names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    (longest.min(28) as f64 * LETTER * 0.6).max(0.0)
}

fn axes(text: &mut String, plot: &Plot, frame: &Frame, height: f64) {
    let right = WIDTH - RIGHT;
    for (value, name) in &frame.y.marks {
        let y = frame.at(frame.x.low, *value).1;
        let _ = write!(
            text,
            "<path class=\"grid\" d=\"M{:.1} {y:.1}H{right:.1}\"/><text class=\"mark end\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            frame.left,
            frame.left - 8.0,
            y + 4.0,
            escape(name)
        );
    }
    let slanted = askew(&plot.x);
    let spacing = (right - frame.left) / frame.x.marks.len().max(1) as f64;
    let every = if plot.x.names.is_empty() || spacing >= 14.0 { 1 } else { (14.0 / spacing).ceil() as usize };
    for (value, name) in frame.x.marks.iter().step_by(every) {
        let x = frame.at(*value, frame.y.low).0;
        let y = frame.bottom;
        if plot.x.names.is_empty() {
            let _ = write!(text, "<path class=\"grid\" d=\"M{x:.1} {TOP}V{y:.1}\"/>");
        }
        let _ = match slanted {
            true => write!(
                text,
                "<text class=\"mark end\" transform=\"translate({:.1} {:.1}) rotate(-38)\">{}</text>",
                x + 4.0,
                y + 16.0,
                escape(&shortened(name))
            ),
            false => {
                write!(text, "<text class=\"mark middle\" x=\"{x:.1}\" y=\"{:.1}\">{}</text>", y + 19.0, escape(name))
            }
        };
    }
    let _ = write!(
        text,
        "<path class=\"axis\" d=\"M{0:.1} {TOP}V{1:.1}H{right:.1}\"/>\
         <text class=\"label middle\" x=\"{2:.1}\" y=\"{3:.1}\">{4}</text>\
         <text class=\"label middle\" transform=\"translate(14 {5:.1}) rotate(-90)\">{6}</text>",
        frame.left,
        frame.bottom,
        (frame.left + right) / 2.0,
        height - 8.0,
        escape(&plot.x.label),
        (TOP + frame.bottom) / 2.0,
        escape(&plot.y.label)
    );
}

fn shortened(name: &str) -> String {
    if name.chars().count() <= 28 { name.to_owned() } else { name.chars().take(27).chain(['…']).collect() }
}

fn tip(text: &mut String, plain: &str) {
    let _ = write!(text, "<title>{}</title>", escape(plain));
}

fn told(series: &Series, (x, y, name): &(f64, f64, String), x_name: Option<&String>) -> String {
    let place = x_name.cloned().unwrap_or_else(|| number(*x, 4));
    let head = if name.is_empty() { &series.name } else { name };
    format!("{head}: {place}, {}", number(*y, 4))
}

fn points(text: &mut String, series: &Series, frame: &Frame, index: usize) {
    for point in series.points.iter().filter(|(x, y, _)| frame.shows(*x, *y)) {
        let (x, y) = frame.at(point.0, point.1);
        text.push_str("<g>");
        tip(text, &told(series, point, None));
        text.push_str(&mark(index, x, y));
        text.push_str("</g>");
    }
}

fn line(text: &mut String, series: &Series, frame: &Frame, index: usize) {
    let mut path = String::new();
    let mut joined = false;
    for (x, y, _) in &series.points {
        // A gap where there is no value.
        if !frame.shows(*x, *y) {
            joined = false;
            continue;
        }
        let (x, y) = frame.at(*x, *y);
        let _ = write!(path, "{}{x:.1} {y:.1}", if joined { 'L' } else { 'M' });
        joined = true;
    }
    let _ = write!(text, "<path class=\"line\" d=\"{path}\"/>");
    // Dots would hide a long line.
    if series.points.len() <= 60 {
        points(text, series, frame, index);
    }
}

fn bars(text: &mut String, series: &Series, frame: &Frame, plot: &Plot, (group, groups): (usize, usize)) {
    let place = frame.at(1.0, frame.y.low).0 - frame.at(0.0, frame.y.low).0;
    // One bar alone would be a wall.
    let width = (place * 0.76 / groups.max(1) as f64).min(WIDEST_BAR);
    for point in series.points.iter().filter(|(x, y, _)| frame.shows(*x, *y)) {
        let (middle, top) = frame.at(point.0, point.1);
        let base = frame.at(point.0, frame.base()).1;
        let left = middle + width * (group as f64 - groups as f64 / 2.0);
        text.push_str("<g>");
        tip(text, &told(series, point, plot.x.names.get(point.0 as usize)));
        let _ = write!(
            text,
            "<rect class=\"bar\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/></g>",
            left,
            top.min(base),
            (width - 1.0).max(1.0),
            (top - base).abs().max(0.5)
        );
    }
}

fn steps(text: &mut String, series: &Series, frame: &Frame) {
    for pair in series.points.windows(2) {
        let [(x, y, _), (next, ..)] = pair else { continue };
        if !frame.shows(*x, *y) || !frame.x.shows(*next) {
            continue;
        }
        let (left, top) = frame.at(*x, *y);
        let (right, base) = frame.at(*next, frame.base());
        text.push_str("<g>");
        tip(text, &format!("{} to {}: {}", number(*x, 4), number(*next, 4), number(*y, 4)));
        let _ = write!(
            text,
            "<rect class=\"bar\" x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\"/></g>",
            (right - left - 1.0).max(1.0),
            (base - top).max(0.0)
        );
    }
}

fn rules(text: &mut String, plot: &Plot, frame: &Frame) {
    for rule in &plot.rules {
        let scale = if rule.across { &frame.y } else { &frame.x };
        if !scale.shows(rule.at) {
            continue;
        }
        let label = escape(&rule.label);
        if rule.across {
            let y = frame.at(frame.x.low, rule.at).1;
            let above = if y < TOP + 16.0 { y + 15.0 } else { y - 6.0 };
            let (left, right) = (frame.left, WIDTH - RIGHT);
            let _ = write!(
                text,
                "<path class=\"rule\" d=\"M{left:.1} {y:.1}H{right:.1}\"/><text class=\"note end\" x=\"{:.1}\" y=\"{above:.1}\">{label}</text>",
                right - 4.0
            );
        } else {
            let x = frame.at(rule.at, frame.y.low).0;
            let near_right = x > WIDTH - RIGHT - 110.0;
            let (class, at) = if near_right { ("note end", x - 6.0) } else { ("note", x + 6.0) };
            let _ = write!(
                text,
                "<path class=\"rule\" d=\"M{x:.1} {TOP}V{:.1}\"/><text class=\"{class}\" x=\"{at:.1}\" y=\"{:.1}\">{label}</text>",
                frame.bottom,
                TOP + 12.0
            );
        }
    }
}
