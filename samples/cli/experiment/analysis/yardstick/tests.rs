use super::{Errors, Row, equal_time, plots, tables};
use crate::{
    experiment::{file, file::Role},
    report::{Block, Cell, Kind},
};

fn row(method: &str, rms: f64, frame: f64) -> Row {
    let error = Some(Errors { rms, blocks: rms, energy: [1.0, 0.9, 0.8] });
    Row {
        view: "room, camera".into(),
        method: method.into(),
        label: format!("{method}, {frame}"),
        errors: [error, error],
        frame: Some(frame),
        before: None,
    }
}

#[test]
fn the_path_tracer_needs_four_times_the_time_for_half_the_error() {
    let rows = [row("path tracer", 20.0, 10.0), row("path tracer", 10.0, 40.0), row("prt", 5.0, 3.0)];
    let equal = equal_time(&rows, "room, camera", 5.0).unwrap();
    assert!((equal - 160.0).abs() < 1e-9, "{equal}");
    assert_eq!(equal_time(&rows, "elsewhere", 5.0), None);
    let section = tables(&rows);
    let times = section.blocks.iter().find_map(|block| match block {
        Block::Table(table) if table.id == "times" => Some(table),
        _ => None,
    });
    assert_eq!(times.unwrap().rows[2][4], Cell::Number(equal));
}

#[test]
fn every_method_is_in_the_plot() {
    let rows = [row("path tracer", 20.0, 10.0), row("path tracer", 10.0, 40.0), row("prt", 5.0, 3.0)];
    let section = plots(&rows);
    let plots: Vec<_> = section
        .blocks
        .iter()
        .filter_map(|block| match block {
            Block::Plot(plot) => Some(plot),
            _ => None,
        })
        .collect();
    assert_eq!(plots.len(), 2);
    for plot in plots {
        let of: Vec<_> = plot.series.iter().map(|s| (s.name.as_str(), s.kind, s.points.len())).collect();
        assert_eq!(of, [("path tracer", Kind::Line, 2), ("prt", Kind::Points, 1)]);
    }
}

#[test]
fn the_experiment_has_every_method() {
    for quick in [false, true] {
        let experiment = file::open("yardstick", quick).unwrap();
        let kinds: Vec<&str> =
            experiment.methods.iter().filter(|m| m.role == Role::Technique).map(|m| m.kind.as_str()).collect();
        for (kind, count) in [("isr", 1), ("igi", 3), ("prt", 1), ("daylight", 1), ("tracer", 1)] {
            assert!(kinds.iter().filter(|known| **known == kind).count() >= count, "{kind}: {kinds:?}");
        }
    }
}
