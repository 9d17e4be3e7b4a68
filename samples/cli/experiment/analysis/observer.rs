//! The observer of the visible differences predictor in all tables of Michael's thesis: one for sections 5.3 and 5.4.

use lucerna::measure::{Display, Exposure, Options, ToneCurve};

/// VDP options for an inexperienced observer, who does not know the differences to look for (slope of masking 1). Only differences that are
/// detected almost certainly count (p > 0.95). The thesis names neither the program that computed its VDP nor its settings. `stops`: exposure
/// at which both pictures are shown.
pub(super) fn inexperienced(stops: f64) -> Options {
    Options { vdp_masking_slope: 1.0, vdp_threshold: 0.95, ..practised(stops) }
}

/// VDP options for Daly's practised observer, with differences that are detected in three of four cases.
pub(super) fn practised(stops: f64) -> Options {
    let display = Display { exposure: Exposure::Stops(stops), curve: ToneCurve::Clip };
    Options { display, ..Options::default() }
}
