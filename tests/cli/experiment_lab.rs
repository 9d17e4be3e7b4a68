//! Runs of experiments from changed copies of their files, and the tables of their reports.

use crate::support::{Ran, lucerna};
use std::{collections::BTreeMap, fs, path::Path};

use serde_json::Value;
use toml::Table;

/// Runs `lucerna reproduce` with a file; the report is in `out`.
pub fn run(folder: &Path, file: &Table, more: &[&str]) -> Ran {
    let path = folder.join("e.toml");
    fs::write(&path, toml::to_string(file).unwrap()).unwrap();
    let output = folder.join("out");
    let first = ["reproduce", path.to_str().unwrap(), "-o", output.to_str().unwrap()];
    lucerna(first.iter().chain(more))
}

/// A table of a report: rows by column.
pub fn rows(document: &Value, table: &str) -> Vec<BTreeMap<String, Value>> {
    let table = &document["tables"][table];
    let columns = table["columns"].as_array().unwrap_or_else(|| panic!("no such table in {document}"));
    let named = |row: &Value| -> BTreeMap<String, Value> {
        columns.iter().map(|name| name.as_str().unwrap().to_owned()).zip(row.as_array().unwrap().clone()).collect()
    };
    table["rows"].as_array().unwrap().iter().map(named).collect()
}

pub fn number(row: &BTreeMap<String, Value>, column: &str) -> f64 {
    row[column].as_f64().unwrap_or_else(|| panic!("no number {column} in {row:?}"))
}
