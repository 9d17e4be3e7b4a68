//! Figure 3: the elements whose sum is a picture.

use lucerna::{
    Result,
    measure::{Display, Picture},
};

use super::{SIDE, day::mean};
use crate::{
    experiment::results::{Done, Layer, Results},
    report::{Comparison, Section, Table},
};

/// Name of the technique.
const ELEMENTS: &str = "elements";
/// The key of its matrix.
const SKY: &str = "picture.daylight.sky";

/// One picture less another, pixel by pixel.
fn difference(more: &Picture, less: &Picture) -> Vec<[f32; 3]> {
    let pixel = |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|channel| a[channel] - b[channel]);
    more.pixels.iter().zip(&less.pixels).map(pixel).collect()
}

/// The section; `None` without such runs.
pub(super) fn section(results: &Results) -> Result<Option<Section>> {
    let mut section = Section::new("Figure 3: the elements of a picture");
    section.text(
        "A picture is the sum of the sun's direct light, drawn with a shadow map; the indirect light of the sun, from the bake; and the light of the sky, direct and indirect, from \
         the bake too. As in the paper, the light of the sky is that of the day's highest sun, scaled; the last column compares it with the light by the radiance of each patch of the sky at the \
         time. Shares are of the mean of the picture's pixels, without the sky behind the scene. The paper shows three pictures and gives no numbers.",
    );
    let columns = [
        "scene",
        "direct (%)",
        "indirect (%)",
        "sky, scaled (%)",
        "sum (%)",
        "picture, mean (W/(sr m²))",
        "sky by patches / scaled",
    ];
    let mut table = Table::new("elements", "Shares of the elements", columns);
    let mut sets = Vec::new();
    for view in results.views() {
        let of = |sky: &str| -> Option<&Done> {
            results.at(view).find(|run| run.method == ELEMENTS && run.value(SKY).as_deref() == Some(sky))
        };
        let (Some(dark), Some(scaled), Some(patches)) = (of("none"), of("scaled"), of("patches")) else { continue };
        let layer = |run, name| results.picture(Layer(run, name));
        let (mut direct, indirect, mut whole) = (layer(dark, "direct")?, layer(dark, "indirect")?, layer(scaled, "")?);
        // Where no surface is, the direct light is the sky behind the scene.
        for (pixel, normal) in layer(dark, "normal")?.pixels.iter().enumerate() {
            if *normal == [0.0; 3] {
                (direct.pixels[pixel], whole.pixels[pixel]) = ([0.0; 3], [0.0; 3]);
            }
        }
        let sky = difference(&layer(scaled, "indirect")?, &indirect);
        let exact = difference(&layer(patches, "indirect")?, &indirect);
        let sum: Vec<[f32; 3]> = (0..sky.len())
            .map(|at| std::array::from_fn(|c| direct.pixels[at][c] + indirect.pixels[at][c] + sky[at][c]))
            .collect();
        let means = [&direct.pixels, &indirect.pixels, &sky].map(|pixels| mean(pixels));
        let all = mean(&whole.pixels);
        let share = |of: f64| (all > 0.0).then(|| 100.0 * of / all);
        let (scene, camera) = view;
        table.push([
            format!("{scene}, {camera}").into(),
            share(means[0]).into(),
            share(means[1]).into(),
            share(means[2]).into(),
            share(means.iter().sum()).into(),
            all.into(),
            (means[2] > 0.0).then(|| mean(&exact) / means[2]).into(),
        ]);
        let (width, height) = (direct.width, direct.height);
        let stops = Display::default().stops(&Picture { width, height, pixels: sum.clone(), display_referred: false });
        let set = Comparison::new(
            format!("{scene}-{camera}-elements"),
            format!("{scene}, {camera}: elements"),
            width,
            height,
        )
        .exposure(stops)
        .with("sum", sum)
        .with("direct light", direct.pixels)
        .with("indirect light of the sun", indirect.pixels)
        .with("light of the sky, scaled", sky);
        sets.push(set.at_most(SIDE));
    }
    if sets.is_empty() {
        return Ok(None);
    }
    section.add(table);
    sets.into_iter().for_each(|set| section.add(set));
    Ok(Some(section))
}
