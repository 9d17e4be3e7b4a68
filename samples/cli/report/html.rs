//! The page itself.

use std::fmt::Write;

use lucerna::Result;

use super::{Block, Cell, Comparison, Page, Table, images, svg, table::number};
use crate::program;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Text as HTML, also within quotes.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

/// Text with `*emphasis*` and `` `code` ``.
fn prose(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(at) = rest.find(['*', '`']) {
        let sign = &rest[at..at + 1];
        let after = &rest[at + 1..];
        let end = after.find(sign).filter(|end| *end > 0 && !after.starts_with(' '));
        out.push_str(&escape(&rest[..at]));
        rest = match end {
            Some(end) => {
                let tag = if sign == "*" { "em" } else { "code" };
                let _ = write!(out, "<{tag}>{}</{tag}>", escape(&after[..end]));
                &after[end + 1..]
            }
            None => {
                out.push_str(sign);
                after
            }
        };
    }
    out + &escape(rest)
}

/// An identifier for links: letters, digits and hyphens.
fn anchor(text: &str) -> String {
    let plain = text.to_lowercase().chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect::<String>();
    plain.split('-').filter(|part| !part.is_empty()).collect::<Vec<_>>().join("-")
}

pub(super) fn page(page: &Page) -> Result<String> {
    let title = escape(&page.title);
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\">\n\
         <link rel=\"icon\" href=\"data:,\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<header>\n<h1>{title}</h1>\n"
    );
    if !page.summary.is_empty() {
        let _ = writeln!(out, "<p class=\"summary\">{}</p>", prose(&page.summary));
    }
    for warning in &page.warnings {
        let _ = writeln!(out, "<p class=\"warning\" role=\"note\">{}</p>", prose(warning));
    }
    out.push_str("</header>\n");
    let about = page.facts.first().map(|_| "How this was made");
    let titles: Vec<&str> = page.sections.iter().map(|s| s.title.as_str()).chain(about).collect();
    if titles.len() > 2 {
        out.push_str("<nav aria-label=\"Contents\"><ol>");
        for title in &titles {
            let _ = write!(out, "<li><a href=\"#{}\">{}</a></li>", anchor(title), escape(title));
        }
        out.push_str("</ol></nav>\n");
    }
    out.push_str("<main>\n");
    for section in &page.sections {
        let (id, title) = (anchor(&section.title), escape(&section.title));
        let _ = writeln!(out, "<section aria-labelledby=\"{id}\">\n<h2 id=\"{id}\">{title}</h2>");
        for block in &section.blocks {
            match block {
                Block::Text(text) => {
                    let _ = writeln!(out, "<p>{}</p>", prose(text));
                }
                Block::Table(table) => self::table(&mut out, table),
                Block::Plot(plot) => {
                    let (id, caption) = (escape(&plot.id), prose(&plot.caption));
                    let drawn = svg::plot(plot);
                    let _ =
                        writeln!(out, "<figure id=\"plot-{id}\"><figcaption>{caption}</figcaption>{drawn}</figure>");
                }
                Block::Images(images) => comparison(&mut out, images)?,
            }
        }
        out.push_str("</section>\n");
    }
    facts(&mut out, page);
    let has_images = page.blocks().any(|block| matches!(block, Block::Images(_)));
    out.push_str("</main>\n");
    let version = program::VERSION;
    let _ = writeln!(out, "<footer>Written by lucerna {version}. This file loads nothing from elsewhere.</footer>");
    if has_images {
        let _ = write!(out, "<script>\n{SCRIPT}</script>\n");
    }
    out.push_str("</body>\n</html>\n");
    Ok(out)
}

fn table(out: &mut String, table: &Table) {
    let (id, caption) = (escape(&table.id), prose(&table.caption));
    let long = if table.long { " long" } else { "" };
    let _ = write!(
        out,
        "<figure class=\"table{long}\" id=\"table-{id}\"><figcaption id=\"caption-{id}\">{caption}</figcaption>\
         <div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-labelledby=\"caption-{id}\"><table aria-labelledby=\"caption-{id}\"><thead><tr>"
    );
    let numeric: Vec<bool> = (0..table.columns.len()).map(|column| table.is_numeric(column)).collect();
    let class = |column: usize| if numeric[column] { " class=\"number\"" } else { "" };
    for (column, name) in table.columns.iter().enumerate() {
        let _ = write!(out, "<th scope=\"col\"{}>{}</th>", class(column), escape(name));
    }
    out.push_str("</tr></thead><tbody>\n");
    for row in &table.rows {
        out.push_str("<tr>");
        for (column, cell) in row.iter().enumerate() {
            let (open, close) = match column {
                0 => (format!("th scope=\"row\"{}", class(column)), "th"),
                _ => (format!("td{}", class(column)), "td"),
            };
            let (data, text) = match cell {
                Cell::Empty => (String::new(), String::new()),
                Cell::Text(text) if table.long => (String::new(), prose(text)),
                Cell::Text(text) => (String::new(), escape(text)),
                Cell::Number(value) => (format!(" data-value=\"{value}\""), number(*value, table.digits)),
            };
            let _ = write!(out, "<{open}{data}>{text}</{close}>");
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody></table></div></figure>\n");
}

fn comparison(out: &mut String, set: &Comparison) -> Result<()> {
    let (id, caption, (w, h)) = (escape(&set.id), prose(&set.caption), (set.width, set.height));
    let (exposure, factor) = (set.exposure, 1u32 << set.halved().min(31));
    let _ = write!(
        out,
        "<figure class=\"images\" id=\"images-{id}\"><figcaption>{caption}</figcaption>\
         <div class=\"viewer\" data-width=\"{w}\" data-height=\"{h}\" data-exposure=\"{exposure}\">"
    );
    for image in &set.images {
        let (name, data) = (escape(&image.name), images::packed(image, set.width)?);
        let _ = write!(out, "<script type=\"application/octet-stream\" data-name=\"{name}\">{data}</script>");
    }
    let _ = write!(
        out,
        "<noscript><p class=\"warning\">Images need JavaScript here; tables and plots do not.</p></noscript></div><p class=\"fine\">{w}×{h} pixels"
    );
    if factor > 1 {
        let _ = write!(out, ", each the average of {factor}×{factor}");
    }
    let _ = writeln!(out, ". Values are {}, kept to 0.4 %.</p></figure>", escape(set.values));
    Ok(())
}

fn facts(out: &mut String, page: &Page) {
    if page.facts.is_empty() {
        return;
    }
    let title = "How this was made";
    let id = anchor(title);
    let _ = write!(out, "<section aria-labelledby=\"{id}\"><h2 id=\"{id}\">{title}</h2>\n<dl class=\"facts\">");
    for (name, value) in &page.facts {
        let _ = write!(out, "<div><dt>{}</dt><dd>{}</dd></div>", escape(name), escape(value));
    }
    out.push_str("</dl></section>\n");
}
