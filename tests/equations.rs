//! Every numbered equation of the papers is tagged where it is computed, as `[ISR 25]`, and every tag names a known equation.

use crate::common;
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

/// Tag, number and content of the equations that the engine computes, or from which it says to deviate.
const EQUATIONS: &[(&str, u32, &str)] = &[
    // Image-space radiosity, the dissertation.
    ("ISR", 6, "form factor of two differential areas"),
    ("ISR", 16, "attenuation of a spherical light"),
    ("ISR", 19, "mean absolute error over pixels and channels"),
    ("ISR", 20, "Pearson correlation"),
    ("ISR", 21, "quality function of two images and a model"),
    ("ISR", 25, "radiance that a pixel gathers from a neighbour"),
    ("ISR", 26, "occlusion of a pixel by a neighbour"),
    ("ISR", 27, "weights of the bilateral upsampling"),
    ("ISR", 28, "normalised weights of the bilateral upsampling"),
    ("ISR", 29, "sum of direct and indirect light"),
    ("ISR", 30, "exponential shadow test"),
    // Instant global illumination, Marques and Santos 2010.
    ("IGI", 1, "indirect radiance from virtual point lights"),
    ("IGI", 2, "joint bilateral upsampling"),
    // Fullsphere irradiance vectors, Michael 2010, chapter 3; equation 17 stands in chapter 5.
    ("FIV", 3, "radiance of a diffuse surface"),
    ("FIV", 6, "irradiance from discrete lights"),
    ("FIV", 10, "fullsphere irradiance vector"),
    ("FIV", 11, "fullsphere irradiance as a dot product"),
    ("FIV", 12, "irradiance as total minus occluded irradiance"),
    ("FIV", 13, "the same for fullsphere irradiance, for shadows of occluders on themselves"),
    ("FIV", 14, "irradiance that two overlapping occluders hide"),
    ("FIV", 15, "share of the overlap"),
    ("FIV", 17, "normalised root mean square error"),
    // Tone mapping, Michael 2010, chapters 4 and 5.
    ("TM", 18, "root mean square of relative errors, percent"),
    ("TM", 19, "mean of relative errors, percent"),
];

/// The tags of a text: a paper's short name and a number in brackets.
fn tags(text: &str) -> Vec<(String, u32)> {
    let names: BTreeSet<&str> = EQUATIONS.iter().map(|(paper, ..)| *paper).collect();
    let tag = |part: &str| {
        let (paper, number) = part.split_once(']')?.0.split_once(' ')?;
        let number = number.parse().ok()?;
        names.contains(paper).then(|| (paper.to_owned(), number))
    };
    text.split('[').skip(1).filter_map(tag).collect()
}

/// All tags of the sources below a folder, with the files that have them.
fn collect(folder: &Path, found: &mut BTreeMap<(String, u32), Vec<String>>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            collect(&path, found);
        } else if path.extension().is_some_and(|e| ["rs", "glsl", "comp", "frag", "vert"].iter().any(|x| e == *x)) {
            for tag in tags(&fs::read_to_string(&path).unwrap()) {
                found.entry(tag).or_default().push(path.display().to_string());
            }
        }
    }
}

#[test]
fn every_equation_has_its_place_and_every_tag_its_equation() {
    let mut found = BTreeMap::new();
    for folder in ["engine", "shaders-glsl"] {
        collect(&common::root().join(folder), &mut found);
    }
    let known: BTreeMap<_, _> = EQUATIONS.iter().map(|(paper, n, what)| (((*paper).to_owned(), *n), *what)).collect();
    assert_eq!(known.len(), EQUATIONS.len(), "an equation is listed twice");
    let missing: Vec<_> = known.iter().filter(|(tag, _)| !found.contains_key(*tag)).collect();
    assert!(missing.is_empty(), "no source has the tags of {missing:?}");
    let strange: Vec<_> = found.iter().filter(|(tag, _)| !known.contains_key(*tag)).collect();
    assert!(strange.is_empty(), "these tags name no known equation: {strange:?}");
}

#[test]
fn tags_are_found_in_text() {
    assert_eq!(tags("a[0] // [ISR 25] and [FIV 3], [ISR x], [HDR 7], [IGI 2"), [("ISR".into(), 25), ("FIV".into(), 3)]);
}
