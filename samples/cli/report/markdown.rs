//! A page as Markdown: texts and tables, without plots and pictures.

use std::fmt::Write;

use super::{Block, Cell, Page, Table, number};

pub(super) fn page(page: &Page) -> String {
    let mut out = format!("# {}\n", page.title);
    // Writing into a String cannot fail.
    let mut text = |text: &str| {
        let _ = write!(out, "\n{text}\n");
    };
    if !page.summary.is_empty() {
        text(&page.summary);
    }
    for warning in &page.warnings {
        text(&format!("> {warning}"));
    }
    for section in &page.sections {
        text(&format!("## {}", section.title));
        for block in &section.blocks {
            match block {
                Block::Text(paragraph) => text(paragraph),
                Block::Table(table) => text(self::table(table).trim_end()),
                Block::Plot(_) | Block::Images(_) => {}
            }
        }
    }
    if !page.facts.is_empty() {
        text("## Measured by");
        let mut facts = Table::new("facts", "", ["", ""]);
        page.facts.iter().for_each(|(name, value)| facts.push([name.as_str().into(), value.as_str().into()]));
        text(self::table(&facts).trim_end());
    }
    out
}

fn table(table: &Table) -> String {
    let mut out = if table.caption.is_empty() { String::new() } else { format!("**{}**\n\n", table.caption) };
    let numeric: Vec<bool> = (0..table.columns.len()).map(|column| table.is_numeric(column)).collect();
    let mut line = |cells: Vec<String>| {
        let _ = writeln!(out, "| {} |", cells.join(" | "));
    };
    line(table.columns.iter().map(|name| cell(name)).collect());
    line(numeric.iter().map(|numeric| if *numeric { "---:".to_owned() } else { "---".into() }).collect());
    for row in &table.rows {
        line(
            row.iter()
                .map(|content| match content {
                    Cell::Empty => String::new(),
                    Cell::Text(text) => cell(text),
                    Cell::Number(value) => number(*value, table.digits),
                })
                .collect(),
        );
    }
    out
}

/// A text that stays within its cell.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::super::Section;
    use super::*;

    #[test]
    fn texts_and_tables_are_written_and_cells_stay_cells() {
        let mut section = Section::new("Roots");
        section.text("By *hand*.");
        let table =
            Table::new("roots", "All", ["x", "√x"]).row(["a|b\nc".into(), 2.0.into()]).row([Cell::Empty, 0.125.into()]);
        section.add(table);
        let mut page = Page::new("Title");
        page.warnings.push("Quick.".into());
        page.facts.push(("Device".into(), "one".into()));
        page.add(section);
        let expected = "# Title\n\n> Quick.\n\n## Roots\n\nBy *hand*.\n\n**All**\n\n| x | √x |\n| --- | ---: |\n| a\\|b c | 2 |\n|  | 0.1250 |\n\n\
                        ## Measured by\n\n|  |  |\n| --- | --- |\n| Device | one |\n";
        assert_eq!(page.markdown(), expected);
    }
}
