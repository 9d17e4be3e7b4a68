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
    let report = |reference: &Reference| reports.get(reference.experiment.as_deref().unwrap_or(experiment));
    let may_lack = |reference: &Reference| report(reference).is_some_and(|report| report.may_lack(reference.full));
    let mut broken = Vec::new();
    // A reason counts only if everything that shows it exists.
    let mut shown = !number.shown.is_empty() && number.reason.is_some();
    for reference in &number.shown {
        if let Err(what) = reports.has(reference, experiment) {
            shown = false;
            if report(reference).is_some() && !may_lack(reference) {
                broken.push(what);
            }
        }
    }
    let verdict = |verdict| Judged { verdict, ours: None, broken: broken.clone() };
    if number.kind == Kind::Hardware {
        return verdict(Verdict::Hardware);
    }
    let Some(reference) = &number.ours else { return verdict(Verdict::NoCounterpart) };
    if report(reference).is_none() {
        return verdict(Verdict::NoReport);
    }
    if reference.full && report(reference).is_some_and(|report| report.quick) {
        return verdict(Verdict::FullModeOnly);
    }
    let found = match reports.cell(reference, experiment) {
        Ok(found) => found,
        Err(_) if may_lack(reference) => return verdict(Verdict::NoReport),
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
struct Counts {
    verdicts: [usize; 7],
    /// Numbers with a value of ours.
    measured: usize,
}

impl Counts {
    fn add(&mut self, judged: &Judged) {
        self.verdicts[judged.verdict as usize] += 1;
        self.measured += usize::from(judged.ours.is_some());
    }

    fn of(&self, verdict: Verdict) -> usize {
        self.verdicts[verdict as usize]
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
    for (name, report) in reports.all() {
        // The quick mode is named above.
        let own = report.warnings.iter().filter(|warning| !(report.quick && warning.starts_with("Quick mode")));
        page.warnings.extend(own.map(|warning| format!("{name}: {warning}")));
    }
    let missing: Vec<&str> = super::EXPERIMENTS.iter().copied().filter(|name| reports.get(name).is_none()).collect();
    if !missing.is_empty() {
        page.warnings.push(format!("No report of {}.", missing.join(", ")));
    }
    let mut sections = Vec::new();
    let [mut shares, mut times] = [
        ("shares", "Results of the papers, without times and rates"),
        ("shares-times", "Times and rates, which depend on the machine more than on the method"),
    ]
    .map(|(id, caption)| Table::new(id, caption, SHARES).digits(3).long());
    let mut whole = [Counts::default(); 2];
    let mut broken = Vec::new();
    for ledger in ledgers {
        let mut counts = [Counts::default(); 2];
        let mut section = Section::new(format!("{}: {}", ledger.short, ledger.document));
        let mut numbers = numbers(ledger);
        let mut settings = settings(ledger);
        for number in &ledger.number {
            let judged = judge(number, &ledger.experiment, reports);
            broken.extend(judged.broken.iter().map(|what| format!("{}, '{}': {what}", number.place, number.what)));
            let row = row(number, &judged);
            match number.kind {
                Kind::Result => {
                    let of = usize::from(number.is_time());
                    counts[of].add(&judged);
                    whole[of].add(&judged);
                    numbers.push(row);
                }
                Kind::Setting | Kind::Hardware => settings.push(row),
            }
        }
        for (table, counts) in [&mut shares, &mut times].into_iter().zip(&counts) {
            table.push(shown(&format!("{} ({})", ledger.short, ledger.experiment), counts));
        }
        section.add(numbers);
        if !settings.rows.is_empty() {
            section.add(settings);
        }
        section.add(figures(ledger, reports, &mut broken));
        sections.push(section);
    }
    for (table, counts) in [&mut shares, &mut times].into_iter().zip(&whole) {
        table.push(shown("all", counts));
    }
    let mut first = Section::new("Shares");
    first.text(
        "*Met*: our value meets the paper's by the rule of its line: `at least` and `at most` for qualities and costs, `within F` for a ratio between 1/F and F, `sign` for the same side of zero. Printed values are \
         rounded: half of the last digit, and at most 0.5 %, counts as no difference. `same` allows none. *Explained*: our value does not meet the paper's, and the entry names a table, a test or a page that shows the reason. \
         This page checks that the table, the test or the page exists; whether the reason is good, a reader decides. *Open*: our value does not meet the paper's, and no such place is named. *No counterpart*: the experiment does not have this \
         number. *Measured*: results with a value here; the last column is a share of these. Some of the papers' claims have no number; then the entry says which number stands for the claim. Times and rates have a table of their own, \
         because they depend on the machine. Settings of the experiments are listed apart and do not count.",
    );
    first.add(shares);
    first.add(times);
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

const SHARES: [&str; 10] = [
    "document",
    "results",
    "measured",
    "met",
    "explained",
    "open",
    "no counterpart",
    "full mode only",
    "no report",
    "met or explained (%)",
];

fn shown(name: &str, counts: &Counts) -> Vec<Cell> {
    let measured = counts.measured;
    let good = counts.of(Verdict::Met) + counts.of(Verdict::Explained);
    let all: usize = counts.verdicts.iter().sum();
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
        of(Verdict::NoReport),
        (measured > 0).then(|| 100.0 * good as f64 / measured as f64).into(),
    ]
}

const COLUMNS: [&str; 9] = ["place", "quantity", "unit", "paper", "ours", "ours / paper", "rule", "verdict", "reason"];

fn numbers(ledger: &Ledger) -> Table {
    Table::new(format!("numbers-{}", ledger.experiment), format!("{}: results", ledger.short), COLUMNS).long()
}

fn settings(ledger: &Ledger) -> Table {
    Table::new(format!("settings-{}", ledger.experiment), format!("{}: settings and machine", ledger.short), COLUMNS)
        .long()
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
    let mut table =
        Table::new(format!("figures-{}", ledger.experiment), format!("{}: figures", ledger.short), columns).long();
    for figure in &ledger.figure {
        for reference in figure.references() {
            let report = reports.get(reference.experiment.as_deref().unwrap_or(&ledger.experiment));
            let expected = report.is_some_and(|report| !report.may_lack(reference.full));
            if let Err(what) = reports.has(reference, &ledger.experiment)
                && expected
            {
                broken.push(format!("figure {}: {what}", figure.place));
            }
        }
        let named =
            |reference: &Reference| place(reference, reference.experiment.as_deref().unwrap_or(&ledger.experiment));
        let names = figure.references().map(named).collect::<Vec<_>>().join(", ");
        let text = match &figure.missing {
            Some(missing) if names.is_empty() => format!("none: {missing}"),
            Some(missing) => format!("none: {missing} See {names}."),
            None => names,
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
