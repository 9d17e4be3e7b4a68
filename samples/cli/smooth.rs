//! Anti-aliasing: a picture as the mean of several pictures, whose pixels look at different places around their middles.
//!
//! The places are those of a lattice, and the filter decides how far from the middle they are: the density of the places is the filter, so all pictures
//! have the same weight. The first place is the middle of the pixel. Layers that are no light (normals, depths) come from there alone.
//!
//! For sequences there is temporal anti-aliasing as well: each frame is one picture, and the average goes over time ([`lucerna::passes::temporal`]).
//! Where one picture takes long, its light can serve further places inside the pixels ([`lucerna::passes::edges`]).

use std::str::FromStr;

use clap::ValueEnum;
use glam::Vec2;
use lucerna::{
    image::{Layer, Layers},
    passes::{edges, temporal},
};
use serde::{Deserialize, Serialize};

/// Pictures of a still, if nothing else is asked for.
pub const STILL: u32 = 8;
/// Pictures of a mean at most.
pub const MOST: u32 = 1024;

/// Weight of the places around the middle of a pixel.
#[derive(ValueEnum, Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Filter {
    /// The square of the pixel: the least noise with few pictures
    #[default]
    Box,
    /// A pyramid two pixels wide
    Tent,
    /// The window of Blackman and Harris, three pixels wide: smooth edges, also of bright things
    BlackmanHarris,
}

/// The value of `--aa`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aa {
    /// The mean of so many pictures.
    Mean(u32),
    /// The average over the frames.
    Temporal,
    /// One picture, whose light serves further places inside the pixels.
    Edges,
}

impl FromStr for Aa {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "temporal" {
            return Ok(Self::Temporal);
        }
        if text == "edges" {
            return Ok(Self::Edges);
        }
        let count = text.parse().ok().filter(|count| (1..=MOST).contains(count));
        count.map(Self::Mean).ok_or_else(|| format!("expected a number in 1..={MOST}, edges or temporal"))
    }
}

/// Options of anti-aliasing.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct SmoothArgs {
    /// Anti-aliasing: the picture is the mean of N pictures, whose pixels look at different places around their middles; normals and depths are those
    /// of the middles. 1: none. edges: one picture, and eight places inside each pixel take its light where they show the same
    /// surface; edges of shadows and in mirrors stay as they are. temporal: each frame is one picture, averaged with the frames before it,
    /// where they show the same surfaces; layers are those of the frame [default: 8 for stills, or edges on CPU drivers where one picture
    /// takes seconds; 1 for sequences and with --paper]
    #[arg(long, value_name = "N|edges|temporal", help_heading = "Picture")]
    pub aa: Option<Aa>,

    /// Weight of the places around the middle of a pixel, for --aa
    #[arg(long = "aa-filter", value_enum, default_value_t, value_name = "FILTER", help_heading = "Picture")]
    pub filter: Filter,

    /// Most frames in the average of --aa temporal, which it implies: more are smoother at rest, fewer follow change faster [default: 8]
    #[arg(long = "aa-frames", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(temporal::MOST)), help_heading = "Picture")]
    pub aa_frames: Option<u32>,
}

/// Anti-aliasing of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Smooth {
    /// Pictures of the mean.
    pub count: u32,
    pub filter: Filter,
    /// Most frames of the average over time; `None`: each frame stands for itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temporal: Option<u32>,
    /// The light of one picture serves further places inside the pixels.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub edges: bool,
}

impl Default for Smooth {
    /// None.
    fn default() -> Self {
        Self { count: 1, filter: Filter::default(), temporal: None, edges: false }
    }
}

impl Smooth {
    pub fn is_none(&self) -> bool {
        self.count == 1 && self.temporal.is_none() && !self.edges
    }

    /// The options that ask for this.
    pub fn args(&self) -> SmoothArgs {
        let aa = match (self.temporal, self.edges) {
            (Some(_), _) => Aa::Temporal,
            (None, true) => Aa::Edges,
            (None, false) => Aa::Mean(self.count),
        };
        SmoothArgs { aa: Some(aa), filter: self.filter, aa_frames: self.temporal }
    }

    /// Where the pictures look, from the middle of each pixel to the right and down, pixels. The first one looks at the middle.
    pub fn places(&self) -> Vec<Vec2> {
        let lattice = lattice(self.count.clamp(1, MOST));
        lattice.into_iter().map(|at| self.of_filter(at)).collect()
    }

    fn of_filter(&self, [x, y]: [f64; 2]) -> Vec2 {
        Vec2::new(self.filter.place(x) as f32, self.filter.place(y) as f32)
    }

    /// The places inside the pixels that the light of one picture serves, for the engine. The first one is the middle.
    pub fn edges(&self) -> Option<[Vec2; edges::PLACES]> {
        let lattice = lattice(edges::PLACES as u32);
        self.edges.then(|| std::array::from_fn(|i| self.of_filter(lattice[i])))
    }

    /// The layers of one picture that anti-aliasing leaves as they are.
    pub fn exact(&self, layers: &Layers) -> Vec<String> {
        let exact = |layer: &&Layer| match (self.temporal, self.edges) {
            // All but the picture, before and after tone mapping.
            (Some(_), _) => !["", "light"].contains(&layer.name.as_str()),
            (None, true) => !is_light(layer),
            (None, false) => false,
        };
        layers.layers.iter().filter(exact).map(|layer| layer.name.clone()).collect()
    }

    /// Where the only picture of a frame looks.
    pub fn place(&self, frame: u32) -> Vec2 {
        if self.temporal.is_none() {
            return Vec2::ZERO;
        }
        let share = temporal::place(frame);
        Vec2::new(self.filter.place(share.x) as f32, self.filter.place(share.y) as f32)
    }

    /// For the engine.
    pub fn temporal(&self) -> Option<temporal::Settings> {
        self.temporal.map(|frames| temporal::Settings { frames })
    }
}

impl Filter {
    /// The place, in pixels from the middle, below which a share of the filter lies.
    fn place(self, share: f64) -> f64 {
        match self {
            Self::Box => share - 0.5,
            Self::Tent if share < 0.5 => (2.0 * share).sqrt() - 1.0,
            Self::Tent => 1.0 - (2.0 - 2.0 * share).sqrt(),
            Self::BlackmanHarris => {
                // The integral of the window, in [0, 1], has no inverse in closed form.
                let (mut low, mut high) = (0.0, 1.0);
                for _ in 0..50 {
                    let middle = 0.5 * (low + high);
                    if blackman_harris(middle) < share { low = middle } else { high = middle }
                }
                3.0 * (0.5 * (low + high) - 0.5)
            }
        }
    }
}

/// The share of the four-term window of Blackman and Harris (F. J. Harris 1978, minimum) below a place in [0, 1].
fn blackman_harris(at: f64) -> f64 {
    use std::f64::consts::TAU;
    let terms = [-0.48829, 0.14128, -0.01168].into_iter().zip(1..);
    let waves: f64 =
        terms.map(|(factor, wave)| factor * (TAU * f64::from(wave) * at).sin() / (TAU * f64::from(wave))).sum();
    at + waves / 0.35875
}

/// `count` points of a square of side 1, one in each row and in each column, the first in the middle: the lattice of one generator whose points are
/// farthest apart on the torus.
fn lattice(count: u32) -> Vec<[f64; 2]> {
    let point = |i: u32, step: u32| [i, (u64::from(i) * u64::from(step) % u64::from(count)) as u32];
    let apart = |step: u32| {
        (1..count)
            .map(|i| {
                let around = point(i, step).map(|at| u64::from(at.min(count - at)));
                around[0] * around[0] + around[1] * around[1]
            })
            .min()
            .unwrap_or(0)
    };
    // Steps that share a divisor with the count would put several points into a row.
    let steps = (1..count.max(2)).filter(|step| divisor(*step, count) == 1);
    // The first of equal ones.
    let best = steps.rev().max_by_key(|step| apart(*step)).unwrap_or(1);
    let share = |at: u32| (f64::from(at) / f64::from(count) + 0.5).fract();
    (0..count).map(|i| point(i, best).map(share)).collect()
}

fn divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { divisor(b, a % b) }
}

/// The mean of pictures.
#[derive(Debug, Default)]
pub struct Mean {
    layers: Option<Layers>,
    count: u32,
}

impl Mean {
    /// Adds a picture. `exact`: its layers that are no light are those of the mean.
    pub fn add(&mut self, picture: Layers, exact: bool) {
        self.count += 1;
        let Some(mean) = &mut self.layers else {
            self.layers = Some(picture);
            return;
        };
        for (sum, layer) in mean.layers.iter_mut().zip(picture.layers) {
            if is_light(&layer) {
                sum.data.iter_mut().zip(layer.data).for_each(|(sum, value)| *sum += value);
            } else if exact {
                *sum = layer;
            }
        }
    }

    /// The mean, and the names of its layers that are those of the middles of the pixels. `None` without pictures.
    pub fn finish(self) -> Option<(Layers, Vec<String>)> {
        let mut mean = self.layers?;
        let scale = 1.0 / self.count as f32;
        let light = mean.layers.iter_mut().filter(|layer| is_light(layer));
        light.flat_map(|layer| &mut layer.data).for_each(|value| *value *= scale);
        let exact = mean.layers.iter().filter(|layer| !is_light(layer)).map(|layer| layer.name.clone()).collect();
        Some((mean, exact))
    }
}

/// Colours have means; directions, distances and numbers have none. The engine has the same rule for the layers whose edges it smooths
/// ([`lucerna::technique::Shot::edges`]).
fn is_light(layer: &Layer) -> bool {
    layer.channels == ["R", "G", "B"]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(count: u32, filter: Filter) -> Vec<Vec2> {
        Smooth { count, filter, ..Smooth::default() }.places()
    }

    #[test]
    fn the_first_place_is_the_middle_and_rows_and_columns_have_one_each() {
        for filter in [Filter::Box, Filter::Tent, Filter::BlackmanHarris] {
            for count in [1, 2, 3, 8, 16, 25, 256] {
                let places = places(count, filter);
                assert_eq!(places.len(), count as usize);
                assert!(places[0].length() < 1e-6, "{filter:?} {count} {}", places[0]);
                let widest = [0.5, 1.0, 1.5][filter as usize];
                assert!(places.iter().all(|place| place.abs().max_element() <= widest));
                for axis in 0..2 {
                    let mut along: Vec<f32> = places.iter().map(|place| place[axis]).collect();
                    along.sort_by(f32::total_cmp);
                    assert!(along.windows(2).all(|pair| pair[0] < pair[1]), "{filter:?} {count}");
                }
            }
        }
        // Eight points of a square of side 1 can be this far apart in such a lattice, and not on a line.
        let eight = places(8, Filter::Box);
        let apart = |a: Vec2, b: Vec2| {
            let way = (a - b).abs();
            way.min(1.0 - way).length()
        };
        let least = (0..8).flat_map(|a| (0..a).map(move |b| (a, b))).map(|(a, b)| apart(eight[a], eight[b]));
        assert!((least.fold(1.0, f32::min) - 8f32.sqrt() / 8.0).abs() < 1e-6);
    }

    #[test]
    fn values_are_numbers_or_temporal() {
        assert_eq!(
            ["1", "temporal", "edges"].map(str::parse),
            [Aa::Mean(1), Aa::Temporal, Aa::Edges].map(Ok::<_, String>)
        );
        for bad in ["0", "1025", "-1", "", "Temporal", "taa"] {
            assert!(bad.parse::<Aa>().unwrap_err().contains("1..=1024, edges or temporal"), "{bad}");
        }
        for smooth in [
            Smooth::default(),
            Smooth { count: 5, ..Smooth::default() },
            Smooth { temporal: Some(3), ..Smooth::default() },
            Smooth { edges: true, ..Smooth::default() },
        ] {
            let SmoothArgs { aa, aa_frames: frames, .. } = smooth.args();
            let again = match aa {
                Some(Aa::Mean(count)) => Smooth { count, temporal: frames, ..Smooth::default() },
                Some(Aa::Edges) => Smooth { edges: true, ..Smooth::default() },
                _ => Smooth { temporal: frames, ..Smooth::default() },
            };
            assert_eq!(again, smooth);
        }
    }

    #[test]
    fn places_that_one_picture_serves_are_those_of_a_mean() {
        for filter in [Filter::Box, Filter::Tent, Filter::BlackmanHarris] {
            let smooth = Smooth { filter, edges: true, ..Smooth::default() };
            assert_eq!(smooth.edges().unwrap().to_vec(), places(8, filter));
            assert_eq!(Smooth { edges: false, ..smooth }.edges(), None);
        }
    }

    #[test]
    fn frames_look_at_places_of_the_filter_and_the_first_at_the_middle() {
        for filter in [Filter::Box, Filter::Tent, Filter::BlackmanHarris] {
            let smooth = Smooth { filter, temporal: Some(8), ..Smooth::default() };
            assert!(smooth.place(0).length() < 1e-6);
            let widest = [0.5, 1.0, 1.5][filter as usize];
            let places: Vec<Vec2> = (0..512).map(|frame| smooth.place(frame)).collect();
            assert!(places.iter().all(|place| place.abs().max_element() <= widest));
            let mean = places.iter().sum::<Vec2>() / 512.0;
            assert!(mean.length() < 0.01, "{mean}");
        }
        assert_eq!(Smooth::default().place(7), Vec2::ZERO);
    }

    #[test]
    fn places_have_the_density_of_their_filter() {
        let second = |filter: Filter| {
            let places = places(1021, filter);
            let mean = places.iter().sum::<Vec2>() / 1021.0;
            assert!(mean.length() < 5e-3, "{filter:?} {mean}");
            places.iter().map(|place| f64::from(place.x * place.x)).sum::<f64>() / 1021.0
        };
        // Variances in closed form: 1/12, 1/6, and 9 (1/12 − (0.48829 − 0.14128/4 + 0.01168/9) / (2 π² 0.35875)) for the window.
        let window: f64 = 9.0
            * (1.0 / 12.0 - (0.48829 - 0.14128 / 4.0 + 0.01168 / 9.0) / (2.0 * std::f64::consts::PI.powi(2) * 0.35875));
        for (filter, variance) in
            [(Filter::Box, 1.0 / 12.0), (Filter::Tent, 1.0 / 6.0), (Filter::BlackmanHarris, window)]
        {
            let found = second(filter);
            assert!((found / variance - 1.0).abs() < 5e-3, "{filter:?} {found} {variance}");
        }
        assert!(blackman_harris(0.0).abs() < 1e-12 && (blackman_harris(1.0) - 1.0).abs() < 1e-12);
        assert!((blackman_harris(0.5) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn light_is_averaged_and_depth_is_that_of_the_middle() {
        let picture = |light: f32, depth: f32| {
            Layers::rgb(1, 1, vec![light; 3])
                .with(Layer::new("direct", &["R", "G", "B"], vec![2.0 * light; 3]))
                .with(Layer::new("depth", &["Z"], vec![depth]))
        };
        let mut mean = Mean::default();
        mean.add(picture(1.0, 7.0), false);
        mean.add(picture(2.0, 8.0), false);
        mean.add(picture(6.0, 9.0), true);
        let (found, exact) = mean.finish().unwrap();
        assert_eq!((found.layers[0].data.clone(), found.layers[1].data.clone()), (vec![3.0; 3], vec![6.0; 3]));
        assert_eq!((found.layers[2].data.clone(), exact), (vec![9.0], vec!["depth".to_owned()]));
        assert!(Mean::default().finish().is_none());
    }
}
