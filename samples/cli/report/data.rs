//! The numbers of a page as JSON and CSV.

use std::fmt::Write;

use lucerna::{Error, ErrorKind, Result};
use serde_json::{Map, Value, json};

use super::{Block, Cell, Page, Plot, Table};

/// Whether the page has measured times.
pub(super) fn has_times(page: &Page) -> bool {
    page.blocks()
        .any(|block| matches!(block, Block::Table(Table { timed: true, .. }) | Block::Plot(Plot { timed: true, .. })))
}

fn tables(page: &Page, timed: bool) -> impl Iterator<Item = &Table> {
    page.blocks().filter_map(move |block| match block {
        Block::Table(table) if table.timed == timed => Some(table),
        _ => None,
    })
}

fn plots(page: &Page, timed: bool) -> impl Iterator<Item = &Plot> {
    page.blocks().filter_map(move |block| match block {
        Block::Plot(plot) if plot.timed == timed => Some(plot),
        _ => None,
    })
}

/// Identifiers of the comparisons of images.
fn images(page: &Page) -> impl Iterator<Item = &str> {
    page.blocks().filter_map(|block| match block {
        Block::Images(set) => Some(set.id.as_str()),
        _ => None,
    })
}

/// `{ title, facts, warnings, tables: { id: { caption, columns, rows } }, plots: { id: { caption, x, y, series } }, images: [id] }`.
pub(super) fn json(page: &Page, timed: bool) -> Result<String> {
    let cell = |cell: &Cell| match cell {
        Cell::Empty => Value::Null,
        Cell::Text(text) => json!(text),
        Cell::Number(value) => json!(value),
    };
    let table = |table: &Table| {
        let rows: Vec<Value> = table.rows.iter().map(|row| row.iter().map(cell).collect()).collect();
        (table.id.clone(), json!({ "caption": table.caption, "columns": table.columns, "rows": rows }))
    };
    let plot = |plot: &Plot| {
        let series = plot.series.iter().map(|series| {
            let points = series.points.iter().map(|(x, y, name)| match name.is_empty() {
                true => json!([x, y]),
                false => json!([x, y, name]),
            });
            json!({ "name": series.name, "points": points.collect::<Vec<_>>() })
        });
        let series: Vec<Value> = series.collect();
        let mut value = json!({ "caption": plot.caption, "x": plot.x.label, "y": plot.y.label, "series": series });
        for (axis, key) in [(&plot.x, "x_names"), (&plot.y, "y_names")] {
            if !axis.names.is_empty() {
                value[key] = json!(axis.names);
            }
        }
        (plot.id.clone(), value)
    };
    let facts: Map<String, Value> = page.facts.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
    let document = json!({
        "title": page.title,
        "facts": facts,
        "warnings": page.warnings,
        "tables": tables(page, timed).map(table).collect::<Map<_, _>>(),
        "plots": plots(page, timed).map(plot).collect::<Map<_, _>>(),
        "images": if timed { Vec::new() } else { images(page).collect() },
    });
    serde_json::to_string_pretty(&document)
        .map(|text| text + "\n")
        .map_err(|error| Error::new(ErrorKind::Runtime, "a report cannot be JSON").caused_by(error))
}

/// All tables one after the other: a line `# id: caption`, a line of column names, the rows, an empty line.
pub(super) fn csv(page: &Page, timed: bool) -> String {
    let mut text = String::new();
    for table in tables(page, timed) {
        // Writing into a String cannot fail.
        let _ = writeln!(text, "{}", field(&format!("# {}: {}", table.id, table.caption)));
        line(&mut text, table.columns.iter().map(|name| field(name)));
        for row in &table.rows {
            line(
                &mut text,
                row.iter().map(|cell| match cell {
                    Cell::Empty => String::new(),
                    Cell::Text(text) => field(text),
                    Cell::Number(value) => value.to_string(),
                }),
            );
        }
        text.push('\n');
    }
    text
}

fn line(text: &mut String, fields: impl Iterator<Item = String>) {
    text.push_str(&fields.collect::<Vec<_>>().join(","));
    text.push('\n');
}

fn field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}
