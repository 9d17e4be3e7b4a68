//! The study that the paper leaves open: error, memory and work of a frame against the numbers of samples a cluster, directions and vectors.

use lucerna::Result;
use serde_json::Value;

use super::errors::{Measured, PARTS, mean};
use crate::{
    experiment::{kinds::Times, results::Results},
    report::{Axis, Cell, Plot, Section, Table},
};

/// Techniques whose name begins so belong to the study.
const STUDY: &str = "study";
/// Presets have an error of at most so many times the smallest one of the study, without a parameter `within` of the experiment.
const WITHIN: f64 = 1.25;

const PRESETS: [&str; 3] = ["exact", "small", "fast"];

/// Settings of a bake that are varied: heading, path of the bake's own value, and path of the number of vectors that are used.
const VARIED: [(&str, &str, Option<&str>); 5] = [
    ("samples a cluster", "/bake/cluster", None),
    ("directions", "/bake/directions", None),
    ("d₁", "/bake/visibility", Some("/cut/visibility")),
    ("d₂", "/bake/light", Some("/cut/light")),
    ("receivers", "/bake/receivers", Some("/cut/receivers")),
];

/// A choice of settings with the means over all lights.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Choice {
    pub settings: [f64; 5],
    /// Errors of blocks, %: of the shadow, and of direct, indirect and all light.
    pub errors: [Option<f64>; 4],
    pub megabytes: f64,
    /// Millions of products in a frame.
    pub products: f64,
    /// Median time of a frame, ms, and time of the bake, s.
    pub frame: Option<f64>,
    pub bake: Option<f64>,
}

impl Choice {
    fn total(&self) -> f64 {
        self.errors[3].unwrap_or(f64::INFINITY)
    }

    /// What is traded: error, memory and work.
    fn costs(&self) -> [f64; 3] {
        [self.total(), self.megabytes, self.products]
    }

    fn name(&self) -> String {
        let [cluster, directions, visibility, light, receivers] = self.settings;
        format!("{cluster} a cluster, {directions} directions, {visibility}/{light}/{receivers}")
    }
}

/// Whether each choice is on the front: no other one is as good in all costs and better in one.
pub(super) fn front<const N: usize>(costs: &[[f64; N]]) -> Vec<bool> {
    let better = |a: &[f64; N], b: &[f64; N]| a.iter().zip(b).all(|(a, b)| a <= b) && a != b;
    costs.iter().map(|one| !costs.iter().any(|other| better(other, one))).collect()
}

/// The choice with the smallest error; that with the fewest bytes and that with the fewest products whose error is at most `within` times the
/// smallest one.
pub(super) fn presets(choices: &[Choice], within: f64) -> Option<[usize; 3]> {
    let least = |of: &dyn Fn(&Choice) -> f64, most: f64| {
        let fit = choices.iter().enumerate().filter(|(_, choice)| choice.total() <= most);
        fit.min_by(|(_, a), (_, b)| of(a).total_cmp(&of(b)).then(a.total().total_cmp(&b.total()))).map(|(at, _)| at)
    };
    let exact = least(&Choice::total, f64::MAX)?;
    let most = within * choices[exact].total();
    Some([exact, least(&|choice| choice.megabytes, most)?, least(&|choice| choice.products, most)?])
}

/// The choices of the study, in the order of the experiment.
fn choices(results: &Results, measured: &[Measured<'_>]) -> Result<Vec<Choice>> {
    let mut groups: Vec<([f64; 5], &Value, Vec<&Measured<'_>>)> = Vec::new();
    for one in measured.iter().filter(|one| one.case.run.method.starts_with(STUDY)) {
        let settings = VARIED.map(|(_, bake, cut)| {
            let cut = cut.map(|path| one.case.number(path)).filter(|cut| *cut > 0.0);
            cut.unwrap_or_else(|| one.case.number(bake))
        });
        // The first vectors of a larger bake are nearly, but not exactly, those of a bake of its own.
        let bake = one.case.setting("/bake");
        match groups.iter_mut().find(|(known, of, _)| *known == settings && *of == bake) {
            Some((_, _, list)) => list.push(one),
            None => groups.push((settings, bake, vec![one])),
        }
    }
    let mut list = Vec::new();
    for (settings, _, of) in groups {
        let times = of.iter().map(|one| results.times(one.case.run)).collect::<Result<Vec<_>>>()?;
        let fact = |name: &str| mean(times.iter().filter_map(|times| times.fact(name)));
        let sum = |names: &[&str]| names.iter().filter_map(|name| fact(name)).sum::<f64>() / 1e6;
        list.push(Choice {
            settings,
            errors: std::array::from_fn(|part| mean(of.iter().filter_map(|one| Some(one.parts[part]?.blocks)))),
            megabytes: sum(&[
                "bytes visibility",
                "bytes visibility vectors",
                "bytes basis",
                "bytes transfer",
                "bytes links",
            ]),
            products: sum(&["visibility_products", "transfer_products", "basis_products"]),
            frame: mean(times.iter().filter_map(Times::frame)),
            bake: fact("seconds whole"),
        });
    }
    Ok(list)
}

/// The table and the plots of the study; `None` without pictures of it.
pub(super) fn section(results: &Results, measured: &[Measured<'_>]) -> Result<Option<Section>> {
    let choices = choices(results, measured)?;
    let parameter = results.experiment.parameters.get("within").and_then(serde_json::Value::as_f64);
    let within = parameter.unwrap_or(WITHIN);
    Ok((!choices.is_empty()).then(|| shown(&choices, within)))
}

fn shown(choices: &[Choice], within: f64) -> Section {
    let mut section = Section::new("The study that the paper leaves open");
    section.text(format!(
        "Settings of the bake against error, memory and the work of a frame. Errors are those of blocks of 8×8 pixels, means over the lights of the study. Vectors are ordered by the share \
         that they describe: a row with fewer vectors uses the first ones of a bake with more, so only the numbers of samples a cluster and of directions need \
         bakes of their own. The time of a bake is that of the larger bake. *Memory*: means, coefficients and vectors of the visibility, bases, and transfer. *Products*: for a light of one point, those of \
         the visibility, of the projection and transfer, and of all scatterings; the last of these grow with the square of the number of all vectors. \
         *Front*: no other row is at least as good in error of all light, memory and products, and better in one. Three presets: *exact* has the \
         smallest error; *small* has the fewest bytes, and *fast* the fewest products, with an error of at most {within} times the smallest one."
    ));
    let named = presets(choices, within).unwrap_or([usize::MAX; 3]);
    let front = front(&choices.iter().map(Choice::costs).collect::<Vec<_>>());
    let heads = VARIED.iter().map(|(head, ..)| (*head).to_owned());
    let columns = heads.clone().chain(PARTS.map(|(part, _)| format!("{part} (%)")));
    let columns = columns.chain(["memory (MB)", "products (10⁶)", "front", "preset"].map(str::to_owned));
    let mut table = Table::new("study", "Settings against errors, memory and work", columns);
    let columns = heads.chain(["frame (ms)", "bake (s)"].map(str::to_owned));
    let mut times = Table::new("study-times", "Measured times", columns).timed();
    for (at, choice) in choices.iter().enumerate() {
        let settings = || choice.settings.iter().map(|value| Cell::from(*value));
        let preset: Vec<&str> = named.iter().zip(PRESETS).filter(|(of, _)| **of == at).map(|(_, name)| name).collect();
        let errors = choice.errors.iter().map(|error| Cell::from(*error));
        let rest: [Cell; 4] = [
            choice.megabytes.into(),
            choice.products.into(),
            front[at].then_some("yes").into(),
            (!preset.is_empty()).then(|| preset.join(", ")).into(),
        ];
        table.push(settings().chain(errors).chain(rest));
        times.push(settings().chain([choice.frame.into(), choice.bake.into()]));
    }
    section.add(table);
    let columns = ["preset".to_owned()].into_iter().chain(VARIED.iter().map(|(head, ..)| (*head).to_owned()));
    let columns = columns.chain(["error (%)", "memory (MB)", "products (10⁶)"].map(str::to_owned));
    let mut three = Table::new("presets", "Three presets", columns);
    for (name, at) in PRESETS.into_iter().zip(named) {
        let Some(choice) = choices.get(at) else { continue };
        let settings = choice.settings.iter().map(|value| Cell::from(*value));
        three.push([name.into()].into_iter().chain(settings).chain(choice.costs().map(Cell::from)));
    }
    section.add(three);
    for (id, caption, axis, of) in [
        ("study-memory", "Error against memory", "memory (MB)", (|choice| choice.megabytes) as fn(&Choice) -> f64),
        ("study-work", "Error against the work of a frame", "products (10⁶)", |choice| choice.products),
    ] {
        let costs: Vec<[f64; 2]> = choices.iter().map(|choice| [of(choice), choice.total()]).collect();
        let mut line: Vec<(f64, f64)> =
            self::front(&costs).iter().zip(&costs).filter(|(is, _)| **is).map(|(_, [x, y])| (*x, *y)).collect();
        line.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (x, y) = (Axis::new(axis).log(), Axis::new("error of all light (%)"));
        let dots = choices.iter().map(|choice| (of(choice), choice.total(), choice.name()));
        let mut plot = Plot::new(id, caption, x, y).named_points("choices", dots).line("front", line);
        for (name, at) in PRESETS.into_iter().zip(named) {
            let one = choices.get(at).map(|choice| (of(choice), choice.total(), choice.name()));
            plot = plot.named_points(name, one);
        }
        section.add(plot);
    }
    section.add(times);
    section
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Block;

    fn choice(error: f64, megabytes: f64, products: f64) -> Choice {
        Choice { errors: [None, None, None, Some(error)], megabytes, products, ..Choice::default() }
    }

    #[test]
    fn nothing_on_the_front_is_beaten() {
        assert_eq!(
            front(&[[1.0, 5.0], [2.0, 2.0], [2.0, 3.0], [3.0, 2.0], [4.0, 1.0]]),
            [true, true, false, false, true]
        );
        // Equal choices do not beat each other.
        assert_eq!(front(&[[1.0, 1.0], [1.0, 1.0]]), [true, true]);
    }

    #[test]
    fn presets_are_within_their_error() {
        let list = [choice(10.0, 50.0, 9.0), choice(12.0, 20.0, 8.0), choice(12.4, 30.0, 2.0), choice(20.0, 1.0, 1.0)];
        assert_eq!(presets(&list, 1.25), Some([0, 1, 2]));
        assert_eq!(presets(&list, 1.0), Some([0, 0, 0]));
        assert_eq!(presets(&[], 1.25), None);
    }

    #[test]
    fn the_table_names_front_and_presets() {
        let list = [choice(10.0, 50.0, 9.0), choice(12.0, 20.0, 8.0), choice(12.5, 60.0, 10.0)];
        let section = shown(&list, 1.25);
        let table = section.blocks.iter().find_map(|block| match block {
            Block::Table(table) if table.id == "study" => Some(table),
            _ => None,
        });
        let rows: Vec<_> = table.unwrap().rows.iter().map(|row| row[11..].to_vec()).collect();
        assert_eq!(rows[0], ["yes".into(), "exact".into()]);
        assert_eq!(rows[1], ["yes".into(), "small, fast".into()]);
        assert_eq!(rows[2], [Cell::Empty, Cell::Empty]);
    }
}
