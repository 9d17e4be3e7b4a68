//! Lamps of an export: when they burn, as numbers that other programs read.

use lucerna::{
    Result,
    techniques::daylight::{Course, Group, PictureSettings, Plan, Settings, lamps},
};
use serde_json::{Value, json};

use super::DayExportArgs;

/// Seconds between two looks at the schedule.
const LOOK: f64 = 10.0;
/// Difference from a line that is kept.
const APART: f64 = 1e-4;
/// Seconds within which a lamp is switched.
const SWITCHING: f64 = 1e-3;

/// The lamps of a bake and their schedule.
pub struct Lamps {
    groups: Vec<Group>,
    settings: Settings,
}

impl Lamps {
    /// # Errors
    /// `Usage` if the options cannot be.
    pub fn new(args: &DayExportArgs, plan: &Plan) -> Result<Self> {
        let settings = Settings { lamps: args.lamps.clone(), dusk: args.dusk, ..Settings::default() };
        let checked = PictureSettings { daylight: settings.clone(), ..PictureSettings::default() };
        lucerna::technique::Settings::validate(&checked).map_err(|error| error.at("--dusk"))?;
        Ok(Self { groups: if args.no_lamps { Vec::new() } else { plan.lamps.clone() }, settings })
    }

    /// Whether the export has lamps.
    pub fn is_there(&self) -> bool {
        !self.groups.is_empty()
    }

    /// How bright each group burns, 0 to 1.
    ///
    /// # Errors
    /// `Usage`, naming the option, if the schedule cannot be read.
    pub fn burning(&self, course: &Course, seconds: f64) -> Result<Vec<f32>> {
        let elevation = f64::from(course.sun(seconds).direction[1]).clamp(-1.0, 1.0).asin().to_degrees();
        lamps::burning(&self.settings, &self.groups, course, seconds, elevation).map_err(|error| error.at("--lamps"))
    }

    /// The groups for the table: their names, and the numbers of their emissive materials in the scene.
    pub fn listed(&self) -> Value {
        let listed = self.groups.iter().map(|group| json!({ "name": group.name, "materials": group.materials }));
        json!(listed.collect::<Vec<_>>())
    }

    /// For each group when it burns on a day: pairs of seconds and brightness, between which it is on the line.
    ///
    /// # Errors
    /// As [`Self::burning`].
    pub fn switches(&self, course: &Course) -> Result<Value> {
        let at = |group: usize, seconds: f64| Ok(f64::from(self.burning(course, seconds)?[group]));
        let mut out = Vec::new();
        for group in 0..self.groups.len() {
            let of = |seconds: f64| at(group, seconds);
            let mut points = vec![[0.0, of(0.0)?]];
            let count = (course.length() / LOOK).ceil() as usize;
            for look in 0..count {
                let begin = LOOK * look as f64;
                let end = (begin + LOOK).min(course.length());
                follow(&of, [begin, points[points.len() - 1][1]], [end, of(end)?], &mut points)?;
            }
            out.push(json!(without_even(&points)));
        }
        Ok(json!(out))
    }
}

/// Appends the points of a curve from `begin`, which is there already, to `end`.
fn follow(of: &impl Fn(f64) -> Result<f64>, begin: [f64; 2], end: [f64; 2], points: &mut Vec<[f64; 2]>) -> Result<()> {
    let [from, to] = [begin[0], end[0]];
    if to - from > SWITCHING {
        let part = |share: f64| from + share * (to - from);
        let mut straight = true;
        for share in [0.25, 0.5, 0.75] {
            let line = begin[1] + share * (end[1] - begin[1]);
            straight &= (of(part(share))? - line).abs() <= APART;
        }
        if !straight {
            let middle = [part(0.5), of(part(0.5))?];
            follow(of, begin, middle, points)?;
            return follow(of, middle, end, points);
        }
    }
    points.push(end);
    Ok(())
}

/// The points without those that lie between two of the same brightness.
fn without_even(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let inner = points.windows(3).filter(|of| !(of[0][1] == of[1][1] && of[1][1] == of[2][1])).map(|of| of[1]);
    let (first, last) = (points.first().copied(), points.last().copied());
    first.into_iter().chain(inner).chain(last).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn switches_follow_ramps_and_jumps() {
        let curve = |t: f64| Ok(if t < 33.3 { 0.0 } else { ((t - 61.7) / 20.0).clamp(0.25, 1.0) });
        let mut points = vec![[0.0, 0.0]];
        for look in 0..20 {
            let begin = points[points.len() - 1][1];
            let [a, b] = [LOOK * f64::from(look), LOOK * f64::from(look + 1)];
            follow(&curve, [a, begin], [b, curve(b).unwrap()], &mut points).unwrap();
        }
        let points = without_even(&points);
        assert!(points.len() < 40, "{} points", points.len());
        let read = |t: f64| {
            let after = points.iter().position(|point| point[0] > t).unwrap_or(points.len() - 1).max(1);
            let [a, b] = [points[after - 1], points[after]];
            a[1] + (b[1] - a[1]) * (t - a[0]) / (b[0] - a[0])
        };
        for step in 0..2000 {
            let t = 0.1 * f64::from(step) + 0.013;
            assert!((read(t) - curve(t).unwrap()).abs() <= 2.0 * APART, "{t}: {} {}", read(t), curve(t).unwrap());
        }
    }
}
