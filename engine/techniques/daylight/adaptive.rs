//! The steps of the day that a bake needs: between the others the light is interpolated (section 3.2 of the paper).
//!
//! The lit steps are halved until an interval passes a test. The paper compares the interpolated frame with the two ends of the interval
//! ([`Adaptive::Paper`]). That test is blind where both ends are alike, as before sunrise and after sunset, and it asks for steps where the light
//! changes evenly. [`Adaptive::Middle`] compares the interpolated frame with the true one, [`Adaptive::Every`] all frames of the interval with the
//! true ones. All split every interval that is longer than [`Baking::longest`](super::Baking::longest).
//!
//! Paths serve all times, so the light of all steps is known for a few texels ([`Sparse`]) before the bake begins. The steps that are left out save
//! bytes and shadow rays, but no paths. The light is that of a white sun of 1 W/m², as it is stored: a change of the sun's strength alone needs no
//! steps.

use serde::{Deserialize, Serialize};

use super::{Baking, Light, plan::NEXT_DAY};
use crate::{
    Result,
    measure::{Display, Exposure, Measure, Options, Pair, Picture},
    settings::JsonSchema,
};

/// Paths of each texel at most, to choose the steps.
pub const SPARSE_PATHS: u32 = 32;

/// How the steps of a bake are chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Adaptive {
    /// All steps.
    #[default]
    Off,
    /// The paper's test: the frame in the middle of an interval, interpolated, against the ends of the interval.
    Paper,
    /// The frame in the middle of an interval, interpolated, against the true one.
    Middle,
    /// All frames of an interval, interpolated, against the true ones: no step that is left out differs noticeably.
    Every,
}

/// How frames are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Comparison {
    /// The root mean square of the difference over all texels, relative to the mean. Noise of the paths does not count.
    #[default]
    Rms,
    /// The share of pixels that an observer sees to be different (Yee and Newman 2004), as in the paper; not for lightmaps.
    Pdiff,
}

/// The light of some texels of a bake at all its steps.
#[derive(Clone, Debug)]
pub struct Sparse {
    pub light: Light,
    /// Columns and rows of texels, for bakes whose texels are those of pictures; a bit of the light's mask belongs to each.
    pub extent: Option<[u32; 2]>,
}

/// The steps that are kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen {
    /// In order.
    pub kept: Vec<usize>,
    /// The largest difference of an interpolated step from the true one, root mean square relative to its mean.
    pub worst: f64,
    /// The step with that difference.
    pub worst_step: usize,
}

/// Chooses steps at `seconds`.
///
/// # Errors
/// As [`Measure::of`].
pub fn choose(sparse: &Sparse, seconds: &[f64], settings: &Baking) -> Result<Chosen> {
    let frames = Frames { sparse, seconds };
    let Some(last) = seconds.len().checked_sub(1) else {
        return Ok(Chosen { kept: Vec::new(), worst: 0.0, worst_step: 0 });
    };
    let mut kept = Vec::new();
    let mut intervals = Vec::new();
    // Days do not follow each other: no light is interpolated between them.
    let days = seconds.chunk_by(|a, b| (a / NEXT_DAY).floor() == (b / NEXT_DAY).floor());
    let mut first = 0;
    for day in days {
        let last = first + day.len() - 1;
        let middle = usize::midpoint(first, last);
        kept.extend([first, middle, last]);
        // "First we have two equally big intervals."
        intervals.extend([[first, middle], [middle, last]]);
        first = last + 1;
    }
    while let Some([from, to]) = intervals.pop() {
        let middle = usize::midpoint(from, to);
        if middle == from || settings.adaptive == Adaptive::Off {
            continue;
        }
        let long = seconds[to] - seconds[from] > 60.0 * settings.longest;
        let mut split = long;
        let checked = if settings.adaptive == Adaptive::Every { from + 1..to } else { middle..middle + 1 };
        for step in checked {
            split = split || frames.differ([from, step, to], settings)?;
        }
        if split {
            kept.push(middle);
            intervals.extend([[from, middle], [middle, to]]);
        }
    }
    if settings.adaptive == Adaptive::Off {
        kept = (0..=last).collect();
    }
    kept.sort_unstable();
    kept.dedup();
    let (mut worst, mut worst_step) = (0.0, 0);
    for pair in kept.windows(2) {
        for step in pair[0] + 1..pair[1] {
            let error = frames.rms(&frames.between(pair[0], step, pair[1]), &frames.frame(step));
            if error > worst {
                (worst, worst_step) = (error, step);
            }
        }
    }
    Ok(Chosen { kept, worst, worst_step })
}

struct Frames<'a> {
    sparse: &'a Sparse,
    seconds: &'a [f64],
}

/// A value and its noise for each texel and colour.
type Frame = Vec<[f64; 2]>;

impl Frames<'_> {
    fn frame(&self, step: usize) -> Frame {
        let Light { sun, noise, .. } = &self.sparse.light;
        let of_step = |values: &'_ [f32]| -> Vec<f64> {
            values.iter().skip(step).step_by(self.seconds.len()).map(|value| f64::from(*value)).collect()
        };
        of_step(sun).into_iter().zip(of_step(noise)).map(|(value, noise)| [value, noise]).collect()
    }

    /// The frame of a step by interpolation between two others (equation 2).
    fn between(&self, from: usize, step: usize, to: usize) -> Frame {
        let [t0, t, t1] = [from, step, to].map(|step| self.seconds[step]);
        let alpha = (t - t0) / (t1 - t0);
        let mixed = |(a, b): ([f64; 2], [f64; 2])| [0, 1].map(|i| (1.0 - alpha) * a[i] + alpha * b[i]);
        self.frame(from).into_iter().zip(self.frame(to)).map(mixed).collect()
    }

    fn differ(&self, [from, middle, to]: [usize; 3], settings: &Baking) -> Result<bool> {
        let found = self.between(from, middle, to);
        let references = match settings.adaptive {
            Adaptive::Paper => vec![from, to],
            _ => vec![middle],
        };
        for reference in references {
            let reference = self.frame(reference);
            let difference = match (settings.measure, self.sparse.extent) {
                (Comparison::Pdiff, Some(extent)) => self.visible(&found, &reference, extent)?,
                _ => self.rms(&found, &reference),
            };
            if difference > settings.noticeable {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The product of the errors of odd and even paths has no bias by noise: (e + n)(e - n), where n is half the difference of both.
    fn rms(&self, found: &Frame, reference: &Frame) -> f64 {
        let mut sums = [0.0, 0.0];
        for (found, reference) in found.iter().zip(reference) {
            let [error, noise] = [0, 1].map(|i| found[i] - reference[i]);
            sums[0] += error * error - noise * noise;
            sums[1] += reference[0];
        }
        let count = reference.len().max(1) as f64;
        let rms = (sums[0].max(0.0) / count).sqrt();
        match (sums[1] / count, rms) {
            (_, 0.0) => 0.0,
            (mean, rms) if mean > 0.0 => rms / mean,
            // Light where there should be none.
            _ => f64::INFINITY,
        }
    }

    /// Share of the pixels that differ visibly between pictures of white surfaces, exposed so that the mean of the reference is a middle grey.
    fn visible(&self, found: &Frame, reference: &Frame, extent: [u32; 2]) -> Result<f64> {
        let sum: f64 = reference.iter().map(|value| value[0]).sum();
        let scale = if sum > 0.0 { 0.18 * reference.len() as f64 / sum } else { 1.0 };
        let picture = |frame: &Frame| {
            let mut values = frame.chunks_exact(3);
            let mask = &self.sparse.light.mask;
            let there = |texel: u32| mask.get(texel as usize / 32).is_some_and(|word| word >> (texel % 32) & 1 != 0);
            Picture::from_fn(extent[0], extent[1], |x, y| match there(y * extent[0] + x).then(|| values.next()) {
                Some(Some(value)) => [0, 1, 2].map(|channel| (scale * value[channel][0]) as f32),
                _ => [0.0; 3],
            })
        };
        let (reference, found) = (picture(reference), picture(found));
        let display = Display { exposure: Exposure::Stops(0.0), ..Display::default() };
        let options = Options { display, pdiff_swapped: false, ..Options::default() };
        Ok(Measure::Pdiff.of(&Pair::new(&reference, &found)?, &options)?.value / 100.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MINUTES: f64 = 60.0;

    /// Light of texels by a function of texel and time (0 to 1 through the day), with noise that neither test may see.
    fn sparse(texels: usize, steps: usize, light: impl Fn(usize, f64) -> f64) -> (Sparse, Vec<f64>) {
        let mut all = Light { mask: vec![u32::MAX; texels.div_ceil(32)], ..Light::default() };
        for texel in 0..texels {
            for channel in 0..3 {
                for step in 0..steps {
                    let value = light(texel, step as f64 / (steps - 1) as f64);
                    let noise = 0.3 * value * f64::from(pcg(texel * 3 + channel + 7919 * step)) / f64::from(u32::MAX);
                    // Odd and even paths have the noise n and -n; their mean has none of it here.
                    all.sun.push(value as f32);
                    all.noise.push(noise as f32);
                }
            }
        }
        let seconds = (0..steps).map(|step| 21_600.0 + 5.0 * MINUTES * step as f64).collect();
        (Sparse { light: all, extent: Some([texels as u32, 1]) }, seconds)
    }

    fn pcg(number: usize) -> u32 {
        let state = (number as u32).wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        (word >> 22) ^ word
    }

    fn baking(adaptive: Adaptive) -> Baking {
        Baking { adaptive, noticeable: 0.02, longest: 720.0, ..Baking::default() }
    }

    #[test]
    fn light_on_a_line_needs_its_ends_and_middle_by_the_true_frame() {
        let (all, seconds) = sparse(40, 129, |texel, t| 1.0 + texel as f64 * t);
        let chosen = choose(&all, &seconds, &baking(Adaptive::Middle)).unwrap();
        assert_eq!(chosen.kept, [0, 64, 128]);
        assert!(chosen.worst < 1e-6, "{}", chosen.worst);
        // The paper's test asks for more, because the ends differ.
        assert!(choose(&all, &seconds, &baking(Adaptive::Paper)).unwrap().kept.len() > 20);
        assert_eq!(choose(&all, &seconds, &baking(Adaptive::Off)).unwrap().kept.len(), 129);
    }

    #[test]
    fn steps_gather_where_the_light_bends_and_the_rest_is_within_the_threshold() {
        let (all, seconds) = sparse(40, 181, |texel, t| 1.0 + texel as f64 * (-(40.0 * (t - 0.3)).powi(2)).exp());
        let chosen = choose(&all, &seconds, &baking(Adaptive::Middle)).unwrap();
        assert!(chosen.kept.len() < 80, "{}", chosen.kept.len());
        let near = chosen.kept.iter().filter(|step| step.abs_diff(54) < 18).count();
        assert!(2 * near > chosen.kept.len(), "{near} of {}", chosen.kept.len());
        assert!(chosen.worst < 0.05, "{} at {}", chosen.worst, chosen.worst_step);
        // Where every step counts, none is off by more.
        let every = choose(&all, &seconds, &baking(Adaptive::Every)).unwrap();
        assert!(every.worst <= 0.02 && every.kept.len() >= chosen.kept.len() && every.kept.len() < 90, "{every:?}");
        assert!(chosen.kept.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn black_noon_black_is_not_missed() {
        // A flash between the first steps that are looked at, dark elsewhere.
        let flash = |_: usize, t: f64| (-(60.0 * (t - 0.3)).powi(2)).exp();
        let (all, seconds) = sparse(8, 181, |texel, t| 1e-3 + flash(texel, t));
        let deep = Baking { longest: 30.0, ..baking(Adaptive::Paper) };
        let shallow = choose(&all, &seconds, &baking(Adaptive::Paper)).unwrap();
        let found = choose(&all, &seconds, &deep).unwrap();
        assert!(shallow.worst > 0.9 && found.worst < 0.1, "{} {}", shallow.worst, found.worst);
        assert!(found.kept.windows(2).all(|pair| seconds[pair[1]] - seconds[pair[0]] <= 30.0 * MINUTES));
    }

    #[test]
    fn one_and_two_steps_and_none_are_kept() {
        for steps in [2, 3] {
            let (all, seconds) = sparse(4, steps, |_, t| 1.0 + t);
            assert_eq!(choose(&all, &seconds, &baking(Adaptive::Middle)).unwrap().kept.len(), steps);
        }
        let (all, seconds) = sparse(4, 2, |_, _| 1.0);
        let one = Sparse {
            light: Light { sun: vec![1.0; 12], noise: vec![0.0; 12], ..all.light.clone() },
            extent: all.extent,
        };
        assert_eq!(choose(&one, &seconds[..1], &baking(Adaptive::Paper)).unwrap().kept, [0]);
        assert!(choose(&all, &[], &baking(Adaptive::Paper)).unwrap().kept.is_empty());
    }

    #[test]
    fn observers_see_no_difference_in_even_light_and_one_in_a_moving_edge() {
        let measure = Comparison::Pdiff;
        let edge = |texel: usize, t: f64| if (texel as f64) < 64.0 * t { 1.0 } else { 0.2 };
        for (light, most) in [(&(|_: usize, t: f64| 1.0 + 0.01 * t) as &dyn Fn(usize, f64) -> f64, 3), (&edge, 33)] {
            let (all, seconds) = sparse(64, 33, light);
            let chosen = choose(&all, &seconds, &Baking { measure, ..baking(Adaptive::Middle) }).unwrap();
            match most {
                3 => assert_eq!(chosen.kept.len(), 3),
                _ => assert!(chosen.kept.len() >= 15, "{}", chosen.kept.len()),
            }
        }
    }
}
