//! Frames between others: the adaptive interval (section 3.2, figure 6) and interpolation (section 4.2, figure 8).

use lucerna::{Result, measure::Picture};

use super::{
    SIDE,
    day::{Day, relative_rms},
};
use crate::report::{Axis, Comparison, Plot, Section, Table};

/// Seconds of a minute and of an hour.
const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;
/// Kept frames of the comparison of interpolations: each one of so many.
const GAPS: [usize; 4] = [2, 3, 6, 12];
/// What log-linear interpolation adds, as a share of the frame's mean: the logarithm of no light is not finite.
const FLOOR: f64 = 1e-4;

/// What decides whether an interval is halved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Test {
    /// The interpolated middle frame differs visibly from one of the interval's ends, as in the paper.
    Ends,
    /// The interpolated middle frame differs visibly from the true one.
    Middle,
}

impl Test {
    const ALL: [Self; 2] = [Self::Ends, Self::Middle];

    fn name(self) -> &'static str {
        match self {
            Self::Ends => "ends (paper)",
            Self::Middle => "true middle frame",
        }
    }

    /// Whether the middle of an interval is needed.
    fn splits(self, day: &Day, [first, middle, last]: [usize; 3]) -> Result<bool> {
        let between = interpolated(day, How::Linear, &[first, last], middle);
        let others = match self {
            Self::Ends => vec![first, last],
            Self::Middle => vec![middle],
        };
        for other in others {
            if day.pdiff(&day.frame(other), &between)?.detail("different") == Some(1.0) {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// The lit times whose frames are rendered, in order: two halves of the lit day, halved on.
fn needed(day: &Day, test: Test) -> Result<Vec<usize>> {
    let last = day.len() - 1;
    // The middle is rounded down to the grid of steps.
    let mut open = vec![[0, last / 2], [last / 2, last]];
    let mut kept = vec![0, last / 2, last];
    while let Some([first, last]) = open.pop() {
        let middle = (first + last) / 2;
        if last - first < 2 || !test.splits(day, [first, middle, last])? {
            continue;
        }
        kept.push(middle);
        open.extend([[first, middle], [middle, last]]);
    }
    kept.sort_unstable();
    kept.dedup();
    Ok(kept)
}

/// How a frame between two others is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum How {
    Linear,
    CatmullRom,
    LogLinear,
}

impl How {
    const ALL: [Self; 3] = [Self::Linear, Self::CatmullRom, Self::LogLinear];

    fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::CatmullRom => "Catmull-Rom",
            Self::LogLinear => "log-linear",
        }
    }
}

/// The frame at lit time `t` from the `kept` ones around it. The curve of Catmull and Rom needs two kept frames on both sides that are equally
/// far apart; elsewhere it is the line.
fn interpolated(day: &Day, how: How, kept: &[usize], t: usize) -> Picture {
    let next = kept.partition_point(|frame| *frame <= t).clamp(1, kept.len() - 1);
    let (before, after) = (kept[next - 1], kept[next]);
    let step = day.seconds[after] - day.seconds[before];
    let a = ((day.seconds[t] - day.seconds[before]) / step) as f32;
    let (first, last) = (day.frame(before), day.frame(after));
    let pairs = || first.pixels.iter().zip(&last.pixels);
    let even = |x: usize, y: usize| (day.seconds[y] - day.seconds[x] - step).abs() < 1.0;
    let around = next.checked_sub(2).map(|at| kept[at]).zip(kept.get(next + 1).copied());
    let around = around.filter(|(x, y)| even(*x, before) && even(after, *y));
    let pixels = match (how, around) {
        (How::LogLinear, _) => {
            let floor = |picture: &Picture| (FLOOR * super::day::mean(&picture.pixels)).max(1e-12) as f32;
            let (low, high) = (floor(&first), floor(&last));
            let mix = |x: f32, y: f32| {
                let light = ((1.0 - a) * (x + low).ln() + a * (y + high).ln()).exp();
                (light - ((1.0 - a) * low.ln() + a * high.ln()).exp()).max(0.0)
            };
            pairs().map(|(x, y)| std::array::from_fn(|c| mix(x[c], y[c]))).collect()
        }
        (How::CatmullRom, Some((x, y))) => {
            let (a2, a3) = (a * a, a * a * a);
            let weights = [
                0.5 * (-a + 2.0 * a2 - a3),
                0.5 * (2.0 - 5.0 * a2 + 3.0 * a3),
                0.5 * (a + 4.0 * a2 - 3.0 * a3),
                0.5 * (a3 - a2),
            ];
            let four = [day.frame(x), first, last, day.frame(y)];
            let sum = |i: usize, c: usize| (0..4).map(|k| weights[k] * four[k].pixels[i][c]).sum::<f32>().max(0.0);
            (0..day.width * day.height).map(|i| std::array::from_fn(|c| sum(i, c))).collect()
        }
        _ => pairs().map(|(x, y)| std::array::from_fn(|c| (1.0 - a) * x[c] + a * y[c])).collect(),
    };
    day.picture(pixels)
}

/// Errors of all frames that are not kept: root mean squares over the means (of bright frames), %, and shares of pixels that differ visibly, %.
struct Errors {
    rms: Vec<f64>,
    pdiff: Vec<f64>,
    different: usize,
}

fn errors(day: &Day, how: How, kept: &[usize]) -> Result<Errors> {
    let mut errors = Errors { rms: Vec::new(), pdiff: Vec::new(), different: 0 };
    for t in (kept[0]..=kept[kept.len() - 1]).filter(|t| kept.binary_search(t).is_err()) {
        let (truth, test) = (day.frame(t), interpolated(day, how, kept, t));
        let seen = day.pdiff(&truth, &test)?;
        if day.is_bright(t) {
            errors.rms.push(relative_rms(&truth, &test));
        }
        errors.different += usize::from(seen.detail("different") == Some(1.0));
        errors.pdiff.push(seen.value);
    }
    for list in [&mut errors.rms, &mut errors.pdiff] {
        list.sort_by(f64::total_cmp);
    }
    Ok(errors)
}

fn middle(sorted: &[f64]) -> Option<f64> {
    sorted.get(sorted.len() / 2).copied()
}

pub(super) fn adaptive(days: &[Day]) -> Result<Section> {
    let mut section = Section::new("Figure 6: the adaptive interval through the day");
    section.text(
        "Two halves of the lit day are halved on, on the grid of steps, as long as the interpolated middle frame is noticeably different. The paper \
         compares it with the frames at the *ends* of the interval; the second test compares it with the *true middle frame*, which costs that frame even if it is not needed (a cheap small frame serves as well). The paper's test does not see \
         an event between two equal ends, and it halves where light changes evenly, although a line is right there. PerceptualDiff judges at one exposure \
         for the whole day. In the paper the interval is from 5 to 30 minutes; it gives no number of frames.",
    );
    let columns = [
        "scene",
        "test",
        "frames needed",
        "lit frames",
        "saved (%)",
        "shortest (min)",
        "longest (min)",
        "left-out frames that differ visibly",
        "worst PDiff (%)",
        "median RMS / mean (%)",
        "worst RMS / mean (%)",
    ];
    let mut table = Table::new("adaptive", "Frames that the tests need", columns);
    table.push(
        ["paper".into(), Test::Ends.name().into(), Option::<f64>::None.into(), 180usize.into()].into_iter().chain([
            Option::<f64>::None.into(),
            5usize.into(),
            30usize.into(),
        ]),
    );
    let (x, y) = (Axis::new("hours after midnight"), Axis::new("interval (min)").log());
    let mut plot = Plot::new("figure-6", "Interval between rendered frames (as figure 6 of the paper)", x, y);
    for day in days {
        for test in Test::ALL {
            let kept = needed(day, test)?;
            let intervals: Vec<[f64; 2]> =
                kept.windows(2).map(|pair| [day.seconds[pair[0]], day.seconds[pair[1]]]).collect();
            let lengths = || intervals.iter().map(|[from, to]| (to - from) / MINUTE);
            let left = errors(day, How::Linear, &kept)?;
            table.push([
                day.name.as_str().into(),
                test.name().into(),
                kept.len().into(),
                day.len().into(),
                (100.0 * (1.0 - kept.len() as f64 / day.len() as f64)).into(),
                lengths().fold(f64::INFINITY, f64::min).into(),
                lengths().fold(0.0, f64::max).into(),
                left.different.into(),
                left.pdiff.last().copied().into(),
                middle(&left.rms).into(),
                left.rms.last().copied().into(),
            ]);
            let steps = intervals.iter().flat_map(|[from, to]| [from, to].map(|at| (at / HOUR, (to - from) / MINUTE)));
            plot = plot.line(format!("{}, {}", day.name, test.name()), steps);
        }
    }
    section.add(table);
    section.add(plot);
    Ok(section)
}

pub(super) fn interpolation(days: &[Day]) -> Result<Section> {
    let mut section = Section::new("Figure 8: interpolated against true frame");
    section.text(
        "Each second, third, sixth and twelfth frame of the day is kept, and all others are interpolated between the kept ones. The paper shows one frame, \
         interpolated linearly, without a visibly different pixel, and expects little of other functions.",
    );
    let columns = [
        "scene",
        "kept every (min)",
        "interpolation",
        "frames",
        "median RMS / mean (%)",
        "worst RMS / mean (%)",
        "median PDiff (%)",
        "worst PDiff (%)",
        "frames that differ visibly",
    ];
    let mut table = Table::new("interpolation", "Errors of interpolated frames", columns);
    let (x, y) = (Axis::new("kept every (min)").log(), Axis::new("median RMS / mean (%)").log());
    let mut plot = Plot::new("interpolation-plot", "Error against the interval", x, y);
    for day in days {
        for how in How::ALL {
            let mut line = Vec::new();
            for gap in GAPS {
                let kept: Vec<usize> = (0..day.len()).step_by(gap).collect();
                if kept.len() < 2 {
                    continue;
                }
                let minutes = (day.seconds[kept[1]] - day.seconds[kept[0]]) / MINUTE;
                let found = errors(day, how, &kept)?;
                table.push([
                    day.name.as_str().into(),
                    minutes.into(),
                    how.name().into(),
                    found.pdiff.len().into(),
                    middle(&found.rms).into(),
                    found.rms.last().copied().into(),
                    middle(&found.pdiff).into(),
                    found.pdiff.last().copied().into(),
                    found.different.into(),
                ]);
                line.extend(middle(&found.rms).map(|rms| (minutes, rms)));
            }
            plot = plot.line(format!("{}, {}", day.name, how.name()), line);
        }
    }
    section.add(table);
    section.add(plot);
    for day in days {
        // An odd frame lies between two that are kept.
        let t = (day.frame_121() | 1).min(day.len() - 2);
        let kept: Vec<usize> = (0..day.len()).step_by(2).collect();
        let title = format!("{}: {}, from the frames before and after", day.name, day.label(t));
        let mut set = Comparison::new(format!("{}-between", day.id), title, day.width as u32, day.height as u32)
            .exposure(day.stops())
            .with("true frame", day.frame(t).pixels);
        for how in How::ALL {
            set = set.with(how.name(), interpolated(day, how, &kept, t).pixels);
        }
        section.add(set.at_most(SIDE));
    }
    Ok(section)
}
