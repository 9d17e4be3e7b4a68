//! The baked times around a moment and their weights (Bahnsen et al. 2012, equations 1 to 3).
//!
//! Equation 3 of the paper counts minutes within the hour: it is wrong if the interval does not divide 60 minutes, or with an offset. Here x
//! is the elapsed time of the day, so that N = ⌊x⌋ and α = x − N hold for any interval and offset, for unequal steps, and on days on which the
//! clock changes. After the last time follows the first one of the next day, so α is continuous over midnight.

use super::{Course, Interpolation, NEXT_DAY, Plan};

/// A baked time and its weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weight {
    /// Number of the time in [`Plan::times`].
    pub time: usize,
    pub weight: f32,
}

/// The baked times around a moment.
#[derive(Clone, Debug, PartialEq)]
pub enum Mixture {
    /// A weighted sum of the light of some times; no times: no light.
    Sum(Vec<Weight>),
    /// The light at `times[0]` to the power of 1 − `alpha`, times that at `times[1]` to the power of `alpha`.
    Logarithms { times: [usize; 2], alpha: f32 },
}

impl Mixture {
    /// The times, in order of the day.
    pub fn times(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        let (of_sum, of_both) = match self {
            Self::Sum(weights) => (weights.as_slice(), &[][..]),
            Self::Logarithms { times, .. } => (&[][..], times.as_slice()),
        };
        of_sum.iter().map(|weight| weight.time).chain(of_both.iter().copied())
    }

    /// Times with weights; the line in place of the logarithms.
    pub fn linear(&self) -> Vec<(usize, f32)> {
        match self {
            Self::Sum(weights) => weights.iter().map(|of| (of.time, of.weight)).collect(),
            Self::Logarithms { times: [before, after], alpha } => vec![(*before, 1.0 - alpha), (*after, *alpha)],
        }
    }
}

/// The baked times of a day as a circle.
#[derive(Clone, Debug)]
pub struct Steps {
    /// The number of the first time in [`Plan::times`].
    first: usize,
    /// Seconds after the begin of the day, in order.
    seconds: Vec<f64>,
    /// Whether the sun is set between this time and the next one; the last time has the first one of the next day for its next.
    night: Vec<bool>,
    /// Seconds of the day.
    length: f64,
}

impl Steps {
    /// The times of a day of a bake.
    pub fn new(plan: &Plan, day: usize, course: &Course) -> Self {
        let times = plan.of_day(day);
        let seconds = plan.times[times.clone()].iter().map(|time| time.seconds - NEXT_DAY * day as f64).collect();
        let mut steps = Self::of(seconds, course.length(), |seconds| course.sun(seconds).is_lit());
        // A part of a day has no light between its end and its begin on the next day.
        if plan.calendar.span.is_some()
            && let Some(last) = steps.night.last_mut()
        {
            *last = true;
        }
        Self { first: times.start, ..steps }
    }

    /// `lit`: whether the sun shines at a time.
    fn of(seconds: Vec<f64>, length: f64, lit: impl Fn(f64) -> bool) -> Self {
        let count = seconds.len();
        let night = (0..count).map(|i| {
            let next = if i + 1 < count { seconds[i + 1] } else { seconds[0] + length };
            !lit(0.5 * (seconds[i] + next))
        });
        Self { first: 0, night: night.collect(), seconds, length }
    }

    /// The times after which it is night until the next one, as numbers among the times of the day.
    pub fn nights(&self) -> impl Iterator<Item = usize> + '_ {
        self.night.iter().enumerate().filter(|(_, night)| **night).map(|(number, _)| number)
    }

    /// The time of a number that may lie on a neighbouring day.
    fn at(&self, number: isize) -> f64 {
        let count = self.seconds.len() as isize;
        self.seconds[number.rem_euclid(count) as usize] + number.div_euclid(count) as f64 * self.length
    }

    fn index(&self, number: isize) -> usize {
        number.rem_euclid(self.seconds.len() as isize) as usize
    }

    /// The time at or before a moment, and the share of the way to the next one (N and α of the paper); `None` without times.
    pub fn place(&self, seconds: f64) -> Option<(usize, f64)> {
        let (before, alpha) = self.between(seconds)?;
        Some((self.index(before), alpha))
    }

    fn between(&self, seconds: f64) -> Option<(isize, f64)> {
        if self.seconds.is_empty() {
            return None;
        }
        let seconds = seconds.rem_euclid(self.length);
        let before = self.seconds.partition_point(|time| *time <= seconds) as isize - 1;
        let (first, last) = (self.at(before), self.at(before + 1));
        // Rounding must not make it 1: then the next time would be N.
        Some((before, ((seconds - first) / (last - first)).clamp(0.0, 1.0 - f64::EPSILON)))
    }

    /// The baked times around a moment, seconds after the begin of the day.
    ///
    /// Between the last lit time of an evening and the first one of the next morning the nearer one has all the weight: their light has
    /// nothing in common, and what the sun sends then comes from the moments after the one and before the other.
    pub fn mixture(&self, seconds: f64, how: Interpolation) -> Mixture {
        let sum = |weights: Vec<(isize, f64)>| {
            let weight = |(number, weight): (isize, f64)| Weight {
                time: self.first + self.index(number),
                weight: weight as f32,
            };
            Mixture::Sum(weights.into_iter().map(weight).collect())
        };
        let Some((before, alpha)) = self.between(seconds) else { return Mixture::Sum(Vec::new()) };
        let nearest = if alpha < 0.5 { before } else { before + 1 };
        if self.night[self.index(before)] {
            return sum(vec![(nearest, 1.0)]);
        }
        match how {
            Interpolation::Nearest => sum(vec![(nearest, 1.0)]),
            Interpolation::Linear => sum(vec![(before, 1.0 - alpha), (before + 1, alpha)]),
            Interpolation::CatmullRom => sum(self.catmull_rom(before, alpha)),
            Interpolation::LogLinear => Mixture::Logarithms {
                times: [before, before + 1].map(|step| self.first + self.index(step)),
                alpha: alpha as f32,
            },
        }
    }

    /// Weights of four times: the cubic through the inner two whose slopes there are those between their neighbours. Times may be uneven. Over
    /// a night there are no slopes: the line's takes their place.
    fn catmull_rom(&self, before: isize, alpha: f64) -> Vec<(isize, f64)> {
        let (a, a2, a3) = (alpha, alpha * alpha, alpha * alpha * alpha);
        let length = self.at(before + 1) - self.at(before);
        // Hermite's basis; slopes are for the whole length.
        let [value_before, value_after] = [1.0 - 3.0 * a2 + 2.0 * a3, 3.0 * a2 - 2.0 * a3];
        let [slope_before, slope_after] = [a - 2.0 * a2 + a3, a3 - a2];
        let mut weights = [0.0, value_before, value_after, 0.0];
        let mut add = |from: isize, slope: f64| {
            let scale = slope * length / (self.at(before + from + 1) - self.at(before + from - 1));
            weights[from as usize] -= scale;
            weights[from as usize + 2] += scale;
        };
        let day_before = !self.night[self.index(before - 1)];
        let day_after = !self.night[self.index(before + 1)];
        if day_before {
            add(0, slope_before);
        }
        if day_after {
            add(1, slope_after);
        }
        for (there, slope) in [(day_before, slope_before), (day_after, slope_after)] {
            if !there {
                weights[1] -= slope;
                weights[2] += slope;
            }
        }
        let all = (-1..3).zip(weights).map(|(step, weight)| (before + step, weight));
        all.filter(|(_, weight)| *weight != 0.0).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::techniques::daylight::Day;

    /// Elevation at which the sun has set, degrees.
    const SET: f64 = -0.2665;

    /// Sums of the weights by time.
    fn dense(steps: &Steps, seconds: f64, how: Interpolation) -> Vec<f64> {
        let mut out = vec![0.0; steps.seconds.len()];
        match steps.mixture(seconds, how) {
            Mixture::Sum(weights) => weights.iter().for_each(|w| out[w.time] += f64::from(w.weight)),
            Mixture::Logarithms { times, alpha } => {
                out[times[0]] += 1.0 - f64::from(alpha);
                out[times[1]] += f64::from(alpha);
            }
        }
        out
    }

    const ALL: [Interpolation; 3] = [Interpolation::Linear, Interpolation::CatmullRom, Interpolation::LogLinear];

    /// A polar day: the sun shines always, so that all steps are there.
    fn polar(date: &str, zone: &str, interval: f64, offset: f64) -> (Steps, Day) {
        let day = Day::new(date, zone, 85.0, 10.0).unwrap();
        let seconds = day.steps(interval, offset).unwrap();
        (Steps::of(seconds, day.length(), |seconds| day.sun(seconds).elevation > SET), day)
    }

    #[test]
    fn the_share_is_in_range_and_the_weights_are_continuous_over_borders_midnight_and_changes_of_the_clock() {
        // 2026-03-29 has 23 hours and 2026-10-25 has 25 in Copenhagen. The sun sets on these days, so the nights are made lit.
        for (date, lit_always) in [("2026-06-21", false), ("2026-03-29", true), ("2026-10-25", true)] {
            for (interval, offset) in [(5.0, 0.0), (5.0, 4.5), (7.0, 0.0), (30.0, 17.0), (90.0, 0.0), (90.0, 17.0)] {
                let (mut steps, day) = polar(date, "Europe/Copenhagen", interval, offset);
                if lit_always {
                    steps.night.fill(false);
                }
                assert!(steps.night.iter().all(|night| !night), "{date}");
                let shortest = (0..steps.seconds.len() as isize).map(|i| steps.at(i + 1) - steps.at(i));
                let shortest = shortest.fold(f64::INFINITY, f64::min);
                for how in ALL {
                    let delta = 3.0;
                    let mut last = dense(&steps, -delta, how);
                    let mut moment = 0.0;
                    while moment < day.length() + 600.0 {
                        let (_, alpha) = steps.place(moment).unwrap();
                        assert!((0.0..1.0).contains(&alpha), "{alpha}");
                        let now = dense(&steps, moment, how);
                        assert!((now.iter().sum::<f64>() - 1.0).abs() < 1e-6, "{how:?} at {moment}");
                        let change = now.iter().zip(&last).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                        // A cubic is steeper than a line, by up to a half where steps are even.
                        assert!(
                            change <= 2.5 * delta / shortest + 1e-6,
                            "{date} {interval} {offset} {how:?} {moment}: {change}"
                        );
                        (last, moment) = (now, moment + delta);
                    }
                }
            }
        }
    }

    #[test]
    fn shares_are_those_of_elapsed_time() {
        let (steps, _) = polar("2026-06-21", "UTC", 5.0, 0.0);
        assert_eq!(steps.place(7.0 * 3600.0 + 42.0 * 60.0 + 30.0), Some((92, 0.5)));
        // The paper's equation 3 gives other shares here: minute 10 of the hour is 50 minutes after the step of 3:20 before.
        let (steps, _) = polar("2026-06-21", "UTC", 90.0, 20.0);
        let (number, alpha) = steps.place(4.0 * 3600.0 + 10.0 * 60.0).unwrap();
        assert_eq!(number, 2);
        assert!((alpha - 50.0 / 90.0).abs() < 1e-12);
        // Midnight lies between the last step and the first of the next day.
        let (number, alpha) = steps.place(0.0).unwrap();
        assert_eq!(number, 15);
        assert!((alpha - 70.0 / 90.0).abs() < 1e-12, "{alpha}");
        // The last gap is shorter: 1440 = 205 · 7 + 5.
        let (steps, _) = polar("2026-06-21", "UTC", 7.0, 0.0);
        assert_eq!(steps.place(1437.5 * 60.0), Some((205, 0.5)));
        // The day on which the clock goes forward: 4:00 comes three hours after midnight.
        let (steps, day) = polar("2026-03-29", "Europe/Copenhagen", 90.0, 0.0);
        assert_eq!(steps.place(day.parse_time("04:00").unwrap()), Some((2, 0.0)));
    }

    #[test]
    fn at_a_baked_time_it_has_all_the_weight() {
        let (steps, _) = polar("2026-06-21", "UTC", 7.0, 3.0);
        for (number, seconds) in steps.seconds.clone().into_iter().enumerate() {
            for how in [Interpolation::Nearest].into_iter().chain(ALL) {
                let weights = dense(&steps, seconds, how);
                let others =
                    weights.iter().enumerate().filter(|(at, _)| *at != number).map(|(_, w)| w.abs()).sum::<f64>();
                assert!(weights[number] == 1.0 && others == 0.0, "{how:?} {number}: {weights:?}");
            }
        }
    }

    #[test]
    fn a_cubic_in_time_is_met_by_lines_for_lines_and_by_curves_for_parabolas() {
        let uneven = vec![0.0, 100.0, 150.0, 300.0, 420.0, 500.0];
        let steps = Steps::of(uneven.clone(), 600.0, |_| true);
        let value = |how, seconds: f64, of: &dyn Fn(f64) -> f64| -> f64 {
            dense(&steps, seconds, how).iter().zip(&uneven).map(|(weight, time)| weight * of(*time)).sum()
        };
        for seconds in [160.0, 222.0, 299.0] {
            let line = |t: f64| 3.0 - 0.01 * t;
            for how in [Interpolation::Linear, Interpolation::CatmullRom] {
                assert!((value(how, seconds, &line) - line(seconds)).abs() < 1e-6, "{how:?} {seconds}");
            }
        }
        // With even steps slopes of parabolas are exact.
        let even: Vec<f64> = (0..12).map(|i| 50.0 * f64::from(i)).collect();
        let steps = Steps::of(even.clone(), 600.0, |_| true);
        let parabola = |t: f64| 1.0 + t * t * 1e-4;
        let found: f64 =
            dense(&steps, 222.0, Interpolation::CatmullRom).iter().zip(&even).map(|(w, t)| w * parabola(*t)).sum();
        assert!((found - parabola(222.0)).abs() < 1e-5, "{found}");
    }

    #[test]
    fn nights_are_not_mixed_and_no_times_are_no_light() {
        // Lit from 6 to 18 o'clock.
        let lit = |seconds: f64| (21_600.0..=64_800.0).contains(&seconds.rem_euclid(86_400.0));
        let seconds: Vec<f64> = (12..=36).map(|i| 1800.0 * f64::from(i)).collect();
        let steps = Steps::of(seconds, 86_400.0, lit);
        for how in ALL {
            let only =
                |seconds: f64, time: usize| assert_eq!(dense(&steps, seconds, how)[time], 1.0, "{how:?} {seconds}");
            only(21_000.0, 0);
            only(64_860.0, 24);
            only(23.0 * 3600.0, 24);
            only(1.0 * 3600.0, 0);
        }
        assert_eq!(steps.nights().collect::<Vec<_>>(), [24]);
        let Mixture::Sum(weights) = steps.mixture(22_000.0, Interpolation::CatmullRom) else { panic!() };
        assert!(
            weights.iter().all(|weight| weight.time <= 2),
            "the evening is no neighbour of the morning: {weights:?}"
        );
        let none = Steps::of(Vec::new(), 86_400.0, lit);
        assert_eq!(none.mixture(0.0, Interpolation::Linear), Mixture::Sum(Vec::new()));
        assert_eq!(none.place(3.0), None);
        // One time alone.
        let one = Steps::of(vec![43_200.0], 86_400.0, lit);
        assert_eq!(dense(&one, 50_000.0, Interpolation::CatmullRom), [1.0]);
    }
}
