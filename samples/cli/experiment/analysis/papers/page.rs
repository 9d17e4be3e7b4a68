//! The page of all papers.

use super::{
    judge::{Rule, Verdict},
    ledger::{Kind, Ledger, Number, Reference},
    reports::Reports,
};
use crate::report::{Cell, Page, Section, Table};

/// A number of a paper with our value.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    pub verdict: Verdict,
    pub ours: Option<f64>,
    /// Why a reference finds no cell although it should.
    pub broken: Vec<String>,
}

/// Judges a number by the reports.
pub fn judge(number: &Number, experiment: &str, reports: &Reports) -> Judged {
    let quick = |reference: &Reference| {
        let name = reference.experiment.as_deref().unwrap_or(experiment);
        reports.get(name).is_none_or(|report| report.quick)
    };
    let mut broken = Vec::new();
    // A reason counts only if everything that shows it exists.
    let mut shown = !number.shown.is_empty() && number.reason.is_some();
    for reference in &number.shown {
        if let Err(what) = reports.has(reference, experiment) {
            shown = false;
            if !(reference.full && quick(reference)) {
                broken.push(what);
            }
        }
    }
    let verdict = |verdict| Judged { verdict, ours: None, broken: broken.clone() };
    if number.kind == Kind::Hardware {
        return verdict(Verdict::Hardware);
    }
    let Some(reference) = &number.ours else { return verdict(Verdict::NoCounterpart) };
    if reference.full && quick(reference) {
        return verdict(Verdict::FullModeOnly);
    }
    let found = match reports.cell(reference, experiment) {
        Ok(found) => found,
        Err(what) => {
            broken.push(what);
            return Judged { verdict: Verdict::Open, ours: None, broken };
        }
    };
    let Some(ours) = found.number().filter(|ours| ours.is_finite()) else {
        broken.push(format!("the cell of '{}' is no number", number.what));
        return Judged { verdict: Verdict::Open, ours: None, broken };
    };
    let holds =
        number.met.as_deref().and_then(|rule| Rule::parse(rule).ok()).is_some_and(|r| r.holds(number.paper, ours));
    let verdict = match (holds, shown) {
        (true, _) => Verdict::Met,
        (false, true) => Verdict::Explained,
        (false, false) => Verdict::Open,
    };
    Judged { verdict, ours: Some(ours), broken }
}

/// Numbers by verdict.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counts([usize; 6]);

impl Counts {
    fn add(&mut self, verdict: Verdict) {
        self.0[verdict as usize] += 1;
    }

    fn of(&self, verdict: Verdict) -> usize {
        self.0[verdict as usize]
    }

    /// Numbers that have a counterpart in these reports.
    fn measured(&self) -> usize {
        [Verdict::Met, Verdict::Explained, Verdict::Open].into_iter().map(|verdict| self.of(verdict)).sum()
    }
}

/// The page of all ledgers.
pub fn page(ledgers: &[Ledger], reports: &Reports) -> Page {
    let mut page = Page::new("Every number of the papers beside ours");
    page.summary = "Each number and each figure that the papers print as a result, with our value, and the reason where they differ. This page follows from \
                    the reports of the experiments (`lucerna reproduce all`)."
        .into();
    let quick: Vec<&str> = reports.all().filter(|(_, report)| report.quick).map(|(name, _)| name).collect();
    if !quick.is_empty() {
        page.warnings.push(format!(
            "Quick mode of {}: fewer views, smaller pictures or fewer samples than the experiment proper.",
            quick.join(", ")
        ));
    }
    let mut sections = Vec::new();
    let mut shares = Table::new(
        "shares",
        "Results of the papers",
        [
            "document",
            "results",
            "measured",
            "met",
            "explained",
            "open",
            "no counterpart",
            "full mode only",
            "met or explained (%)",
        ],
    )
    .digits(3);
    let mut whole = Counts::default();
    let mut broken = Vec::new();
    for ledger in ledgers {
        let mut counts = Counts::default();
        let mut section = Section::new(&ledger.document);
        let mut numbers = numbers(ledger);
        let mut settings = settings(ledger);
        for number in &ledger.number {
            let judged = judge(number, &ledger.experiment, reports);
            broken.extend(judged.broken.iter().map(|what| format!("{}, '{}': {what}", number.place, number.what)));
            let row = row(number, &judged);
            match number.kind {
                Kind::Result => {
                    counts.add(judged.verdict);
                    whole.add(judged.verdict);
                    numbers.push(row);
                }
                Kind::Setting | Kind::Hardware => settings.push(row),
            }
        }
        shares.push(shown(&ledger.document, &counts));
        section.add(numbers);
        if !settings.rows.is_empty() {
            section.add(settings);
        }
        section.add(figures(ledger, reports, &mut broken));
        sections.push(section);
    }
    shares.push(shown("all", &whole));
    let mut first = Section::new("Shares");
    first.text(
        "*Met*: our value meets the paper's by the rule in the column *rule* (`at least` and `at most` for qualities and costs, `within F`: a ratio between 1/F and F). \
         *Explained*: it does not, and a table, a test or a page shows the reason. *Open*: it does not, and the reason is not shown. *No counterpart*: the experiment does \
         not have this number. *Measured* is the number of results with a value here. Some of the papers' claims have no number; \
         then the entry says which number stands for the claim. Settings of the experiments are listed apart and do not count.",
    );
    first.add(shares);
    page.add(first);
    for section in sections {
        page.add(section);
    }
    if !broken.is_empty() {
        let mut section = Section::new("References without a cell");
        section.text("These entries name a cell, plot or picture that the reports do not have, for instance because assets are missing.");
        let mut table = Table::new("broken", "References without a cell", ["entry"]);
        broken.into_iter().for_each(|text| table.push([text.into()]));
        section.add(table);
        page.add(section);
    }
    for (name, report) in reports.all() {
        for fact in ["Device", "Driver", "Mode", "Size", "Revision"] {
            let value = report.fact(fact);
            if !value.is_empty() {
                page.facts.push((format!("{name}: {}", fact.to_lowercase()), value.to_owned()));
            }
        }
    }
    page
}

fn shown(name: &str, counts: &Counts) -> Vec<Cell> {
    let measured = counts.measured();
    let good = counts.of(Verdict::Met) + counts.of(Verdict::Explained);
    let all: usize = counts.0.iter().sum();
    let of = |verdict| Cell::from(counts.of(verdict));
    vec![
        name.into(),
        all.into(),
        measured.into(),
        of(Verdict::Met),
        of(Verdict::Explained),
        of(Verdict::Open),
        of(Verdict::NoCounterpart),
        of(Verdict::FullModeOnly),
        (measured > 0).then(|| 100.0 * good as f64 / measured as f64).into(),
    ]
}

const COLUMNS: [&str; 9] = ["place", "quantity", "unit", "paper", "ours", "ours / paper", "rule", "verdict", "reason"];

fn numbers(ledger: &Ledger) -> Table {
    Table::new(format!("numbers-{}", ledger.experiment), format!("{}: results", ledger.short), COLUMNS)
}

fn settings(ledger: &Ledger) -> Table {
    Table::new(format!("settings-{}", ledger.experiment), format!("{}: settings and machine", ledger.short), COLUMNS)
}

fn row(number: &Number, judged: &Judged) -> Vec<Cell> {
    let ratio = judged.ours.map(|ours| ours / number.paper).filter(|ratio| ratio.is_finite());
    let reason = match judged.verdict {
        Verdict::NoCounterpart => number.missing.clone(),
        _ => number.reason.clone().or_else(|| number.missing.clone()),
    };
    vec![
        number.place.as_str().into(),
        number.what.as_str().into(),
        number.unit.as_str().into(),
        number.paper.into(),
        judged.ours.into(),
        ratio.into(),
        number.met.as_deref().unwrap_or("").into(),
        judged.verdict.name().into(),
        reason.unwrap_or_default().into(),
    ]
}

fn figures(ledger: &Ledger, reports: &Reports, broken: &mut Vec<String>) -> Table {
    let columns = ["figure", "content", "ours"];
    let mut table = Table::new(format!("figures-{}", ledger.experiment), format!("{}: figures", ledger.short), columns);
    for figure in &ledger.figure {
        let text = match (&figure.ours, &figure.missing) {
            (Some(ours), _) => {
                let mut names = Vec::new();
                for reference in ours.list() {
                    let name = reference.experiment.as_deref().unwrap_or(&ledger.experiment);
                    let quick = reports.get(name).is_none_or(|report| report.quick);
                    if let Err(what) = reports.has(reference, &ledger.experiment)
                        && !(reference.full && quick)
                    {
                        broken.push(format!("figure {}: {what}", figure.place));
                    }
                    names.push(place(reference, name));
                }
                names.join(", ")
            }
            (None, missing) => format!("none: {}", missing.as_deref().unwrap_or("")),
        };
        table.push([figure.place.as_str().into(), figure.what.as_str().into(), text.into()]);
    }
    table
}

/// The place of a counterpart, for a reader.
fn place(reference: &Reference, experiment: &str) -> String {
    let full = if reference.full { " (full mode)" } else { "" };
    if let Some(file) = &reference.file {
        return format!("`{file}`");
    }
    if let Some(test) = &reference.test {
        return format!("test `{test}`");
    }
    let of = [("table", &reference.table), ("plot", &reference.plot), ("pictures", &reference.images)];
    let named = of.into_iter().find_map(|(kind, id)| Some(format!("{kind} `{}`", id.as_ref()?)));
    format!("{} of the report `{experiment}`{full}", named.unwrap_or_default())
}
