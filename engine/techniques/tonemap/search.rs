//! Which averages local adaptation looks at, and how it chooses among them.

use super::{Operator, Settings};
use crate::{
    graph::{Buffer, Graph},
    shaders::{
        consts,
        types::{TonemapKernels, TonemapSearch},
    },
};

/// One step of the search: the average of `centre` counts as even if it differs from that of `surround` by less than
/// `slope · centre + offset · log-average`. Then the next step follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Index of a Gaussian.
    pub centre: usize,
    /// Index of a Gaussian.
    pub surround: usize,
    pub offset: f64,
}

/// Weights of distances 0 to a radius along one axis, those of both sides together 1.
pub type Kernel = Vec<f64>;

/// Gaussian averages of growing extent, and the search among them ([`Settings::contrast`], [`Settings::scales`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Search {
    /// In ascending order of radius.
    pub gaussians: Vec<Kernel>,
    /// Of each Gaussian, in pixels.
    pub sigmas: Vec<f64>,
    pub steps: Vec<Step>,
    pub slope: f64,
}

fn gaussian(sigma: f64, radius: usize) -> Vec<f64> {
    let weights: Vec<f64> = (0..=radius).map(|d| (-((d * d) as f64) / (2.0 * sigma * sigma)).exp()).collect();
    let sum = 2.0 * weights.iter().sum::<f64>() - weights[0];
    weights.into_iter().map(|w| w / sum).collect()
}

/// What both ways of computing averages read.
#[derive(Clone, Copy, Debug)]
pub struct Tables {
    /// One `types::TonemapSearch`.
    pub search: Buffer,
    /// Four Gaussians together, `TONEMAP_STRIDE` distances each.
    pub weights: Buffer,
}

impl Tables {
    /// Of no averages.
    pub fn none(graph: &mut Graph) -> Self {
        Self {
            search: graph.buffer_from("tonemap.search", &[TonemapSearch::default()]),
            weights: graph.buffer_from("tonemap.weights", &[[0.0f32; 4]]),
        }
    }
}

impl Search {
    /// Of Ashikhmin and Reinhard; `None` for other operators.
    pub fn new(settings: &Settings) -> Option<Self> {
        match settings.operator {
            Operator::Ashikhmin => {
                let largest = settings.radius as usize;
                let mut radii: Vec<usize> = (1..=largest).chain((1..=largest).map(|s| 2 * s)).collect();
                radii.sort_unstable();
                radii.dedup();
                let index = |radius: usize| radii.partition_point(|r| *r < radius);
                let step = |s: usize| Step { centre: index(s), surround: index(2 * s), offset: 0.0 };
                Some(Self {
                    sigmas: radii.iter().map(|&r| r as f64 / 2.0).collect(),
                    gaussians: radii.iter().map(|&r| gaussian(r as f64 / 2.0, r)).collect(),
                    steps: (1..=largest).map(step).collect(),
                    slope: settings.contrast.into(),
                })
            }
            Operator::Reinhard => {
                let count = settings.scales as usize;
                let scale = |i: usize| 1.6f64.powi(i as i32);
                let epsilon = f64::from(settings.epsilon);
                let sharp = f64::from(settings.phi).exp2();
                let step = |i: usize| Step { centre: i, surround: i + 1, offset: epsilon * sharp / scale(i).powi(2) };
                Some(Self {
                    sigmas: (0..=count).map(|i| scale(i) / 4.0).collect(),
                    gaussians: (0..=count)
                        .map(|i| gaussian(scale(i) / 4.0, (3.0 * scale(i) / 4.0).ceil() as usize))
                        .collect(),
                    steps: (0..count).map(step).collect(),
                    slope: epsilon,
                })
            }
            _ => None,
        }
    }

    /// Pixels to each side that the largest average reaches.
    pub fn reach(&self) -> usize {
        self.gaussians.iter().map(Vec::len).max().unwrap_or(1) - 1
    }

    /// Groups of four Gaussians.
    pub fn groups(&self) -> usize {
        self.gaussians.len().div_ceil(4)
    }

    /// Samples that one pixel takes at most if each average is computed by its definition.
    pub fn samples_literal(&self) -> usize {
        self.gaussians.iter().map(|g| (2 * g.len() - 1).pow(2)).sum()
    }

    /// Samples that one pixel takes if averages are computed along rows and then along columns: products of weight and sample.
    pub fn samples_fast(&self) -> usize {
        self.gaussians.iter().map(|g| 2 * (2 * g.len() - 1)).sum()
    }

    /// Puts it where shaders read it.
    pub fn tables(&self, graph: &mut Graph) -> Tables {
        let mut search =
            TonemapSearch { steps: self.steps.len() as u32, slope: self.slope as f32, ..TonemapSearch::default() };
        for (i, step) in self.steps.iter().enumerate() {
            search.centre[i] = step.centre as u32;
            search.surround[i] = step.surround as u32;
            search.offset[i] = step.offset as f32;
        }
        for (i, weights) in self.gaussians.iter().enumerate() {
            search.radius[i] = weights.len() as u32 - 1;
        }
        let stride = consts::TONEMAP_STRIDE as usize;
        let mut weights = vec![[0.0f32; 4]; stride * self.groups()];
        for (i, gaussian) in self.gaussians.iter().enumerate() {
            for (d, weight) in gaussian.iter().enumerate() {
                weights[i / 4 * stride + d][i % 4] = *weight as f32;
            }
        }
        Tables {
            search: graph.buffer_from("tonemap.search", &[search]),
            weights: graph.buffer_from("tonemap.weights", &weights),
        }
    }

    /// Largest radius of each group of four; 0 for groups that are not there.
    pub fn group_radii(&self) -> [i32; 6] {
        let mut radii = [0; 6];
        for (radius, group) in radii.iter_mut().zip(self.gaussians.chunks(4)) {
            *radius = group.iter().map(|w| w.len() as i32 - 1).max().unwrap_or(0);
        }
        radii
    }

    /// Weights of the fast way: by signed distance from −48, four Gaussians together.
    pub fn kernels(&self) -> TonemapKernels {
        Self::kernels_of(&self.gaussians)
    }

    pub(super) fn kernels_of(gaussians: &[Kernel]) -> TonemapKernels {
        let mut kernels = TonemapKernels::default();
        for (i, gaussian) in gaussians.iter().enumerate() {
            for (d, weight) in gaussian.iter().enumerate() {
                for at in [48 - d, 48 + d] {
                    kernels.part[i / 4 * 3 + at / 32].at[at % 32][i % 4] = *weight as f32;
                }
            }
        }
        kernels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(operator: Operator, radius: u32) -> Settings {
        Settings { operator, radius, ..Settings::default() }
    }

    #[test]
    fn tables_hold_what_the_settings_say() {
        let search = Search::new(&settings(Operator::Ashikhmin, 10)).unwrap();
        assert_eq!((search.gaussians.len(), search.reach(), search.steps.len()), (15, 20, 10));
        for (i, step) in search.steps.iter().enumerate() {
            assert_eq!(search.gaussians[step.centre].len() - 1, i + 1);
            assert_eq!(search.gaussians[step.surround].len() - 1, 2 * i + 2);
        }
        let search = Search::new(&settings(Operator::Reinhard, 10)).unwrap();
        assert_eq!((search.gaussians.len(), search.reach(), search.steps.len()), (9, 33, 8));
        for g in &search.gaussians {
            assert!((2.0 * g.iter().sum::<f64>() - g[0] - 1.0).abs() < 1e-12);
        }
        for (operator, radius) in [(Operator::Ashikhmin, 16), (Operator::Ashikhmin, 1), (Operator::Reinhard, 1)] {
            let settings = settings(operator, radius);
            let search = Search::new(&settings).unwrap();
            assert!(
                search.groups() <= consts::TONEMAP_GROUPS as usize
                    && search.reach() + 8 <= consts::TONEMAP_STRIDE as usize
            );
            assert_eq!(search.reach() as u32, settings.reach(100, 100));
        }
        assert!(Search::new(&settings(Operator::Aces, 1)).is_none());
    }

    #[test]
    fn work_of_the_fast_way_does_not_explode() {
        let of = |radius| Search::new(&settings(Operator::Ashikhmin, radius)).unwrap();
        // Per average: a side of the neighbourhood instead of its area.
        for radius in 1..=16 {
            let search = of(radius);
            let sides: usize = search.gaussians.iter().map(|g| 2 * g.len() - 1).sum();
            assert_eq!(search.samples_fast(), 2 * sides);
        }
        assert_eq!((of(10).samples_literal(), of(10).samples_fast()), (7375, 570));
        assert_eq!((of(16).samples_literal(), of(16).samples_fast()), (28024, 1392));
        assert!(of(16).samples_literal() < 30_000, "loops of one invocation");
        let reinhard = Search::new(&settings(Operator::Reinhard, 10)).unwrap();
        assert_eq!((reinhard.samples_literal(), reinhard.samples_fast()), (7617, 374));
    }
}
