//! Figures 2 and 5: an object that stands in the scene after the bake, against the path tracer, which knows it.

use lucerna::{
    Result,
    measure::{Display, Measure, Picture},
};

use super::{
    SIDE,
    beside::{Two, pairs},
};
use crate::{
    experiment::results::{Layer, Results},
    report::{Comparison, Section, Table},
};

/// Name of the technique.
const ADDED: &str = "added";
/// Pixels beside the object are those within this part of the picture's width.
const BESIDE: usize = 16;

/// The parts of a picture.
const PARTS: [&str; 3] = ["the object", "beside it", "the rest"];

/// The part of each pixel: an index into [`PARTS`].
fn parts(object: &Picture) -> Vec<usize> {
    let (width, height) = (object.width as usize, object.height as usize);
    let shows = |x: usize, y: usize| object.pixels[y * width + x][0] > 0.5;
    let reach = (width / BESIDE).max(1);
    let around = |at: usize, most: usize| at.saturating_sub(reach)..(at + reach + 1).min(most);
    let cells = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let in_row: Vec<bool> = cells().map(|(x, y)| around(x, width).any(|column| shows(column, y))).collect();
    let near = |x: usize, y: usize| around(y, height).any(|row| in_row[row * width + x]);
    let part = |(x, y): (usize, usize)| match (shows(x, y), near(x, y)) {
        (true, _) => 0,
        (false, true) => 1,
        (false, false) => 2,
    };
    cells().map(part).collect()
}

/// Sums of the pixels of a part.
fn sums(picture: &Picture, parts: &[usize], part: usize) -> [f64; 3] {
    let pixels = picture.pixels.iter().zip(parts).filter(|(_, of)| **of == part);
    pixels.fold([0.0; 3], |sum, (pixel, _)| std::array::from_fn(|c| sum[c] + f64::from(pixel[c])))
}

fn ratio(found: f64, wanted: f64) -> Option<f64> {
    (wanted > 0.0).then(|| found / wanted)
}

/// The section; `None` without such runs.
pub(super) fn section(results: &Results) -> Result<Option<Section>> {
    let mut section = Section::new("Figures 2 and 5: an object that is added after the bake");
    section.text(
        "An object (as shipped, a pot) stands on the surface that is seen at a point of the picture. The bake does not know it, and the path tracer does. It has direct light of the sun and casts its shadow; its \
         indirect light comes from probes, or as in the paper from the baked light of the surface behind it. The bake does not know which light \
         the object blocks and which light it reflects: beside the object the baked light may be too large or too small, and the object's colour is missing. The \
         numbers are of the picture's light over that of the reference. The paper shows pictures and gives no numbers; its object is a red teapot.",
    );
    let columns = [
        "scene",
        "time",
        "indirect light of the object",
        "part of the picture",
        "pixels",
        "all light",
        "baked light, red",
        "baked light, green",
        "baked light, blue",
        "PDiff, whole picture (%)",
    ];
    let mut table =
        Table::new("added", "Light with an object that was added after the bake, over the reference's", columns);
    let mut sets = Vec::new();
    for view in &results.views() {
        for Two { run, truth, time } in pairs(results, *view, ADDED) {
            let from = run.variant.iter().find(|(key, _)| key.ends_with("daylight.added"));
            let from = from.and_then(|(key, _)| run.value(key)).unwrap_or_else(|| "probes".into());
            let of = |layer| -> Result<[Picture; 2]> {
                Ok([results.picture(Layer(run, layer))?, results.picture(Layer(truth, layer))?])
            };
            let ([all, all_wanted], [light, wanted]) = (of("")?, of("indirect")?);
            let parts = parts(&results.picture(Layer(run, "object"))?);
            let pdiff = results.measures(&[Measure::Pdiff], Layer(truth, ""), Layer(run, ""), None)?;
            for (part, name) in PARTS.iter().enumerate() {
                let pixels = parts.iter().filter(|of| **of == part).count();
                let [a, b, c, d] = [&all, &all_wanted, &light, &wanted].map(|picture| sums(picture, &parts, part));
                table.push([
                    format!("{}, {}", view.0, view.1).into(),
                    time.as_str().into(),
                    from.as_str().into(),
                    (*name).into(),
                    pixels.into(),
                    ratio(a.iter().sum(), b.iter().sum()).into(),
                    ratio(c[0], d[0]).into(),
                    ratio(c[1], d[1]).into(),
                    ratio(c[2], d[2]).into(),
                    pdiff.first().copied().into(),
                ]);
            }
            let stops = Display::default().stops(&all_wanted);
            let (scene, camera) = view;
            let id = format!("{scene}-{camera}-{ADDED}-{from}-{}", time.replace(':', ""));
            let title = format!("{scene}, {camera}, an added object with light of {from}, {time}");
            let set = Comparison::new(id, title, all.width, all.height)
                .exposure(stops)
                .with("baked daylight", all.pixels)
                .with("path tracer", all_wanted.pixels)
                .with("baked light", light.pixels)
                .with("path tracer, without the sun's direct light", wanted.pixels);
            sets.push(set.at_most(SIDE));
        }
    }
    if sets.is_empty() {
        return Ok(None);
    }
    section.add(table);
    sets.into_iter().for_each(|set| {
        section.add(set);
    });
    Ok(Some(section))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_has_an_object_what_is_beside_it_and_the_rest() {
        let mut pixels = vec![[0.0; 3]; 64 * 4];
        pixels[2 * 64 + 20] = [1.0; 3];
        let parts = parts(&Picture::new(64, 4, pixels).unwrap());
        assert_eq!(parts[2 * 64 + 20], 0);
        // Four pixels to each side.
        assert!(parts[2 * 64 + 24] == 1 && parts[20] == 1 && parts[2 * 64 + 25] == 2);
        assert_eq!(parts.iter().filter(|part| **part == 1).count(), 9 * 4 - 1);
        let picture = Picture::new(64, 4, (0..256).map(|_| [1.0, 2.0, 0.5]).collect()).unwrap();
        assert_eq!(sums(&picture, &parts, 1), [35.0, 70.0, 17.5]);
    }
}
