//! The table, and the JSON document.

use lucerna::measure::Measured;
use serde_json::{Value, json};

use super::{CompareArgs, Comparison};

/// Six significant digits.
pub(super) fn number(value: f64) -> String {
    if value.is_nan() {
        return "undefined".into();
    }
    if value.is_infinite() {
        return if value > 0.0 { "inf".into() } else { "-inf".into() };
    }
    let magnitude = value.abs();
    if value == 0.0 {
        return "0".into();
    }
    if !(1e-4..1e7).contains(&magnitude) {
        return format!("{value:.5e}");
    }
    let decimals = (5 - magnitude.log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Text for terminals: a list for one image, a table for several images.
pub(super) fn text(comparison: &Comparison) -> String {
    let [w, h] = comparison.size;
    let mut lines = vec![format!("{w}×{h}, reference {}", comparison.reference)];
    if let Some(baseline) = &comparison.baseline {
        lines.push(format!("baseline {baseline}"));
    }
    lines.push(String::new());
    let header = |measure: &lucerna::measure::Measure| {
        let info = measure.info();
        let unit = if info.unit.is_empty() { String::new() } else { format!(" {}", info.unit) };
        format!("{}{unit} {}", info.name, if info.higher_is_better { "↑" } else { "↓" })
    };
    let mut rows: Vec<Vec<String>> = Vec::new();
    if let [test] = comparison.tests.as_slice() {
        lines.push(test.name.clone());
        rows.extend(
            test.values
                .iter()
                .map(|v| vec![format!("  {}", header(&v.measure)), number(v.value), v.measure.info().what.to_owned()]),
        );
    } else {
        rows.push(std::iter::once(String::new()).chain(comparison.measures.iter().map(header)).collect());
        let each = comparison.tests.iter();
        rows.extend(each.map(|test| {
            std::iter::once(test.name.clone()).chain(test.values.iter().map(|v| number(v.value))).collect()
        }));
    }
    lines.extend(align(&rows));
    lines.push("↑ more is better, ↓ less is better".into());
    lines.extend(remarks(comparison));
    lines.join("\n")
}

/// Aligns columns: the first to the left, numbers to the right, and the third column of a list to the left.
fn align(rows: &[Vec<String>]) -> Vec<String> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| rows.iter().filter_map(|row| row.get(c)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let words = |cell: &str| cell.contains(' ') && cell.chars().count() > 24;
    let cell = |(c, text): (usize, &String)| match c {
        0 => format!("{text:<width$}", width = widths[c]),
        _ if words(text) => text.clone(),
        _ => format!("{text:>width$}", width = widths[c]),
    };
    rows.iter()
        .map(|row| row.iter().enumerate().map(cell).collect::<Vec<_>>().join("  ").trim_end().to_owned())
        .collect()
}

/// Exposures, pixels left out, files written.
fn remarks(comparison: &Comparison) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for test in &comparison.tests {
        for v in &test.values {
            let shown = |name: &str| v.detail(name).map(number);
            let name = v.measure.name();
            let mut parts = Vec::new();
            if let (Some(start), Some(stop), Some(count)) =
                (shown("start_exposure"), shown("stop_exposure"), shown("exposures"))
            {
                parts.push(format!("{count} exposures from {start} to {stop} stops"));
            } else if let Some(stops) = v.detail("exposure").filter(|stops| *stops != 0.0) {
                parts.push(format!("shown with {} stops", number(stops)));
            }
            if let Some(pixels) = shown("pixels") {
                parts.push(format!("{pixels} pixels"));
            }
            if let (Some(equal), Some(worse)) = (shown("equal"), shown("worse")) {
                parts.push(format!("{equal} % equal, {worse} % worse"));
            }
            parts.extend(v.note.clone());
            if !parts.is_empty() {
                lines.push(format!("{}: {name}: {}", test.name, parts.join(", ")));
            }
        }
        if let [first, rest @ ..] = test.maps.as_slice() {
            let more = if rest.is_empty() { String::new() } else { format!(" and {} more", rest.len()) };
            lines.push(format!("{}: maps: {first}{more}", test.name));
        }
    }
    lines
}

/// The JSON document: the images, the options and the results. A value that JSON cannot hold is null, and `note` gives the reason.
pub(super) fn json(comparison: &Comparison, args: &CompareArgs) -> Value {
    let measures: Vec<Value> = comparison
        .measures
        .iter()
        .map(|measure| {
            let info = measure.info();
            json!({ "name": info.name, "what": info.what, "unit": info.unit, "higher_is_better": info.higher_is_better })
        })
        .collect();
    let values = |list: &[Measured]| -> serde_json::Map<String, Value> {
        list.iter()
            .map(|v| {
                let details: serde_json::Map<String, Value> =
                    v.details.iter().map(|(name, value)| ((*name).to_owned(), json!(value))).collect();
                let [low, high] = v.map.range;
                let value = json!({
                    "value": v.value.is_finite().then_some(v.value),
                    "infinite": v.value.is_infinite(),
                    "details": details,
                    "note": v.note,
                    "map": {
                        "meaning": v.map.meaning, "scale": [low, high], "median": v.map.quantile(0.5),
                        "p95": v.map.quantile(0.95), "max": v.map.quantile(1.0),
                    },
                });
                (v.measure.name().to_owned(), value)
            })
            .collect()
    };
    let tests: Vec<Value> = comparison
        .tests
        .iter()
        .map(|test| json!({ "file": test.name, "measures": values(&test.values), "maps": test.maps }))
        .collect();
    json!({
        "reference": comparison.reference,
        "baseline": comparison.baseline,
        "width": comparison.size[0],
        "height": comparison.size[1],
        "crop": args.crop.map(|(size, origin)| json!({ "size": size, "origin": origin })),
        "measures": measures,
        "tests": tests,
        "notes": comparison.notes,
        "over": comparison.over,
        "warnings": comparison.warnings,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_six_digits() {
        let pairs = [
            (0.0, "0"),
            (1.0 / 3.0, "0.333333"),
            (123_456.78, "123457"),
            (1.5, "1.5"),
            (-20.25, "-20.25"),
            (1e-9, "1.00000e-9"),
            (f64::NAN, "undefined"),
            (f64::INFINITY, "inf"),
            (100.0, "100"),
        ];
        for (value, text) in pairs {
            assert_eq!(number(value), text);
        }
    }
}
