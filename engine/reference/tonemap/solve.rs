//! Least squares of differences between neighbours, by plain conjugate gradients until nothing is left.

use super::plane::Plane;

/// Values along the edges to the right and below of each pixel; 0 where no pixel follows.
#[derive(Clone, Debug, PartialEq)]
pub struct Edges {
    pub across: Plane,
    pub down: Plane,
}

impl Edges {
    /// Differences of neighbours: the next pixel less this one.
    pub fn differences(plane: &Plane) -> Self {
        Self::of(plane.width, plane.height, |a, b| plane[b] - plane[a])
    }

    /// A value for each edge from its two pixels.
    pub fn of(width: usize, height: usize, edge: impl Fn((usize, usize), (usize, usize)) -> f64 + Sync) -> Self {
        let across = |x: usize, y: usize| if x + 1 < width { edge((x, y), (x + 1, y)) } else { 0.0 };
        let down = |x: usize, y: usize| if y + 1 < height { edge((x, y), (x, y + 1)) } else { 0.0 };
        Self { across: Plane::from_fn(width, height, across), down: Plane::from_fn(width, height, down) }
    }

    /// Each value by itself, from those of both.
    pub fn with(&self, other: &Self, value: impl Fn(f64, f64) -> f64 + Sync) -> Self {
        let both = |a: &Plane, b: &Plane| Plane::from_fn(a.width, a.height, |x, y| value(a[(x, y)], b[(x, y)]));
        Self { across: both(&self.across, &other.across), down: both(&self.down, &other.down) }
    }

    /// The transpose of [`Self::differences`].
    pub fn gathered(&self) -> Plane {
        let Plane { width, height, .. } = self.across;
        Plane::from_fn(width, height, |x, y| {
            let left = if x > 0 { self.across[(x - 1, y)] } else { 0.0 };
            let above = if y > 0 { self.down[(x, y - 1)] } else { 0.0 };
            left - self.across[(x, y)] + above - self.down[(x, y)]
        })
    }
}

/// Means of 2 × 2 pixels, or of as many as there are.
pub fn halved(fine: &Plane) -> Plane {
    let (width, height) = (fine.width.div_ceil(2), fine.height.div_ceil(2));
    Plane::from_fn(width, height, |x, y| {
        let members: Vec<f64> = members(fine.width, fine.height, x, y).map(|at| fine[at]).collect();
        members.iter().sum::<f64>() / members.len() as f64
    })
}

/// The transpose of [`halved`].
pub fn shared(coarse: &Plane, width: usize, height: usize) -> Plane {
    Plane::from_fn(width, height, |x, y| coarse[(x / 2, y / 2)] / members(width, height, x / 2, y / 2).count() as f64)
}

fn members(width: usize, height: usize, x: usize, y: usize) -> impl Iterator<Item = (usize, usize)> {
    let all = (0..2).flat_map(move |j| (0..2).map(move |i| (2 * x + i, 2 * y + j)));
    all.filter(move |(x, y)| *x < width && *y < height)
}

/// Least squares Σ w (difference − g)² over the edges of all `levels`, each of weights w and weights times wanted differences w g.
/// The solution has the mean 0.
pub fn solve(levels: &[(Edges, Edges)]) -> Plane {
    let (_, first) = &levels[0];
    let (width, height) = (first.across.width, first.across.height);
    let gathered = |flows: Vec<Edges>| {
        let mut sum: Option<Plane> = None;
        for flow in flows.iter().rev() {
            let own = flow.gathered();
            sum = Some(match sum {
                None => own,
                Some(coarse) => {
                    let shared = shared(&coarse, own.width, own.height);
                    Plane::from_fn(own.width, own.height, |x, y| own[(x, y)] + shared[(x, y)])
                }
            });
        }
        sum.map(|sum| sum.values).unwrap_or_default()
    };
    let apply = |values: &[f64]| {
        let mut level = Plane { width, height, values: values.to_vec() };
        let mut flows = Vec::new();
        for (k, (weights, _)) in levels.iter().enumerate() {
            if k > 0 {
                level = halved(&level);
            }
            flows.push(Edges::differences(&level).with(weights, |difference, weight| weight * difference));
        }
        gathered(flows)
    };
    let right = gathered(levels.iter().map(|(_, flow)| flow.clone()).collect());
    let values = conjugate_gradients(apply, &right);
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    Plane { width, height, values }.map(|value| value - mean)
}

/// x with Ax = b for a symmetric A that is not negative; |b − Ax| is at most 10⁻¹² |b|, or as small as 10⁵ steps make it.
pub fn conjugate_gradients(apply: impl Fn(&[f64]) -> Vec<f64>, right: &[f64]) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut solution = vec![0.0; right.len()];
    let mut rest = right.to_vec();
    let mut direction = rest.clone();
    let mut square = dot(&rest, &rest);
    let enough = 1e-24 * square;
    for _ in 0..100_000 {
        if square <= enough {
            break;
        }
        let image = apply(&direction);
        let step = square / dot(&direction, &image);
        for i in 0..right.len() {
            solution[i] += step * direction[i];
            rest[i] -= step * image[i];
        }
        let next = dot(&rest, &rest);
        for i in 0..right.len() {
            direction[i] = rest[i] + next / square * direction[i];
        }
        square = next;
    }
    solution
}
