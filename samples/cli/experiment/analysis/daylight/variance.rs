//! Section 3.2 and figures 5 and 7: variance by eigenvector, and a frame restored with 10 and 20 vectors.

use lucerna::{
    Result,
    bake::pca::{self, Basis, Centre, Keep},
    image::srgb,
    measure::Picture,
};

use super::{
    SIDE,
    day::{Day, Of, Rows, relative_rms},
};
use crate::report::{Axis, Comparison, Plot, Section, Table};

/// The paper's numbers of vectors.
const VECTORS: [usize; 3] = [5, 10, 20];
/// Numbers of vectors of the restored frame, with the paper's share of its variance, %.
const RESTORED: [(usize, f64); 2] = [(10, 99.6), (20, 99.83)];
/// Vectors that the plot shows.
const SHOWN: usize = 60;

/// What is subtracted before the decomposition. The paper does not say which it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Centring {
    Nothing,
    /// From each pixel its mean over the day.
    MeanImage,
    /// From each frame its mean: the usual principal components of vectors with a dimension for each time.
    FrameMeans,
    /// Nothing, from the 8-bit codes of a screen instead of radiance.
    Codes,
}

impl Centring {
    const ALL: [Self; 4] = [Self::Nothing, Self::MeanImage, Self::FrameMeans, Self::Codes];

    fn name(self) -> &'static str {
        match self {
            Self::Nothing => "uncentred",
            Self::MeanImage => "mean image removed",
            Self::FrameMeans => "mean of each frame removed",
            Self::Codes => "uncentred, 8-bit codes of a screen",
        }
    }
}

/// Rows, the basis of their differences from the centre, and how to find the rows again.
struct Parts {
    basis: Basis,
    /// What is subtracted from each row, if that differs from row to row.
    removed: Vec<f32>,
}

impl Parts {
    fn of(rows: &Rows, centring: Centring, day: &Day) -> Result<Self> {
        let times = rows.times;
        let mut removed = vec![0.0; rows.len()];
        let mut values = rows.values.clone();
        match centring {
            Centring::MeanImage => {
                for (row, removed) in values.chunks_exact_mut(times).zip(&mut removed) {
                    *removed = row.iter().sum::<f32>() / times as f32;
                    row.iter_mut().for_each(|value| *value -= *removed);
                }
            }
            Centring::Codes => {
                let scale = (day.stops() as f32).exp2();
                values.iter_mut().for_each(|value| *value = f32::from(srgb::encode_u8(*value * scale)));
            }
            Centring::Nothing | Centring::FrameMeans => {}
        }
        let centre = if centring == Centring::FrameMeans { Centre::Mean } else { Centre::Origin };
        let basis = pca::basis(&values, times, &vec![1.0; rows.len()], centre, Keep::Count(times))?;
        Ok(Self { basis, removed })
    }

    /// Shares of the variance, %, added up.
    fn shares(&self) -> Vec<f64> {
        let mut sum = 0.0;
        let share = |square: &f64| {
            sum += 100.0 * square / self.basis.total;
            sum
        };
        self.basis.squares.iter().map(share).collect()
    }

    /// A frame by the first `count` vectors.
    fn restored(&self, day: &Day, rows: &Rows, t: usize, count: usize) -> Picture {
        let mut pixels = vec![[0.0; 3]; day.width * day.height];
        let count = count.min(self.basis.len());
        for ((row, removed), (pixel, channel)) in rows.iter().zip(&self.removed).zip(&rows.places) {
            let mut value = self.basis.mean[t];
            for index in 0..count {
                let vector = self.basis.vector(index);
                let along: f64 = row
                    .iter()
                    .zip(vector)
                    .zip(&self.basis.mean)
                    .map(|((value, along), mean)| (f64::from(value - removed) - mean) * along)
                    .sum();
                value += along * vector[t];
            }
            // Restored light may be negative; no screen shows that.
            pixels[*pixel][*channel] = (value as f32 + removed).max(0.0);
        }
        day.picture(pixels)
    }
}

/// The first number of vectors that reaches a share.
fn reaching(shares: &[f64], wanted: f64) -> Option<usize> {
    shares.iter().position(|share| *share >= wanted).map(|index| index + 1)
}

pub(super) fn sections(days: &[Day]) -> Result<[Section; 2]> {
    let mut figure = Section::new("Figure 5: variance by eigenvector");
    figure.text(
        "Each pixel and colour is a vector with a dimension for each lit time, as in the paper; one set of eigenvectors serves all three colours. The \
         paper does not say what it subtracts before the decomposition. Its frames have 24 bits, so the last row decomposes codes of a screen instead of \
         radiance. The paper's 99.83 % with 20 vectors is the share of frame 121, not of the sequence (99.6 % with 10 vectors).",
    );
    let columns = ["scene", "centring", "lit frames", "5 (%)", "10 (%)", "20 (%)", "vectors for 95 %", "for 98.6 %"];
    let mut table = Table::new("variance", "Share of the variance with 5, 10 and 20 vectors", columns);
    table.push(["paper".into(), "not stated".into(), 180usize.into(), 95.0.into(), 98.6.into()].into_iter().chain([
        Option::<f64>::None.into(),
        5usize.into(),
        10usize.into(),
    ]));
    let (x, y) = (Axis::new("eigenvector"), Axis::new("variance (%)").log());
    let mut plot = Plot::new("figure-5", "Variance of the eigenvectors (as figure 5 of the paper)", x, y);
    let mut frame = Section::new("Figure 7: frame 121 with 10 and 20 vectors");
    frame.text(
        "The paper restores frame 121 of its 180 lit frames. Ours is the lit frame at the same place of the lit day. *Share* is 1 less the energy of the \
         error over that of the frame. *PDiff* is the share of pixels that PerceptualDiff calls visibly different at one exposure for the whole day; \
         from 0.021 % on (100 pixels of 800×600) its verdict is *different*.",
    );
    let columns = [
        "scene",
        "frame",
        "centring",
        "vectors",
        "share, paper (%)",
        "share (%)",
        "RMS / mean (%)",
        "PDiff (%)",
        "verdict, paper",
        "verdict",
        "worst frame, RMS / mean (%)",
    ];
    let mut restored = Table::new("frame-121", "The frame restored", columns);
    for day in days {
        let rows = day.rows(Of::Radiance);
        let t = day.frame_121();
        let truth = day.frame(t);
        let mut shown = None;
        for centring in Centring::ALL {
            let parts = Parts::of(&rows, centring, day)?;
            let shares = parts.shares();
            let cells = [day.name.as_str().into(), centring.name().into(), day.len().into()];
            let at = VECTORS.map(|count| shares.get(count.min(shares.len()).wrapping_sub(1)).copied().into());
            let counts = [95.0, 98.6].map(|wanted| reaching(&shares, wanted).into());
            table.push(cells.into_iter().chain(at).chain(counts));
            let points = parts.basis.squares.iter().take(SHOWN).enumerate();
            let points = points.map(|(i, square)| ((i + 1) as f64, 100.0 * square / parts.basis.total));
            plot = plot.line(format!("{}, {}", day.name, centring.name()), points.collect::<Vec<_>>());
            if centring == Centring::Codes {
                continue;
            }
            for (count, paper) in RESTORED {
                let test = parts.restored(day, &rows, t, count);
                let found = day.pdiff(&truth, &test)?;
                let different = found.detail("different") == Some(1.0);
                restored.push([
                    day.name.as_str().into(),
                    format!("{} of {}, {}", t + 1, day.len(), day.label(t)).into(),
                    centring.name().into(),
                    count.into(),
                    paper.into(),
                    share(&truth, &test).into(),
                    relative_rms(&truth, &test).into(),
                    found.value.into(),
                    if count == 10 { "different" } else { "not different" }.into(),
                    if different { "different" } else { "not different" }.into(),
                    worst(day, &rows, &parts, count).into(),
                ]);
            }
            shown.get_or_insert(parts);
        }
        if let Some(parts) = shown {
            let [ten, twenty] = RESTORED.map(|(count, _)| parts.restored(day, &rows, t, count));
            let maps = [&ten, &twenty].map(|test| -> Result<Vec<[f32; 3]>> {
                Ok(Picture::from_layers(&day.pdiff(&truth, test)?.map.picture(), None)?.pixels)
            });
            let [of_ten, of_twenty] = maps;
            let (width, height) = (day.width as u32, day.height as u32);
            let title = format!("{}: frame {}, {}, uncentred", day.name, t + 1, day.label(t));
            let set = Comparison::new(format!("{}-frame-121", day.id), title, width, height).exposure(day.stops());
            let set = set.with("frame", truth.pixels).with("10 vectors", ten.pixels);
            frame.add(set.with("20 vectors", twenty.pixels).at_most(SIDE));
            let title = format!("{}: PerceptualDiff, bright where a difference is visible", day.name);
            let set = Comparison::new(format!("{}-frame-121-maps", day.id), title, width, height);
            let set = set.values("difference over its threshold, as a colour").with("10 vectors", of_ten?);
            frame.add(set.with("20 vectors", of_twenty?).at_most(SIDE));
        }
    }
    figure.add(table);
    figure.add(plot);
    frame.blocks.insert(1, restored.into());
    Ok([figure, frame])
}

/// The share of a frame's energy that a restored frame has, %.
fn share(truth: &Picture, test: &Picture) -> f64 {
    let values = truth.pixels.as_flattened().iter().zip(test.pixels.as_flattened());
    let (mut rest, mut all) = (0.0, 0.0);
    for (a, b) in values {
        rest += (f64::from(*a) - f64::from(*b)).powi(2);
        all += f64::from(*a).powi(2);
    }
    100.0 * (1.0 - rest / all)
}

/// The largest root mean square error of a frame by the first `count` vectors over the frame's mean, %.
fn worst(day: &Day, rows: &Rows, parts: &Parts, count: usize) -> f64 {
    let count = count.min(parts.basis.len());
    let mut squares = vec![0.0; rows.times];
    for (row, removed) in rows.iter().zip(&parts.removed) {
        let around: Vec<f64> =
            row.iter().zip(&parts.basis.mean).map(|(value, mean)| f64::from(value - removed) - mean).collect();
        let mut rest = around.clone();
        for vector in (0..count).map(|index| parts.basis.vector(index)) {
            let along: f64 = around.iter().zip(vector).map(|(value, along)| value * along).sum();
            rest.iter_mut().zip(vector).for_each(|(rest, value)| *rest -= along * value);
        }
        squares.iter_mut().zip(&rest).for_each(|(square, rest)| *square += rest * rest);
    }
    day.worst(&squares, &rows.sums())
}
