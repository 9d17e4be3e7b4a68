//! How steady a sequence is: how parts of the picture in which surfaces stand still change from frame to frame, against how they
//! change in the right pictures. Something that pops changes more in one step than anything does that moves.

/// Pixels along an edge of a part.
const EDGE: usize = 8;

/// Light on surfaces, and what tells whether they stand still, of one frame.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// Linear Rec. 709, three a pixel.
    pub light: &'a [[f32; 3]],
    /// Distance, metres; from 1e9 on: nothing is there.
    pub depth: &'a [f32],
}

/// The change of parts of the picture in one step, relative to the mean of the right pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step {
    /// Largest change of a part in the right pictures.
    pub truth: f64,
    /// In the ones that are looked at.
    pub found: f64,
    /// Largest difference of the two changes.
    pub apart: f64,
}

/// All steps of a sequence.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Steadiness {
    /// Parts of 8×8 pixels in which all surfaces stand still throughout.
    pub parts: usize,
    /// One less than there are frames.
    pub steps: Vec<Step>,
}

impl Steadiness {
    /// Of frames of `width` pixels in a row; `depth` is that of the right pictures.
    pub fn of(width: usize, truth: &[Frame<'_>], found: &[Frame<'_>]) -> Self {
        let Some(first) = truth.first().filter(|_| width > 0) else { return Self::default() };
        let still = |pixel: usize| {
            let z = first.depth.get(pixel).copied().unwrap_or(f32::INFINITY);
            let same = |frame: &Frame<'_>| frame.depth.get(pixel).is_some_and(|d| (d - z).abs() <= 1e-3 * z);
            z < 1e9 && truth.iter().all(same)
        };
        let height = first.light.len() / width;
        let corners = (0..height / EDGE).flat_map(|y| (0..width / EDGE).map(move |x| (EDGE * x, EDGE * y)));
        let pixels = |(x, y): (usize, usize)| -> Vec<usize> {
            (0..EDGE * EDGE).map(|i| (y + i / EDGE) * width + x + i % EDGE).collect()
        };
        let parts: Vec<Vec<usize>> = corners.map(pixels).filter(|part| part.iter().all(|&p| still(p))).collect();
        let means = |frame: &Frame<'_>| -> Vec<f64> {
            let mean = |part: &Vec<usize>| part.iter().map(|&p| luminance(frame.light.get(p))).sum::<f64>();
            parts.iter().map(|part| mean(part) / (EDGE * EDGE) as f64).collect()
        };
        let (truth, found): (Vec<_>, Vec<_>) = truth.iter().zip(found).map(|(t, f)| (means(t), means(f))).unzip();
        let count = (truth.len() * parts.len()).max(1) as f64;
        let mean = (truth.iter().flatten().sum::<f64>() / count).max(1e-30);
        let steps = truth.windows(2).zip(found.windows(2)).map(|(t, f)| {
            let mut step = Step::default();
            for part in 0..parts.len() {
                let (right, ours) = (t[1][part] - t[0][part], f[1][part] - f[0][part]);
                step.truth = step.truth.max(right.abs() / mean);
                step.found = step.found.max(ours.abs() / mean);
                step.apart = step.apart.max((ours - right).abs() / mean);
            }
            step
        });
        Self { parts: parts.len(), steps: steps.collect() }
    }

    /// The largest of each over all steps.
    pub fn largest(&self) -> Step {
        self.steps.iter().fold(Step::default(), |a, b| Step {
            truth: a.truth.max(b.truth),
            found: a.found.max(b.found),
            apart: a.apart.max(b.apart),
        })
    }
}

fn luminance(pixel: Option<&[f32; 3]>) -> f64 {
    pixel.map_or(0.0, |[r, g, b]| 0.2126 * f64::from(*r) + 0.7152 * f64::from(*g) + 0.0722 * f64::from(*b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pop_shows_and_what_moves_does_not() {
        let (width, height) = (24, 16);
        // The truth gets brighter evenly; a body moves through the right third.
        let depth = |t: usize| -> Vec<f32> {
            (0..width * height).map(|i| if i % width >= 16 { 2.0 + t as f32 } else { 4.0 }).collect()
        };
        let light = |level: f32| vec![[level; 3]; width * height];
        let depths: Vec<_> = (0..5).map(depth).collect();
        let right: Vec<_> = (0..5).map(|t| light(1.0 + 0.1 * t as f32)).collect();
        let mut ours = right.clone();
        // One part is brighter in the third frame, all that moves is noise.
        for (t, frame) in ours.iter_mut().enumerate() {
            for (i, pixel) in frame.iter_mut().enumerate() {
                if i % width >= 16 {
                    *pixel = [(7 * i + t) as f32; 3];
                } else if t == 2 && i % width < 8 && i / width < 8 {
                    *pixel = [pixel[0] + 0.6; 3];
                }
            }
        }
        let frames = |lights: &[Vec<[f32; 3]>]| {
            let truth: Vec<Frame<'_>> =
                right.iter().zip(&depths).map(|(light, depth)| Frame { light, depth }).collect();
            let found: Vec<Frame<'_>> =
                lights.iter().zip(&depths).map(|(light, depth)| Frame { light, depth }).collect();
            Steadiness::of(width, &truth, &found)
        };
        let same = frames(&right);
        assert_eq!((same.parts, same.steps.len()), (4, 4));
        let largest = same.largest();
        assert!((largest.truth - 0.1 / 1.2).abs() < 1e-6 && largest.truth == largest.found && largest.apart == 0.0);
        let popped = frames(&ours);
        assert!((popped.largest().found - 0.7 / 1.2).abs() < 1e-6, "{popped:?}");
        assert!((popped.largest().apart - 0.6 / 1.2).abs() < 1e-6);
        assert!(popped.steps[0].apart < 1e-9 && popped.steps[3].apart < 1e-9);
    }
}
