//! Separable filters over planes of one value a pixel.

use std::ops::{AddAssign, Mul};

use super::parallel;

/// What stands beyond the edge of a plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Edge {
    /// The pixel at the edge, again and again.
    Clamp,
    /// c b a | a b c.
    Symmetric,
    /// c b | a b c at the low side, a b c | c b at the high side: the pyramid of PerceptualDiff.
    Yee,
}

impl Edge {
    /// The pixel that stands for position `i` of `n` pixels; planes smaller than the filter are clamped in the end.
    fn index(self, i: isize, n: usize) -> usize {
        let last = n as isize - 1;
        let mirrored = match self {
            Self::Clamp => i,
            Self::Symmetric if i < 0 => -i - 1,
            Self::Yee if i < 0 => -i,
            Self::Symmetric | Self::Yee if i > last => 2 * last + 1 - i,
            _ => i,
        };
        mirrored.clamp(0, last) as usize
    }
}

/// f32 or f64.
pub(super) trait Value: Copy + Default + Send + Sync + Mul<Output = Self> + AddAssign {}
impl<T: Copy + Default + Send + Sync + Mul<Output = Self> + AddAssign> Value for T {}

/// `x` along rows, `y` along columns; both of odd length, the middle at the pixel itself.
pub(super) fn separable<T: Value>(
    plane: &[T],
    [width, height]: [usize; 2],
    x: &[T],
    y: &[T],
    edge: Edge,
    threads: usize,
) -> Vec<T> {
    let mut between = vec![T::default(); plane.len()];
    let radius = x.len() / 2;
    parallel::rows(threads, &mut between, width, |row, out| {
        let line = &plane[row * width..(row + 1) * width];
        let at = |i: usize| line[edge.index(i as isize - radius as isize, width)];
        let padded: Vec<T> = (0..width + 2 * radius).map(at).collect();
        for (k, weight) in x.iter().enumerate() {
            out.iter_mut().zip(&padded[k..]).for_each(|(out, value)| *out += *weight * *value);
        }
    });
    let mut out = vec![T::default(); plane.len()];
    let radius = y.len() / 2;
    parallel::rows(threads, &mut out, width, |row, out| {
        for (k, weight) in y.iter().enumerate() {
            let from = edge.index((row + k) as isize - radius as isize, height);
            let line = &between[from * width..(from + 1) * width];
            out.iter_mut().zip(line).for_each(|(out, value)| *out += *weight * *value);
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges() {
        let list = |edge: Edge| (-2..6).map(|i| edge.index(i, 4)).collect::<Vec<_>>();
        assert_eq!(list(Edge::Clamp), [0, 0, 0, 1, 2, 3, 3, 3]);
        assert_eq!(list(Edge::Symmetric), [1, 0, 0, 1, 2, 3, 3, 2]);
        assert_eq!(list(Edge::Yee), [2, 1, 0, 1, 2, 3, 3, 2]);
        assert_eq!(Edge::Symmetric.index(-5, 1), 0);
    }

    #[test]
    fn equals_the_sum_over_both_directions() {
        let (size, x, y) = ([7, 5], [0.1, 0.7, 0.3], [0.2, -0.5, 1.0, 0.4, 0.6]);
        let plane: Vec<f64> = (0..35).map(|i| f64::from(i * i % 11)).collect();
        for edge in [Edge::Clamp, Edge::Symmetric, Edge::Yee] {
            let out = separable(&plane, size, &x, &y, edge, 2);
            for (i, value) in out.iter().enumerate() {
                let (px, py) = ((i % 7) as isize, (i / 7) as isize);
                let mut sum = 0.0;
                for (dx, wx) in x.iter().enumerate() {
                    for (dy, wy) in y.iter().enumerate() {
                        let (sx, sy) = (edge.index(px + dx as isize - 1, 7), edge.index(py + dy as isize - 2, 5));
                        sum += wx * wy * plane[sy * 7 + sx];
                    }
                }
                assert!((value - sum).abs() < 1e-12, "{edge:?} at {i}");
            }
        }
    }
}
