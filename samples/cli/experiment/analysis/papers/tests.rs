use std::path::{Path, PathBuf};

use serde_json::json;

use super::{
    EXPERIMENTS, LEDGERS,
    judge::{Rule, Verdict},
    ledger::{Ledger, Number, Reference},
    page::{judge, page},
    reports::{Found, Reports},
};
use crate::{experiment::file::BUILTIN, report::Cell};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn ledgers() -> Vec<Ledger> {
    LEDGERS.iter().map(|(name, text)| Ledger::parse(name, text).unwrap_or_else(|error| panic!("{error}"))).collect()
}

#[test]
fn every_ledger_can_be_read_and_names_an_experiment_that_comes_along() {
    for ledger in ledgers() {
        assert!(EXPERIMENTS.contains(&ledger.experiment.as_str()), "{}", ledger.experiment);
        assert!(ledger.number.len() > 10, "{}", ledger.document);
    }
    for name in EXPERIMENTS {
        assert!(BUILTIN.iter().any(|(known, _)| known == name), "{name}");
    }
}

/// All Rust files below a folder.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// Whether a source has a test of this name.
fn is_test(source: &str, name: &str) -> bool {
    let Some(at) = source.find(&format!("fn {name}(")) else { return false };
    source[..at].rfind("#[test]").is_some_and(|test| !source[test..at].contains('}'))
}

#[test]
fn every_test_and_every_page_that_shows_a_reason_exists() {
    let mut files = Vec::new();
    for folder in ["engine", "samples", "tests"] {
        sources(&root().join(folder), &mut files);
    }
    let mut wrong = Vec::new();
    for ledger in ledgers() {
        for reference in ledger.references() {
            if let Some(test) = &reference.test {
                let (file, name) = test.rsplit_once("::").unwrap();
                let file = file.rsplit("::").next().unwrap();
                let of = |path: &&PathBuf| {
                    path.file_stem().is_some_and(|stem| stem == file)
                        || path.parent().is_some_and(|p| p.ends_with(file))
                };
                let text = |path: &PathBuf| std::fs::read_to_string(path).unwrap();
                if !files.iter().filter(of).any(|path| is_test(&text(path), name)) {
                    wrong.push(format!("{}: no test {test}", ledger.document));
                }
            }
            if let Some(file) = &reference.file {
                let there = match (&reference.words, std::fs::read(root().join(file))) {
                    (_, Err(_)) => false,
                    (None, Ok(_)) => true,
                    (Some(words), Ok(bytes)) => String::from_utf8_lossy(&bytes).contains(words.as_str()),
                };
                if !there {
                    wrong.push(format!("{}: {file} without {:?}", ledger.document, reference.words));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A test cannot make the page anew, because its reports take half an hour. But the page must have a row for each number of today's ledgers, and no more.
#[test]
fn the_page_in_docs_has_the_numbers_of_the_ledgers() {
    let page = std::fs::read_to_string(root().join("docs/reproduction.md")).unwrap();
    let tables = page.split("\n\n").filter(|block| block.starts_with("| place | quantity |"));
    let mut rows: Vec<&str> = tables.flat_map(|table| table.trim_end().lines().skip(2)).collect();
    let of =
        |ledger: Ledger| ledger.number.into_iter().map(|number| format!("| {} | {} | ", number.place, number.what));
    let mut wanted: Vec<String> = ledgers().into_iter().flat_map(of).collect();
    assert!(wanted.len() > 400, "{} numbers", wanted.len());
    wanted.retain(|start| match rows.iter().position(|row| row.starts_with(start.as_str())) {
        Some(at) => {
            rows.swap_remove(at);
            false
        }
        None => true,
    });
    let how = "make it anew: `lucerna reproduce all --quick -o DIR`, which writes DIR/reproduction.md";
    assert!(wanted.is_empty(), "docs/reproduction.md lacks {wanted:#?}; {how}");
    assert!(rows.is_empty(), "docs/reproduction.md has numbers that are in no ledger: {rows:#?}; {how}");
}

#[test]
fn rules_hold_where_they_should() {
    let holds = |rule: &str, paper: f64, ours: f64| Rule::parse(rule).unwrap().holds(paper, ours);
    for (rule, paper, yes, no) in [
        ("at least", 7.18, 7.176, 7.17),
        ("at most", 7.18, 7.184, 7.19),
        ("at least", 99.83, 99.826, 99.62),
        ("at least", 1.0, 0.996, 0.9),
        ("within 1.25", 2.0, 1.6, 1.5),
        ("within 1.25", 2.0, 2.5, 2.6),
        ("within 2", -3.0, -2.0, 2.0),
        ("within 2", 0.0, 0.0, 0.1),
        ("same", 227.0, 227.0, 228.0),
        ("sign", 0.0003, 0.01, -0.01),
        ("sign", -1.0, -9.0, 0.0),
    ] {
        assert!(holds(rule, paper, yes), "{rule}: {yes} for {paper}");
        assert!(!holds(rule, paper, no), "{rule}: {no} for {paper}");
    }
    for wrong in ["", "within", "within 1", "within x", "more"] {
        assert!(Rule::parse(wrong).is_err(), "{wrong}");
    }
    assert!(!holds("at least", 1.0, f64::NAN) && !holds("within 2", 1.0, f64::NAN));
}

fn reports() -> Reports {
    let table = json!({
        "caption": "", "columns": ["scene", "samples", "gain", "text"],
        "rows": [["a", 24.0, 1.5, "1,200"], ["a", 48.0, 3.0, null], ["b", 24.0, 4.0, "many"], ["b", 24.0, 5.0, ""]],
    });
    let data = json!({ "facts": { "Mode": "quick" }, "tables": { "gains": table }, "plots": { "p": { "series": [{ "points": [[0.0, 1.0]] }] }, "empty": { "series": [] } }, "images": ["desk"] });
    Reports::of("isr", data)
}

fn reference(text: &str) -> Reference {
    toml::from_str(text).unwrap()
}

#[test]
fn a_cell_is_found_by_the_values_of_its_row() {
    let reports = reports();
    let cell = |text: &str| reports.cell(&reference(text), "isr");
    let found = cell("table = 'gains'\ncolumn = 'gain'\nrow = { scene = 'a', samples = '48' }");
    assert_eq!(found, Ok(Found::Number(3.0)));
    let found = cell("table = 'gains'\ncolumn = 'gain'\nscale = 100\nrow = { scene = 'a', samples = '24' }");
    assert_eq!(found, Ok(Found::Number(150.0)));
    let found = cell("table = 'gains'\ncolumn = 'text'\nrow = { scene = 'a', samples = '24' }").unwrap();
    assert_eq!(found.number(), Some(1200.0));
    for (text, says) in [
        ("table = 'none'\ncolumn = 'gain'", "no table 'none'"),
        ("table = 'gains'\ncolumn = 'loss'\nrow = { scene = 'a', samples = '24' }", "no column 'loss'"),
        ("table = 'gains'\ncolumn = 'gain'\nrow = { scene = 'b' }", "2 rows"),
        ("table = 'gains'\ncolumn = 'gain'\nrow = { scene = 'c' }", "0 rows"),
        ("table = 'gains'\ncolumn = 'text'\nrow = { scene = 'a', samples = '48' }", "is empty"),
        ("in = 'igi'\ntable = 'gains'\ncolumn = 'gain'", "no report of igi"),
    ] {
        let error = cell(text).unwrap_err();
        assert!(error.contains(says), "{text}: {error}");
    }
    assert_eq!(reports.has(&reference("plot = 'p'"), "isr"), Ok(()));
    assert!(reports.has(&reference("plot = 'empty'"), "isr").is_err());
    assert_eq!(reports.has(&reference("images = 'desk'"), "isr"), Ok(()));
    assert!(
        reports.has(&reference("plot = 'q'"), "isr").is_err()
            && reports.has(&reference("images = 'x'"), "isr").is_err()
    );
}

const ENTRY: &str = "place = '1'\nwhat = 'gain'\nunit = '%'\nmet = 'at least'\n";

fn number(text: &str) -> Number {
    toml::from_str(&format!("{ENTRY}{text}")).unwrap()
}

#[test]
fn a_reason_counts_only_if_its_proof_exists() {
    let reports = reports();
    let ours = "ours = { table = 'gains', row = { scene = 'a', samples = '48' }, column = 'gain' }\n";
    let verdict = |text: &str| judge(&number(text), "isr", &reports).verdict;
    assert_eq!(verdict(&format!("paper = 3.0\n{ours}")), Verdict::Met);
    assert_eq!(verdict(&format!("paper = 4.0\n{ours}")), Verdict::Open);
    assert_eq!(verdict(&format!("paper = 4.0\nreason = 'noise'\n{ours}")), Verdict::Open);
    assert_eq!(verdict(&format!("paper = 4.0\nshown = [{{ plot = 'p' }}]\n{ours}")), Verdict::Open);
    assert_eq!(
        verdict(&format!("paper = 4.0\nreason = 'noise'\nshown = [{{ plot = 'p' }}]\n{ours}")),
        Verdict::Explained
    );
    let broken =
        judge(&number(&format!("paper = 4.0\nreason = 'noise'\nshown = [{{ plot = 'q' }}]\n{ours}")), "isr", &reports);
    assert_eq!((broken.verdict, broken.broken.len()), (Verdict::Open, 1));
    assert_eq!(verdict("paper = 4.0\nmissing = 'no such scene'"), Verdict::NoCounterpart);
    assert_eq!(verdict("paper = 4.0\nkind = 'hardware'"), Verdict::Hardware);
    // A cell of the full mode is not missed in the quick mode.
    let full = "paper = 4.0\nours = { table = 'none', column = 'x', full = true }";
    assert_eq!(judge(&number(full), "isr", &reports).broken.len(), 0);
    assert_eq!(verdict(full), Verdict::FullModeOnly);
}

#[test]
fn a_part_of_an_experiment_may_lack_any_cell() {
    let whole = json!({ "facts": { "Mode": "full" }, "tables": {} });
    let part = json!({ "facts": { "Mode": "full", "Part": "--scene hall" }, "tables": {} });
    let lost = "paper = 4.0\nreason = 'noise'\nshown = [{ plot = 'p' }]\nours = { table = 'none', column = 'x' }";
    let [of_whole, of_part] = [whole, part].map(|data| judge(&number(lost), "isr", &Reports::of("isr", data)));
    assert_eq!((of_whole.verdict, of_whole.broken.len()), (Verdict::Open, 2));
    assert_eq!((of_part.verdict, of_part.broken.len()), (Verdict::NoReport, 0));
}

#[test]
fn mistakes_in_a_ledger_name_the_entry() {
    let head = "document = 'd'\nshort = 'D'\nexperiment = 'isr'\n[[number]]\npaper = 1.0\n";
    for (entry, says) in [
        ("place = '1'\nwhat = 'w'\nunit = ''", "'w' of 1: needs `ours` or `missing`"),
        ("place = '1'\nwhat = 'w'\nunit = ''\nours = { table = 't' }", "must name a table and a column"),
        ("place = '1'\nwhat = 'w'\nunit = ''\nours = { table = 't', column = 'c' }", "needs `met`"),
        ("place = '1'\nwhat = 'w'\nunit = ''\nmet = 'more'\nours = { table = 't', column = 'c' }", "`met` is 'more'"),
        ("place = '1'\nwhat = 'w'\nunit = ''\nmissing = ''\nshown = [{}]", "exactly one of table"),
        ("place = '1'\nwhat = 'w'\nunit = ''\nmissing = ''\nshown = [{ in = 'x', table = 't' }]", "no experiment"),
        ("place = '1'\nwhat = 'w'\nunit = ''\ncolour = 1", "colour"),
    ] {
        let error = Ledger::parse("isr", &format!("{head}{entry}")).unwrap_err().to_string();
        assert!(error.contains(says) && error.contains("papers/isr.toml"), "{entry}: {error}");
    }
}

#[test]
fn shares_count_results_alone() {
    let text = format!(
        "document = 'd'\nshort = 'D'\nexperiment = 'isr'\n\
         [[number]]\n{ENTRY}paper = 3.0\nours = {{ table = 'gains', row = {{ scene = 'a', samples = '48' }}, column = 'gain' }}\n\
         [[number]]\n{ENTRY}paper = 9.0\nours = {{ table = 'gains', row = {{ scene = 'a', samples = '48' }}, column = 'gain' }}\n\
         [[number]]\n{ENTRY}paper = 9.0\nmissing = 'none'\n\
         [[number]]\n{ENTRY}paper = 9.0\nkind = 'setting'\nmissing = 'none'\n\
         [[figure]]\nplace = '2'\nwhat = 'gains'\nours = {{ plot = 'q' }}\n"
    );
    let page = page(&[Ledger::parse("isr", &text).unwrap()], &reports());
    let markdown = page.markdown();
    let blocks = page.sections.iter().flat_map(|section| &section.blocks);
    let table = |id: &str| {
        blocks.clone().find_map(|block| match block {
            crate::report::Block::Table(table) if table.id == id => Some(table.clone()),
            _ => None,
        })
    };
    let shares = table("shares").unwrap();
    let cells: Vec<Cell> = [3usize, 2, 1, 0, 1, 1, 0, 0].into_iter().map(Cell::from).chain([50.0.into()]).collect();
    assert_eq!(shares.rows[0][1..], cells[..]);
    assert_eq!(shares.rows[1][1..], cells[..]);
    assert_eq!(table("shares-times").unwrap().rows[1][1], 0usize.into());
    assert_eq!(table("broken").unwrap().rows.len(), 1);
    assert!(
        markdown.contains("> Quick mode of isr") && markdown.contains("| gain | % | 3 | 3 | 1 | at least | met |"),
        "{markdown}"
    );
}
