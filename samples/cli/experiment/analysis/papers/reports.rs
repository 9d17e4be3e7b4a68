//! The reports of the experiments as data.

use std::{collections::BTreeMap, path::Path};

use lucerna::{Error, Result, image};
use serde_json::Value;

use super::{EXPERIMENTS, ledger::Reference};

/// Maximum of bytes of a file of a report.
const MOST: u64 = 1 << 30;

/// `report.json` and `times.json` of each experiment.
#[derive(Debug, Default)]
pub struct Reports(BTreeMap<&'static str, Report>);

/// A report.
#[derive(Debug, Default)]
pub struct Report {
    data: Vec<Value>,
    pub quick: bool,
    /// A part of the experiment alone, which may lack any cell.
    pub part: bool,
    /// Reasons why the report is not complete.
    pub warnings: Vec<String>,
    /// Name and value: device, driver, revision, command line.
    pub facts: Vec<(String, String)>,
}

/// A cell that a reference finds.
#[derive(Clone, Debug, PartialEq)]
pub enum Found {
    Number(f64),
    Text(String),
}

impl Found {
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(value) => Some(*value),
            Self::Text(text) => text.trim().replace(',', "").parse().ok(),
        }
    }
}

impl Reports {
    /// Reads the folders of the experiments that exist in `folder`.
    ///
    /// # Errors
    /// `Input` if a report cannot be read.
    pub fn read(folder: &Path) -> Result<Self> {
        let mut reports = BTreeMap::new();
        for name in EXPERIMENTS {
            let folder = folder.join(name);
            if !folder.join("report.json").is_file() {
                continue;
            }
            let mut report = Report::default();
            for file in ["report.json", "times.json"] {
                let path = folder.join(file);
                if path.is_file() {
                    let bytes = image::read_file_checked(&path, MOST)?;
                    let value = serde_json::from_slice(&bytes).map_err(|error| {
                        Error::input(error.to_string()).in_file(&path).help("Write the report again")
                    })?;
                    report.data.push(value);
                }
            }
            report.read_facts();
            reports.insert(*name, report);
        }
        Ok(Self(reports))
    }

    #[cfg(test)]
    pub fn of(name: &'static str, data: Value) -> Self {
        let mut report = Report { data: vec![data], ..Report::default() };
        report.read_facts();
        Self(BTreeMap::from([(name, report)]))
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn get(&self, name: &str) -> Option<&Report> {
        self.0.get(name)
    }

    pub fn all(&self) -> impl Iterator<Item = (&'static str, &Report)> {
        self.0.iter().map(|(name, report)| (*name, report))
    }

    /// The value of a reference to a cell, times its scale.
    ///
    /// # Errors
    /// The part of the reference that does not exist.
    pub fn cell(&self, reference: &Reference, experiment: &str) -> Result<Found, String> {
        let name = reference.experiment.as_deref().unwrap_or(experiment);
        let report = self.get(name).ok_or_else(|| format!("no report of {name}"))?;
        let found = report.cell(reference).map_err(|what| format!("{name}: {what}"))?;
        Ok(match (found.number(), reference.scale) {
            (Some(value), Some(scale)) => Found::Number(value * scale),
            _ => found,
        })
    }

    /// Whether a report has the table, plot or pictures of a reference.
    ///
    /// # Errors
    /// What does not exist.
    pub fn has(&self, reference: &Reference, experiment: &str) -> Result<(), String> {
        let name = reference.experiment.as_deref().unwrap_or(experiment);
        if reference.file.is_some() || reference.test.is_some() {
            return Ok(());
        }
        let report = self.get(name).ok_or_else(|| format!("no report of {name}"))?;
        if reference.column.is_some() {
            return report.cell(reference).map(|_| ()).map_err(|what| format!("{name}: {what}"));
        }
        // A table without rows and a plot without points show nothing.
        let has = |part: &str, id: &str| {
            let full = |found: &Value| match part {
                "tables" => found["rows"].as_array().is_some_and(|rows| !rows.is_empty()),
                _ => found["series"].as_array().into_iter().flatten().any(|series| series["points"][0].is_array()),
            };
            report.data.iter().filter_map(|data| data[part].get(id)).any(full)
        };
        for (part, id) in [("tables", &reference.table), ("plots", &reference.plot)] {
            if let Some(id) = id {
                return if has(part, id) { Ok(()) } else { Err(format!("{name}: no {part} '{id}', or nothing in it")) };
            }
        }
        let Some(id) = &reference.images else { return Ok(()) };
        let names = |data: &Value| data["images"].as_array().is_some_and(|ids| ids.iter().any(|known| known == id));
        let there = report.data.iter().any(names);
        if there { Ok(()) } else { Err(format!("{name}: no pictures '{id}'")) }
    }
}

impl Report {
    fn read_facts(&mut self) {
        let warnings = self.data.first().and_then(|data| data["warnings"].as_array());
        self.warnings = warnings.into_iter().flatten().filter_map(Value::as_str).map(str::to_owned).collect();
        let Some(facts) = self.data.first().and_then(|data| data["facts"].as_object()) else { return };
        self.facts =
            facts.iter().filter_map(|(name, value)| Some((name.clone(), value.as_str()?.to_owned()))).collect();
        self.quick = self.fact("Mode") == "quick";
        self.part = !self.fact("Part").is_empty();
    }

    /// Whether the report may lack what a reference names. `full`: only the full mode has it.
    pub fn may_lack(&self, full: bool) -> bool {
        self.part || full && self.quick
    }

    /// A fact by its name.
    pub fn fact(&self, name: &str) -> &str {
        self.facts.iter().find(|(known, _)| known == name).map_or("", |(_, value)| value.as_str())
    }

    fn cell(&self, reference: &Reference) -> Result<Found, String> {
        let (id, column) = (reference.table.as_deref().unwrap_or(""), reference.column.as_deref().unwrap_or(""));
        let table = self.data.iter().find_map(|data| data["tables"].get(id)).ok_or(format!("no table '{id}'"))?;
        let names: Vec<&str> = table["columns"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        let place = |name: &str| {
            names.iter().position(|known| *known == name).ok_or(format!("table '{id}' has no column '{name}'"))
        };
        let mut wanted = Vec::new();
        for (name, value) in &reference.row {
            wanted.push((place(name)?, value));
        }
        let rows: Vec<&Value> = table["rows"].as_array().into_iter().flatten().collect();
        let fits = |row: &&&Value| wanted.iter().all(|(at, value)| is(&row[*at], value));
        let fitting: Vec<&&Value> = rows.iter().filter(fits).collect();
        let [row] = fitting[..] else {
            return Err(format!("table '{id}' has {} rows with {:?}", fitting.len(), reference.row));
        };
        match &row[place(column)?] {
            Value::Number(value) => Ok(Found::Number(value.as_f64().unwrap_or(f64::NAN))),
            Value::String(text) => Ok(Found::Text(text.clone())),
            _ => Err(format!("table '{id}': the cell '{column}' of {:?} is empty", reference.row)),
        }
    }
}

/// Whether a cell has a value, written as text.
fn is(cell: &Value, text: &str) -> bool {
    match cell {
        Value::String(found) => found == text,
        Value::Number(found) => text.parse::<f64>().is_ok_and(|value| found.as_f64() == Some(value)),
        _ => false,
    }
}
