//! Values of the thesis.

use super::{DEFAULT, DENSE};

/// A case of figures 18 to 23.
pub(super) struct Case {
    pub figure: &'static str,
    pub what: &'static str,
    pub scene: &'static str,
    pub technique: &'static str,
    /// NRMSE of the thesis.
    pub nrmse: f64,
}

const fn case(
    figure: &'static str,
    what: &'static str,
    scene: &'static str,
    technique: &'static str,
    nrmse: f64,
) -> Case {
    Case { figure, what, scene, technique, nrmse }
}

/// The densest set of samples.
pub(super) const DENSEST: &str = "256x129x30";

pub(super) const CASES: &[Case] = &[
    case("18", "32×17×15 samples", "bunny, area", "32x17x15", 0.023),
    case("18", "64×33×30 samples", "bunny, area", DEFAULT, 0.008),
    case("18", "256×129×30 samples", "bunny, area", DENSEST, 0.007),
    case("18", "64×33×30 samples, all as in the thesis", "bunny, area", "thesis", 0.008),
    case("19", "one point light", "bunny, point", DEFAULT, 0.1),
    case("19", "two area lights", "bunny, areas", DEFAULT, 0.035),
    case("19", "one point light, its texels separated", "bunny, point", "suns", 0.1),
    case("19", "grove", "bunny", DEFAULT, 0.022),
    case("19", "grove, its sun separated", "bunny", "suns", 0.022),
    case("19", "a photographed forest", "bunny, forest", DEFAULT, 0.022),
    case("19", "Eucalyptus Grove", "bunny, eucalyptus", DEFAULT, 0.022),
    case("19", "a photographed forest, bright texels separated", "bunny, forest", "suns", 0.022),
    case("20", "coloured lights, one occluder", "queen, areas", DEFAULT, 0.019),
    case("20", "coloured lights, the queen of a chess set", "chess queen, areas", DEFAULT, 0.019),
    case("20", "coloured lights, two occluders", "two, areas", DEFAULT, 0.019),
    case("21", "overlap, correction off", "queens, area", "no overlap", 0.027),
    case("21, 22", "overlap, correction on; one area light", "queens, area", DEFAULT, 0.019),
    case("21", "closer together, grove, correction off", "queens, close", "no overlap", 0.027),
    case("21", "queens of a chess set, correction off", "chess queens, area", "no overlap", 0.027),
    case("21, 22", "queens of a chess set, correction on", "chess queens, area", DEFAULT, 0.019),
    case("21, 22", "all as in the thesis", "queens, area", "thesis", 0.019),
    case("22", "three occluders, grove", "queens", DEFAULT, 0.015),
    case("22", "three occluders, grove, its sun separated", "queens", "suns", 0.015),
    case("22", "three occluders closer together, grove", "queens, close", DEFAULT, 0.013),
    case("23", "a fifth below the ground, correction off", "queen, sunk", "no partial", 0.026),
    case("23", "a fifth below the ground, correction on", "queen, sunk", DEFAULT, 0.019),
    case("23", "a chess set's queen, correction off", "chess queen, sunk", "no partial", 0.026),
    case("23", "a chess set's queen, correction on", "chess queen, sunk", DEFAULT, 0.019),
    case("23", "all as in the thesis", "queen, sunk", "thesis", 0.019),
];

/// Table 2: samples, minutes for bunny and tree, megabytes.
pub(super) const TABLE_2: [(&str, f64, Option<f64>, f64); 5] = [
    (DENSEST, 397.0, Some(222.0), 34.0),
    (DENSE, 99.0, None, 8.56),
    (DEFAULT, 24.0, None, 2.17),
    ("64x33x15", 12.0, None, 1.08),
    ("32x17x15", 3.0, None, 0.28),
];

/// Table 3: scene, number of objects, megabytes, frames per second.
pub(super) const TABLE_3: [(&str, usize, f64, f64); 9] = [
    ("1 bunny", 1, 8.56, 112.0),
    ("1 tree", 1, 8.56, 112.0),
    ("10 bunnies", 10, 8.56, 68.0),
    ("10 trees", 10, 8.56, 68.0),
    ("5 bunnies and trees", 10, 17.12, 68.0),
    ("10 bunnies and trees", 20, 17.12, 46.0),
    ("15 bunnies and trees", 30, 17.12, 35.0),
    ("20 bunnies and trees", 40, 17.12, 29.0),
    ("30 bunnies and trees", 60, 17.12, 22.0),
];

/// Table 17: samples, VDP % before and after tone mapping.
pub(super) const TABLE_17: [(&str, f64, f64); 3] =
    [("32x17x15", 5.94, 2.59), (DEFAULT, 0.20, 0.32), (DENSEST, 0.13, 0.20)];

/// Table 18: environment, scene, VDP % before and after tone mapping.
pub(super) const TABLE_18: [(&str, &str, f64, f64); 5] = [
    ("one point light", "bunny, point", 1.70, 1.70),
    ("two area lights", "bunny, areas", 0.0, 0.0),
    ("grove", "bunny", 11.42, 8.31),
    ("a photographed forest", "bunny, forest", 11.42, 8.31),
    ("Eucalyptus Grove", "bunny, eucalyptus", 11.42, 8.31),
];

/// Table 4: method, frequencies of the environment, objects that may move, memory, frames per second.
pub(super) const TABLE_4: [[&str; 5]; 4] = [
    [
        "precomputed radiance transfer (Sloan et al.)",
        "low",
        "rigid bodies",
        "above 1 GB",
        "about 100 for 40,000 vertices",
    ],
    [
        "precomputed shadow fields (Zhou et al.)",
        "low; high if no object moves",
        "rigid bodies",
        "50 to 500 MB",
        "0.1 to 20",
    ],
    ["spheres in place of bodies (Ren et al.)", "low", "all objects", "not stated", "about 25 for 2, 12 for 8 bodies"],
    [
        "irradiance vectors (the thesis)",
        "all",
        "receivers; occluders without turning",
        "below 1 to 10 MB",
        "112 for 1, 35 for 30 bodies",
    ],
];
