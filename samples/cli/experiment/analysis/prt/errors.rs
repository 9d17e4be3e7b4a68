//! Errors of pictures by precomputed transfer against the path tracer under the same light.

use lucerna::{Error, Result};
use serde_json::Value;

use crate::experiment::{
    file::{Method, Role},
    kinds,
    results::{Done, Layer, Results},
};

/// Side of a block, pixels.
const BLOCK: usize = 8;

/// Error of a part of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Errors {
    /// Root mean square of the difference over the mean of the truth, %.
    pub rms: f64,
    /// The same of the means over blocks of 8×8 pixels: without most of the noise of the reference, and with less of what is at edges.
    pub blocks: f64,
    /// Sum over that of the truth: red, green, blue; NaN for a colour in which the truth is dark.
    pub energy: [f64; 3],
}

impl Errors {
    /// The errors of these pixels, rows of `width`; `None` if the truth is dark. `counts`: the pixels that count.
    pub fn of(width: usize, truth: &[[f32; 3]], test: &[[f32; 3]], counts: impl Fn(usize) -> bool) -> Option<Self> {
        let columns = width.div_ceil(BLOCK).max(1);
        let rows = truth.len().div_ceil(width.max(1)).div_ceil(BLOCK);
        let mut blocks = vec![([0.0f64; 3], 0u32); columns * rows];
        let (mut square, mut number) = (0.0, 0u32);
        let (mut found, mut whole) = ([0.0f64; 3], [0.0f64; 3]);
        for (at, (truth, test)) in truth.iter().zip(test).enumerate().filter(|(at, _)| counts(*at)) {
            number += 1;
            let (off, inside) = &mut blocks[at / width / BLOCK * columns + at % width / BLOCK];
            *inside += 1;
            for channel in 0..3 {
                let [a, b] = [truth, test].map(|pixel| f64::from(pixel[channel]));
                square += (a - b) * (a - b);
                off[channel] += b - a;
                found[channel] += b;
                whole[channel] += a;
            }
        }
        let values = 3.0 * f64::from(number.max(1));
        let mean = whole.iter().sum::<f64>() / values;
        // Each block counts as often as it has pixels.
        let of_block =
            |(off, inside): &([f64; 3], u32)| off.iter().map(|off| off * off).sum::<f64>() / f64::from(*inside);
        let of_blocks: f64 = blocks.iter().filter(|(_, inside)| *inside > 0).map(of_block).sum();
        (mean > 0.0).then(|| Self {
            rms: 100.0 * (square / values).sqrt() / mean,
            blocks: 100.0 * (of_blocks / values).sqrt() / mean,
            energy: std::array::from_fn(|c| if whole[c] > 0.0 { found[c] / whole[c] } else { f64::NAN }),
        })
    }

    /// Mean of the energies of all colours in which the truth has light.
    pub fn energy(&self) -> f64 {
        mean(self.energy.into_iter().filter(|energy| energy.is_finite())).unwrap_or(f64::NAN)
    }
}

/// Parts of the light whose errors are measured: name, and layer.
pub(super) const PARTS: [(&str, &str); 4] =
    [("shadow", "shadow"), ("direct", "direct"), ("indirect", "indirect"), ("total", "")];

/// A picture, and its reference if there is one.
pub(super) struct Case<'a> {
    pub run: &'a Done,
    pub truth: Option<&'a Done>,
    /// All settings of the picture.
    pub settings: Value,
}

impl Case<'_> {
    /// A setting by its path, such as `/bake/light`.
    pub fn setting(&self, path: &str) -> &Value {
        self.settings.pointer(path).unwrap_or(&Value::Null)
    }

    pub fn number(&self, path: &str) -> f64 {
        self.setting(path).as_f64().unwrap_or(f64::NAN)
    }

    /// The light: its place, or the scene's own light.
    pub fn light(&self) -> String {
        match self.setting("/lamp").as_str() {
            Some(light) if !light.is_empty() => light.to_owned(),
            _ => "the scene's".into(),
        }
    }

    /// Whether the picture shows light that is to be compared with the truth.
    pub fn shows_light(&self) -> bool {
        self.setting("/show") == "total" && self.number("/picture/prt/strength") == 1.0
    }
}

fn method<'a>(results: &'a Results, run: &Done) -> Result<&'a Method> {
    let method = results.experiment.methods.iter().find(|method| method.name == run.method);
    method.ok_or_else(|| Error::input("is no technique of the experiment").at(run.label()))
}

/// The lights of a picture, for equality.
pub(super) fn lights(settings: &Value, group: &str) -> (Value, Value, Value) {
    let of = |key: &str| settings.pointer(&format!("{group}/{key}")).cloned().unwrap_or_default();
    let radius = of("radius");
    let points = if radius.as_f64() == Some(0.0) { Value::Null } else { of("points") };
    (settings["lamp"].clone(), radius, points)
}

/// All pictures of the kind `prt`, each with the first reference of the kind `prt-truth` for the same view and lights.
pub(super) fn cases(results: &Results) -> Result<Vec<Case<'_>>> {
    let of_kind = |role: Role, kind: &'static str| {
        let runs = results.with_role(role).map(move |run| {
            let method = method(results, run)?;
            let settings = kinds::find(&method.kind)?.effective(method, &run.variant)?;
            Ok((method.kind == kind).then_some((run, settings)))
        });
        runs.filter_map(Result::transpose).collect::<Result<Vec<_>>>()
    };
    let truths = of_kind(Role::Reference, "prt-truth")?;
    let with_truth = |(run, settings): (&'_ Done, Value)| {
        let wanted = lights(&settings, "/picture/prt");
        let same = |(other, of): &&(&Done, Value)| {
            (&other.scene, &other.view) == (&run.scene, &run.view) && lights(of, "") == wanted
        };
        (truths.iter().find(same).map(|(truth, _)| *truth), settings)
    };
    let list = of_kind(Role::Technique, "prt")?.into_iter().map(|(run, settings)| {
        let (truth, settings) = with_truth((run, settings));
        Case { run, truth, settings }
    });
    Ok(list.collect())
}

/// A picture with its errors: of the shadow, and of direct, indirect and all light.
pub(super) struct Measured<'a> {
    pub case: &'a Case<'a>,
    pub parts: [Option<Errors>; 4],
}

/// The errors of all pictures of light that have a reference.
pub(super) fn measure<'a>(results: &Results, cases: &'a [Case<'a>]) -> Result<Vec<Measured<'a>>> {
    let mut list = Vec::new();
    for case in cases.iter().filter(|case| case.shows_light()) {
        let Some(truth) = case.truth else { continue };
        let facing = results.picture(Layer(truth, "facing"))?.pixels;
        let mut parts = [None; 4];
        for (part, (_, layer)) in parts.iter_mut().zip(PARTS) {
            let [a, b] = [results.picture(Layer(truth, layer))?, results.picture(Layer(case.run, layer))?];
            // Away from the light nothing is lit, whether anything is in between or not.
            let counts = |at: usize| layer != "shadow" || facing.get(at).is_some_and(|pixel| pixel[0] > 0.0);
            *part = Errors::of(a.width as usize, &a.pixels, &b.pixels, counts);
        }
        list.push(Measured { case, parts });
    }
    Ok(list)
}

/// Noise of direct, indirect and all light, %: of pixels and of blocks.
pub(super) type Noise = [Option<[f64; 2]>; 3];

/// Noise of each reference that has pictures with two seeds: the root mean square of the noise of one picture, relative to
/// the mean.
pub(super) fn noise(results: &Results) -> Result<Vec<(&Done, Noise)>> {
    let references: Vec<&Done> = results.with_role(Role::Reference).collect();
    let settings = |run: &Done| -> Result<(Value, Value)> {
        let method = method(results, run)?;
        let mut settings = kinds::find(&method.kind)?.effective(method, &run.variant)?;
        let seed = settings.pointer_mut("/tracer/seed").map(Value::take).unwrap_or_default();
        Ok((settings, seed))
    };
    let mut list = Vec::new();
    for (index, run) in references.iter().enumerate() {
        let (same, seed) = settings(run)?;
        for other in &references[..index] {
            let (of_other, other_seed) = settings(other)?;
            let place = |of: &Done| (of.scene.clone(), of.view.clone());
            if place(run) != place(other) || same != of_other || seed == other_seed {
                continue;
            }
            let mut parts = [None; 3];
            for (part, (_, layer)) in parts.iter_mut().zip(&PARTS[1..]) {
                let [a, b] = [results.picture(Layer(run, layer))?, results.picture(Layer(other, layer))?];
                // The difference of two pictures has the noise of both.
                let both = Errors::of(a.width as usize, &a.pixels, &b.pixels, |_| true);
                *part = both.map(|of| [of.rms, of.blocks].map(|error| error / 2f64.sqrt()));
            }
            list.push((*other, parts));
        }
    }
    Ok(list)
}

/// Mean of the values that are there; `None` without one.
pub(in super::super) fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}
