//! `lucerna reproduce all` and `lucerna report` on its folder: every number of the papers beside ours.

use std::fs;

use crate::support::lucerna;
use serde_json::json;

#[test]
fn a_folder_of_reports_becomes_one_page() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    // A folder without reports is none.
    lucerna(["report", out]).expect(3, &["manifest.json"]);
    fs::create_dir(folder.path().join("isr-pair")).unwrap();
    let table = json!({
        "caption": "", "columns": ["quantity", "unit", "paper", "ours", "ours / paper"],
        "rows": [
            ["views with a positive gain", "%", 100.0, 100.0, 1.0],
            ["gain, mean", "%", 5.88, 1.0, 0.17],
            ["correlation of direct light, mean", "", 0.8867, 0.1, 0.11],
        ],
    });
    let report = json!({ "title": "t", "facts": { "Mode": "quick", "Device": "a device" }, "warnings": [], "tables": { "pair": table }, "plots": {} });
    fs::write(folder.path().join("isr-pair/report.json"), report.to_string()).unwrap();
    lucerna(["report", out]).expect(0, &["reproduction.md", "report.html"]);
    let text = fs::read_to_string(folder.path().join("reproduction.md")).unwrap();
    let line =
        |quantity: &str| text.lines().find(|line| line.contains(quantity)).unwrap_or_else(|| panic!("no {quantity}"));
    assert!(line("| views with a positive gain |").contains("| 100 | 100 | 1 | at least | met |"), "{text}");
    // The cells that show the reason are not there, so the difference is open.
    assert!(line("| gain, mean |").contains("| 5.880 | 1 | 0.1701 | at least | open |"), "{}", line("| gain, mean |"));
    assert!(line("correlation of direct light").contains("| open |"), "{}", line("correlation of direct light"));
    assert!(
        text.contains("> Quick mode of isr-pair")
            && text.contains("a device")
            && text.contains("## References without a cell")
    );
    for file in ["report.html", "report.json", "report.csv"] {
        assert!(folder.path().join(file).is_file(), "{file}");
    }
    // The same reports, the same bytes.
    let said = lucerna(["report", out, "--json"]).expect(0, &[]).json();
    assert!(said["files"].as_array().unwrap().iter().any(|file| file.as_str().unwrap().ends_with("reproduction.md")));
    assert_eq!(fs::read_to_string(folder.path().join("reproduction.md")).unwrap(), text);
    fs::write(folder.path().join("isr-pair/report.json"), "{").unwrap();
    lucerna(["report", out]).expect(3, &["isr-pair", "report.json", "Write the report again"]);
}

#[test]
fn all_papers_are_planned_and_have_no_single_document() {
    lucerna(["reproduce", "all", "--json"]).expect(2, &["prints no JSON document", "--json"]);
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("o");
    let planned =
        lucerna(["reproduce", "all", "--quick", "--dry-run", "-o", out.to_str().unwrap()]).expect(0, &[]).stdout;
    let runs: Vec<&str> = planned.lines().filter(|line| line.ends_with("of them exist")).collect();
    assert_eq!(runs.len(), 7, "{runs:?}");
    assert!(!out.exists(), "a plan writes no file");
}
