//! Assignment of the passes of a frame to the stages of the paper's figures.

use lucerna::Result;

use crate::{
    experiment::results::{Done, Results},
    report::Cell,
};

/// Parts of a frame, finer than the paper's stages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    Shooting,
    /// Importance resampling: the choice of virtual lights among the candidates.
    Choosing,
    /// Sorting virtual lights and building the light tree.
    Sorting,
    Visible,
    Direct,
    /// Ray trees of mirrors and glass, and all light at their surfaces.
    Trees,
    Gathering,
    /// Gathering at full resolution for pixels without a matching coarse texel.
    Refining,
    /// Compensation of the bound by short rays.
    Compensation,
    Filters,
    History,
    /// The sum, the sky, uploads and clears.
    Other,
}

/// Columns of figures 4 and 5.
pub(super) const STAGES: [&str; 5] =
    ["shooting (%)", "direct and specular (%)", "indirect (%)", "filters (%)", "other (%)"];

impl Part {
    /// Index into [`STAGES`].
    fn stage(self) -> usize {
        match self {
            Self::Shooting | Self::Choosing | Self::Sorting => 0,
            Self::Visible | Self::Direct | Self::Trees => 1,
            Self::Gathering | Self::Refining | Self::Compensation => 2,
            Self::Filters | Self::History => 3,
            Self::Other => 4,
        }
    }
}

/// Names of passes. A name with a star stands for all names with this beginning.
const PARTS: &[(Part, &[&str])] = &[
    (Part::Shooting, &["igi.shoot", "fill igi.candidates", "fill igi.paths"]),
    (Part::Choosing, &["igi.points", "igi.importance", "igi.cumulate", "igi.resample", "fill igi.importances"]),
    (Part::Sorting, &["igi.light_tree_*"]),
    (Part::Visible, &["passes.gbuffer*"]),
    (
        Part::Direct,
        &["igi.direct", "clear igi.direct", "clear igi.soft", "igi.soft_noise", "igi.soft_filter", "igi.soft_add"],
    ),
    (
        Part::Trees,
        &[
            "igi.ray_tree_grow",
            "igi.ray_tree_sum",
            "igi.ray_tree_direct",
            "igi.ray_tree_gather*",
            "igi.cache*",
            "igi.near_begin_tree",
            "igi.near_end_tree",
            "fill igi.trees",
            "clear igi.sharp",
            "fill igi.cache*",
        ],
    ),
    (
        Part::Gathering,
        &[
            "igi.receivers",
            "igi.gather",
            "igi.gather_picks",
            "igi.gather_raster",
            "igi.raster*",
            "clear igi.irradiance",
        ],
    ),
    (Part::Refining, &["igi.refine*"]),
    (Part::Compensation, &["igi.near*", "fill igi.near", "clear igi.near_light"]),
    (Part::Filters, &["igi.guide", "igi.discontinuity", "igi.smooth", "igi.upsample", "fill igi.unmatched"]),
    (
        Part::History,
        &[
            "igi.history*",
            "passes.motion",
            "igi.probe*",
            "igi.recall",
            "igi.remember",
            "copy igi.history*",
            "fill igi.history*",
        ],
    ),
    (Part::Other, &["igi.compose"]),
];

/// The part of a pass, by its name without its number and its kind of ray tracing. The longest matching name counts. `None`: the pass belongs to
/// no part.
fn part_of(name: &str) -> Option<Part> {
    let name = name.split('#').next().unwrap_or(name);
    let name = name.strip_suffix(" (ray query)").unwrap_or(name);
    let fits = |pattern: &&str| match pattern.strip_suffix('*') {
        Some(beginning) => name.starts_with(beginning),
        None => name == *pattern,
    };
    let all = PARTS.iter().flat_map(|(part, patterns)| patterns.iter().map(move |pattern| (*part, *pattern)));
    let best = all.filter(|(_, pattern)| fits(pattern)).max_by_key(|(_, pattern)| pattern.trim_end_matches('*').len());
    best.map(|(part, _)| part)
}

/// Milliseconds of a frame by its parts.
#[derive(Clone, Debug, Default)]
pub(super) struct Spent {
    /// Time of the whole frame; `None` if it was not measured.
    pub frame: Option<f64>,
    parts: Vec<(Part, f64)>,
}

impl Spent {
    /// Sums the times of passes, given in the order in which they ran. Passes of short paths belong to the part that has started the paths: the
    /// visible surfaces, or the ray trees. The filter runs for direct light and for the light of short paths.
    fn of<'a>(frame: Option<f64>, passes: impl IntoIterator<Item = (&'a str, f64)>) -> Self {
        let (mut parts, mut in_trees, mut apart) = (Vec::<(Part, f64)>::new(), false, false);
        for (name, ms) in passes {
            let mut part = part_of(name).unwrap_or(Part::Other);
            in_trees |= name.starts_with("igi.near_begin_tree");
            if in_trees && part == Part::Compensation {
                part = Part::Trees;
            }
            in_trees &= !name.starts_with("igi.near_end_tree");
            apart |= name.starts_with("clear igi.near_light");
            if apart && part == Part::Direct {
                part = Part::Compensation;
            }
            apart &= !name.starts_with("igi.near_add");
            match parts.iter_mut().find(|(known, _)| *known == part) {
                Some((_, sum)) => *sum += ms,
                None => parts.push((part, ms)),
            }
        }
        Self { frame, parts }
    }

    /// Sum over some parts. (The sum of an empty list is −0, which a table would show.)
    fn sum(&self, of: impl Fn(Part) -> bool) -> f64 {
        self.parts.iter().filter(|(part, _)| of(*part)).fold(0.0, |sum, (_, ms)| sum + ms)
    }

    /// Time of a part.
    pub fn part(&self, part: Part) -> f64 {
        self.sum(|known| known == part)
    }

    /// Time of one of [`STAGES`].
    fn stage(&self, stage: usize) -> f64 {
        self.sum(|part| part.stage() == stage)
    }

    /// The paper's stage *direct and specular*.
    pub fn direct(&self) -> f64 {
        self.stage(1)
    }

    /// The paper's stage *indirect*, without filters.
    pub fn indirect(&self) -> f64 {
        self.stage(2)
    }

    /// The time from gathering to the irradiance of every pixel: gathering, refinement, compensation, filters.
    pub fn gathering_and_filters(&self) -> f64 {
        self.stage(2) + self.stage(3)
    }

    /// Percentages of [`STAGES`] of the time of all passes; their sum is 100.
    pub fn shares(&self) -> [Cell; STAGES.len()] {
        let all = self.sum(|_| true);
        std::array::from_fn(|stage| (all > 0.0).then(|| 100.0 * self.stage(stage) / all).into())
    }
}

/// The time of a run by parts.
pub(super) fn spent(results: &Results, run: &Done) -> Result<Spent> {
    let times = results.times(run)?;
    Ok(Spent::of(times.frame(), times.passes.iter().map(|(name, ms)| (name.as_str(), *ms))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shader_of_the_technique_has_a_part() {
        let own: Vec<&str> = lucerna::shaders::ALL.iter().map(|shader| shader.name).collect();
        let own: Vec<&str> = own.into_iter().filter(|name| name.starts_with("igi.")).collect();
        assert!(own.len() > 40, "{own:?}");
        for name in own {
            assert!(part_of(name).is_some(), "{name} belongs to no stage");
            assert_eq!(part_of(name), part_of(&format!("{name}#17")), "{name}");
        }
        for (name, part) in [
            ("igi.gather#3", Part::Gathering),
            ("igi.gather (ray query)#3", Part::Gathering),
            ("igi.ray_tree_gather#3", Part::Trees),
            ("igi.ray_tree_gather_picks", Part::Trees),
            ("igi.ray_tree_direct", Part::Trees),
            ("igi.raster#12", Part::Gathering),
            ("igi.raster_cutout#12", Part::Gathering),
            ("igi.refine#2", Part::Refining),
            ("igi.refine_groups", Part::Refining),
            ("igi.smooth#2", Part::Filters),
            ("igi.probe_light", Part::History),
            ("passes.gbuffer.opaque.both", Part::Visible),
            ("igi.compose", Part::Other),
        ] {
            assert_eq!(part_of(name), Some(part), "{name}");
        }
        assert_eq!(part_of("passes.skybox"), None);
    }

    #[test]
    fn shares_add_up_and_what_mirrors_show_counts_for_them() {
        let passes = [
            ("upload", 1.0),
            ("igi.shoot", 2.0),
            ("igi.soft_filter", 20.0),
            ("clear igi.near_light", 0.5),
            ("igi.near_begin", 3.0),
            ("igi.near_trace", 3.0),
            ("igi.soft_filter#2", 0.25),
            ("igi.near_add", 0.25),
            ("igi.near_begin_tree", 5.0),
            ("igi.near_trace#2", 6.0),
            ("igi.near_end_tree", 7.0),
            ("igi.near_direct#9", 8.0),
            ("igi.smooth", 9.0),
            ("igi.refine", 10.0),
            ("passes.skybox", 11.0),
        ];
        let spent = Spent::of(Some(90.0), passes);
        assert_eq!(spent.part(Part::Compensation), 15.0);
        assert_eq!(spent.direct(), 38.0);
        assert_eq!(spent.indirect(), 25.0);
        assert_eq!(spent.gathering_and_filters(), 34.0);
        let sum: f64 = spent.shares().iter().map(|cell| if let Cell::Number(n) = cell { *n } else { 0.0 }).sum();
        assert!((sum - 100.0).abs() < 1e-9, "{sum}");
        assert!(Spent::of(None, []).part(Part::Filters).is_sign_positive());
        assert!(Spent::of(None, []).shares().iter().all(|cell| *cell == Cell::Empty));
    }
}
