//! Tables 17 and 18: visibility of the errors before and after tone mapping.

use lucerna::{
    Result,
    image::srgb,
    measure::{Measure, Measured, Options, Pair, Picture},
    reference::tonemap,
    techniques::tonemap::Settings,
};

use super::super::observer;
use super::{GROUND, Lab, SETS, TRUTH, paper};
use crate::{
    experiment::results::{Done, Layer},
    report::{Cell, Comparison, Section, Table},
};

/// Screen value of a picture's 99th percentile.
const BRIGHT: f64 = 0.9;
/// Luminance to which the log-average is scaled for an operator that works in cd/m².
const GREY: f32 = 18.0;

/// Longest side of an image in the page, pixels.
const SIDE: u32 = 384;

/// Five of the 255 steps from black to the screen's white.
const CODES: f64 = 5.0 / 255.0;

/// The tables: the thesis' views, and the ground alone.
pub(super) fn tables(lab: &Lab<'_>) -> Result<Section> {
    let mut section = Section::new("Tables 17 and 18: before and after tone mapping");
    section.text(
        "Share of pixels with a visible difference from brute force (VDP for an inexperienced observer, p > 0.95, as in the tables of tone mapping). The first two tables have the thesis' views: in perspective, with the \
         environment behind, without the objects that cast the shadows, so that they hide no error (section 5.4). Before tone mapping, pixels of the background cannot differ; they count. *Before* is before \
         tone mapping, at an exposure at which the lit ground spans the screen's range. *After* is after \
         Ashikhmin's local operator. The thesis names neither the program that computed its VDP nor its settings. *Background* is the share of pixels that show the environment. \
         *Differ* is the share of pixels that differ before tone mapping by more than 5/255 of the screen's white. VDP marks more pixels, most of all in small pictures, so rows of different sizes cannot be compared; `samples/fiv/README.md` has its values with other settings.",
    );
    let mut images = Vec::new();
    for (id, more, seen) in [("", "", SEEN), ("-ground", ", the ground alone from above", OVER)] {
        let caption = format!("Table 17: VDP (%) by samples, bunny under one area light{more}");
        let mut table = Table::new(
            format!("table-17{id}"),
            lab.caption_without_size(&caption),
            ["samples", "size"].into_iter().chain(COLUMNS),
        );
        for (samples, before, after) in paper::TABLE_17 {
            if let Some(found) = seen.found(lab, "bunny, area", samples)? {
                table.push([samples.into(), found.size()].into_iter().chain(found.cells(before, after)));
                images.extend((id.is_empty()).then(|| found.images("39", "Figures 39 and 40", "bunny, area", samples)));
            }
        }
        section.add(table);
        let caption = lab.caption_without_size(&format!("Table 18: VDP (%) by environment, a bunny{more}"));
        let columns = ["environment", "samples", "size"].into_iter().chain(COLUMNS);
        let mut table = Table::new(format!("table-18{id}"), caption, columns);
        for (name, scene, before, after) in paper::TABLE_18 {
            let samples = seen.nearest(lab, scene);
            if let Some(found) = seen.found(lab, scene, samples)? {
                table.push([name.into(), samples.into(), found.size()].into_iter().chain(found.cells(before, after)));
                images.extend((id.is_empty()).then(|| found.images("41", "Figures 41 and 42", scene, samples)));
            }
        }
        section.add(table);
    }
    section.text(
        "The same pairs before tone mapping, with other settings of the VDP. *8 bits*: both pictures are rounded to the codes of an sRGB \
         file first, as a program that reads such files sees them. *p > 0.75*: a difference must be detected with this probability. *Half the \
         pixels per degree*: the screen is half as far away. *Practised*: the observer of Daly, whose masking has a slope of 0.7, with p > 0.75.",
    );
    section.add(observers(lab)?);
    section.text(
        "The operator works in cd/m², and the thesis prints no unit for its pictures of scenes. The last table has the shares after tone mapping for other luminances of the log-average. Section 5.4 says that \
         tone mapping lowers the share of visible differences; the column *least* has the lowest share of the row.",
    );
    section.add(units(lab)?);
    images.into_iter().for_each(|set| section.add(set));
    Ok(section)
}

/// Shares of visible differences before tone mapping by the settings of the VDP.
fn observers(lab: &Lab<'_>) -> Result<Table> {
    let columns = ["environment", "samples", "size", "thesis", "as above", "8 bits", "p > 0.75", "8 bits, p > 0.75"];
    let more = ["half the pixels per degree", "practised"];
    let caption = lab.caption_without_size("VDP (%) before tone mapping by its settings");
    let mut table = Table::new("vdp-settings", caption, columns.into_iter().chain(more));
    let sets = paper::TABLE_17.map(|(samples, before, _)| ("one area light", "bunny, area", Some(samples), before));
    let environments = paper::TABLE_18.map(|(name, scene, before, _)| (name, scene, None, before));
    for (name, scene, samples, thesis) in sets.into_iter().chain(environments) {
        let samples = samples.unwrap_or_else(|| SEEN.nearest(lab, scene));
        let Some(found) = SEEN.found(lab, scene, samples)? else { continue };
        let [float, codes] = [false, true].map(|codes| found.before(codes));
        let (float, codes) = (float?, codes?);
        let own = observer::inexperienced(0.0);
        let practised = observer::practised(0.0);
        let likely = Options { vdp_threshold: practised.vdp_threshold, ..own.clone() };
        let near = Options { pixels_per_degree: 0.5 * own.pixels_per_degree, ..own.clone() };
        let shares = [
            found.vdp[0].value,
            share(&codes, &own)?,
            share(&float, &likely)?,
            share(&codes, &likely)?,
            share(&float, &near)?,
            share(&float, &practised)?,
        ];
        let cells = [name.into(), samples.into(), found.size(), thesis.into()];
        table.push(cells.into_iter().chain(shares.map(Cell::from)));
    }
    Ok(table)
}

/// Luminances to which the log-average is scaled before tone mapping, cd/m².
const GREYS: [f32; 5] = [0.3, 2.0, GREY, 100.0, 600.0];

/// Shares of visible differences after tone mapping by the unit of the pictures.
fn units(lab: &Lab<'_>) -> Result<Table> {
    let columns = ["environment", "samples", "size", "before (thesis)", "after (thesis)", "before"].map(str::to_owned);
    let greys = GREYS.map(|grey| format!("after, {grey} cd/m²"));
    let caption = lab.caption_without_size("VDP (%) after tone mapping by the luminance of the log-average");
    let columns = columns.into_iter().chain(greys).chain(["least".to_owned()]);
    let mut table = Table::new("vdp-units", caption, columns);
    let sets =
        paper::TABLE_17.map(|(samples, before, after)| ("one area light", "bunny, area", Some(samples), before, after));
    let environments = paper::TABLE_18.map(|(name, scene, before, after)| (name, scene, None, before, after));
    for (name, scene, samples, before, after) in sets.into_iter().chain(environments) {
        let samples = samples.unwrap_or_else(|| SEEN.nearest(lab, scene));
        let Some(found) = SEEN.found(lab, scene, samples)? else { continue };
        let mut shares = Vec::new();
        for grey in GREYS {
            let pair = [mapped(&found.truth[0], grey)?, mapped(&found.test[0], grey)?];
            shares.push(share(&pair, &observer::inexperienced(0.0))?);
        }
        let least = shares.iter().copied().fold(f64::INFINITY, f64::min);
        let cells = [name.into(), samples.into(), found.size(), before.into(), after.into(), found.vdp[0].value.into()];
        table.push(cells.into_iter().chain(shares.into_iter().chain([least]).map(Cell::from)));
    }
    Ok(table)
}

fn share([truth, test]: &[Picture; 2], options: &Options) -> Result<f64> {
    Ok(Measure::Vdp.of(&Pair::new(truth, test)?, options)?.value)
}

/// Columns of both tables after the case.
const COLUMNS: [&str; 7] =
    ["before (thesis)", "before", "after (thesis)", "after", "after − before", "differ", "background"];

/// The pictures in which differences are counted.
#[derive(Clone, Copy)]
struct Seen {
    /// Ends of the names of scenes and of techniques.
    scene: &'static str,
    technique: &'static str,
    view: &'static str,
}

/// The camera of the thesis' views, as the experiment's file names it: the environment fills a part of the picture.
const HORIZON: &str = "0.4,0.75,3.6,0,0.6,0,48";
/// The thesis' views.
const SEEN: Seen = Seen { scene: ", seen", technique: ", hidden", view: HORIZON };
/// The ground from above.
const OVER: Seen = Seen { scene: "", technique: "", view: GROUND };

/// A picture and its reference, before (0) and after (1) tone mapping.
struct Found {
    /// Exposure before tone mapping.
    stops: f64,
    /// Percentage of the pixels that show the environment.
    background: f64,
    truth: [Picture; 2],
    test: [Picture; 2],
    vdp: [Measured; 2],
}

impl Seen {
    fn run<'a>(self, lab: &Lab<'a>, scene: &str, technique: &str) -> Option<&'a Done> {
        let (scene, technique) = (format!("{scene}{}", self.scene), format!("{technique}{}", self.technique));
        let mut runs = lab.results.runs.iter().filter(|run| run.scene == scene && run.method == technique);
        // A scene with sizes of its own has views with the size in their names.
        runs.find(|run| run.view.strip_prefix(self.view).is_some_and(|rest| rest.is_empty() || rest.starts_with(' ')))
    }

    /// The densest set of samples with a picture.
    fn nearest(self, lab: &Lab<'_>, scene: &str) -> &'static str {
        SETS.into_iter().find(|set| self.run(lab, scene, set).is_some()).unwrap_or(paper::DENSEST)
    }

    fn found(self, lab: &Lab<'_>, scene: &str, technique: &str) -> Result<Option<Found>> {
        let Some((truth, run)) = self.run(lab, scene, TRUTH).zip(self.run(lab, scene, technique)) else {
            return Ok(None);
        };
        let picture = |run: &Done| lab.results.picture(Layer(run, ""));
        // Pixels that are never visible do not count as different.
        let open = lab.open(truth)?;
        let lit = self.surfaces(lab, truth)?;
        let is_ground = |i: usize| lit.get(i).copied().unwrap_or(true);
        let (truth, mut test) = (picture(truth)?, picture(run)?);
        for (i, _) in open.iter().flatten().enumerate().filter(|(_, open)| !**open) {
            test.pixels[i] = truth.pixels[i];
        }
        let ground: Vec<[f32; 3]> =
            (0..truth.pixels.len()).filter(|i| is_ground(*i)).map(|i| truth.pixels[i]).collect();
        let background = 100.0 * (1.0 - ground.len() as f64 / truth.pixels.len().max(1) as f64);
        let stops = exposure(ground);
        let [truth_after, test_after] = [mapped(&truth, GREY)?, mapped(&test, GREY)?];
        let vdp = [vdp(&truth, &test, stops)?, vdp(&truth_after, &test_after, 0.0)?];
        Ok(Some(Found { stops, background, truth: [truth, truth_after], test: [test, test_after], vdp }))
    }

    /// For each pixel, whether it shows a surface: surfaces have irradiance in at least one of the environments, the background has none. From above
    /// every pixel shows the ground.
    fn surfaces(self, lab: &Lab<'_>, truth: &Done) -> Result<Vec<bool>> {
        let mut lit = Vec::new();
        if self.view == GROUND {
            return Ok(lit);
        }
        for run in lab.results.of(&truth.method).filter(|run| run.view == truth.view) {
            let pixels = lab.results.picture(Layer(run, "irradiance"))?.pixels;
            lit.resize(pixels.len().max(lit.len()), false);
            lit.iter_mut().zip(&pixels).for_each(|(lit, pixel)| *lit |= pixel.iter().any(|v| *v > 0.0));
        }
        Ok(lit)
    }
}

impl Found {
    /// The size of the pictures, pixels.
    fn size(&self) -> Cell {
        format!("{}×{}", self.truth[0].width, self.truth[0].height).into()
    }

    /// Cells of [`COLUMNS`], beside the thesis' values.
    fn cells(&self, thesis_before: f64, thesis_after: f64) -> [Cell; 7] {
        let [before, after] = [0, 1].map(|at: usize| self.vdp[at].value);
        let differ = differing(&self.truth[0], &self.test[0], self.stops);
        [thesis_before, before, thesis_after, after, after - before, differ, self.background].map(Cell::from)
    }

    /// The pair before tone mapping as light of a screen: reference and test. `codes`: rounded to the codes of an sRGB file.
    fn before(&self, codes: bool) -> Result<[Picture; 2]> {
        let factor = self.stops.exp2() as f32;
        let of = |picture: &Picture| {
            let shown = |value: f32| {
                let light = (value * factor).clamp(0.0, 1.0);
                if codes { srgb::decode_u8(srgb::encode_u8(light)) } else { light }
            };
            Picture::new(picture.width, picture.height, picture.pixels.iter().map(|p| p.map(shown)).collect())
        };
        Ok([of(&self.truth[0])?, of(&self.test[0])?])
    }

    /// Pictures and maps of one case.
    fn images(&self, id: &str, figures: &str, scene: &str, samples: &str) -> Comparison {
        let factor = self.stops.exp2() as f32;
        let exposed = |picture: &Picture| picture.pixels.iter().map(|p| p.map(|v| v * factor)).collect::<Vec<_>>();
        let map = |at: usize| self.vdp[at].map.values.iter().map(|v| [*v; 3]).collect::<Vec<_>>();
        let (width, height) = (self.truth[0].width, self.truth[0].height);
        Comparison::new(
            format!("perceived-{id}-{scene}-{samples}"),
            format!("{figures}: {scene}, {samples}"),
            width,
            height,
        )
        .exposure(0.0)
        .values("linear light of a screen, whose white is 1; maps: probability of detection")
        .with("before, brute force", exposed(&self.truth[0]))
        .with("before, vectors", exposed(&self.test[0]))
        .with("VDP map before", map(0))
        .with("after, brute force", self.truth[1].pixels.clone())
        .with("after, vectors", self.test[1].pixels.clone())
        .with("VDP map after", map(1))
        .at_most(SIDE)
    }
}

fn vdp(truth: &Picture, test: &Picture, stops: f64) -> Result<Measured> {
    Measure::Vdp.of(&Pair::new(truth, test)?, &observer::inexperienced(stops))
}

/// Percent of pixels in which a channel differs by more than [`CODES`] of the screen's white.
fn differing(truth: &Picture, test: &Picture, stops: f64) -> f64 {
    let apart = |a: &[f32; 3], b: &[f32; 3]| (0..3).any(|k| f64::from((a[k] - b[k]).abs()) * stops.exp2() > CODES);
    let count = truth.pixels.iter().zip(&test.pixels).filter(|(a, b)| apart(a, b)).count();
    100.0 * count as f64 / truth.pixels.len().max(1) as f64
}

/// The exposure, in stops, at which pixels span the screen's range.
fn exposure(pixels: Vec<[f32; 3]>) -> f64 {
    let mut values: Vec<f32> = pixels.iter().map(|p| p[0].max(p[1]).max(p[2])).collect();
    if values.is_empty() {
        return 0.0;
    }
    let at = values.len() * 99 / 100;
    let bright = f64::from(*values.select_nth_unstable_by(at, f32::total_cmp).1);
    if bright > 0.0 { (BRIGHT / bright).log2().clamp(-64.0, 64.0) } else { 0.0 }
}

/// The picture after Ashikhmin's local operator, as linear light of a screen. `grey`: luminance of its log-average, cd/m².
fn mapped(picture: &Picture, grey: f32) -> Result<Picture> {
    let settings = Settings { normalize: true, exposure: grey.log2(), ..Settings::default() };
    let pixels = tonemap::tonemap(picture.width, picture.height, &picture.pixels, &settings);
    Picture::new(picture.width, picture.height, pixels)
}
