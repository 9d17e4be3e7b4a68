//! From light to a layer: principal components, as many as the tolerance needs.

use super::{
    blocks::{Blocks, Coding, Layout, Texels},
    columns::{Columns, Measured, Rest, Weighted, left_out, level, project},
    image_values::{Choice, Image, Stored},
    layer::{Aim, Layer, rounded},
};
use crate::Result;

/// Parts of the tolerance that the error of one image in blocks may take. The coarsest one whose images are within the tolerance makes the
/// smallest file, but what the blocks of many images leave adds up.
const SHARES: [f64; 4] = [0.5, 0.25, 0.125, 0.0625];

impl Layer {
    /// Compresses the light of a tile: three rows (red, green, blue) for each texel. If the noise is known, the tolerance is for the light
    /// without it, and noise is no reason for an image.
    ///
    /// # Errors
    /// `Runtime` if the decomposition does not converge, or if a value is not finite.
    pub fn compress(light: Measured<'_>, columns: Columns<'_>, aim: Aim) -> Result<Self> {
        let Some(parts) = Parts::new(light, columns, aim)? else { return Ok(Self::none(light.dimensions)) };
        Ok(parts.compressed(Choice::PLAIN)?.0)
    }

    /// The same with images in blocks where they are good enough: the smallest layer of several that are within the tolerance as decoded from their
    /// blocks, and one without blocks if there is none.
    ///
    /// # Errors
    /// As [`Self::compress`].
    pub fn in_these(
        light: Measured<'_>,
        columns: Columns<'_>,
        aim: Aim,
        (texels, layout): (Texels, &Layout),
    ) -> Result<Self> {
        let with = |layer: Self| Self { blocks: Some(layer.blocks.unwrap_or_default()), ..layer };
        let Some(parts) = Parts::new(light, columns, aim)? else { return Ok(with(Self::none(light.dimensions))) };
        let (mut best, _) = parts.compressed(Choice::PLAIN)?;
        for share in SHARES {
            let (layer, within) =
                parts.compressed(Choice { codings: texels.codings(), layout: Some(layout), share })?;
            if within && layer.bytes() < best.bytes() {
                best = layer;
            }
        }
        Ok(with(best))
    }
}

/// Light that is being compressed.
struct Parts<'a> {
    light: Measured<'a>,
    columns: Columns<'a>,
    aim: Aim,
    weights: Vec<f64>,
    weighted: Weighted,
}

impl<'a> Parts<'a> {
    /// `None`: there is no light.
    fn new(light: Measured<'a>, columns: Columns<'a>, aim: Aim) -> Result<Option<Self>> {
        let texels = light.rows.len() / light.dimensions.max(1) / 3;
        let weights = columns.weights(light);
        if texels == 0 || weights.iter().all(|w| *w == 0.0) {
            return Ok(None);
        }
        let weighted = Weighted::new(light, &weights, aim.most)?;
        Ok(Some(Self { light, columns, aim, weights, weighted }))
    }

    /// The layer, and whether it is within the tolerance.
    fn compressed(&self, choice: Choice<'_>) -> Result<(Layer, bool)> {
        let Self { light, columns, aim, weights, weighted: Weighted { scaled, basis } } = self;
        let (light, columns, aim) = (*light, *columns, *aim);
        let texels = light.rows.len() / light.dimensions.max(1) / 3;
        let mut rest = Rest::new(light, columns);
        let mut images: Vec<Image> = Vec::new();
        let mut state = rest.state(aim.tolerance);
        for index in 0..basis.len() {
            if state.within {
                keep_means(&mut images, &mut rest, light);
                state = rest.state(aim.tolerance);
                if state.within {
                    break;
                }
            }
            let vector = basis.vector(index);
            // In units of light: what a dimension has at a coefficient of 1. Dimensions without light stay without.
            let along: Vec<f64> = vector.iter().zip(weights).map(|(v, w)| if *w > 0.0 { v / w } else { 0.0 }).collect();
            let values: Vec<f32> = project(scaled, vector).map(|value| value as f32).collect();
            let may_be_wide = images.iter().all(|image| image.stored != Stored::Narrow);
            let image = Image::new(&values, along, vector, aim.tolerance, (may_be_wide, choice))?;
            rest.remove(&image.table, &image.decoded);
            rest.remove_noise(vector, weights);
            images.push(image);
            state = rest.state(aim.tolerance);
        }
        // Where noise ended the images before the tolerance was reached, the mean is known all the same.
        keep_means(&mut images, &mut rest, light);
        state = rest.state(aim.tolerance);
        if let Some((colour, along)) = level(light, columns, &known(&images), aim.tolerance)
            && images.len() < aim.most
        {
            let values: Vec<f32> = colour.iter().copied().cycle().take(3 * texels).collect();
            // Bytes hold a colour well enough.
            let image = Image::new(&values, along, &[], aim.tolerance, (false, choice.exact_for_a_colour()))?;
            rest.remove(&image.table, &image.decoded);
            images.push(image);
            state = rest.state(aim.tolerance);
        }
        let layer = joined(images, texels, choice.layout)?;
        let layer = Layer {
            dimensions: light.dimensions as u32,
            worst: state.worst as f32,
            worst_dimension: state.column as u32,
            hidden: state.hidden as u32,
            noise: state.noise as f32,
            ..layer
        };
        Ok((layer, state.within))
    }
}

/// A layer of these images.
fn joined(mut images: Vec<Image>, texels: usize, layout: Option<&Layout>) -> Result<Layer> {
    images.sort_by_key(|image| image.stored);
    let count = |stored: Stored| images.iter().filter(|image| image.stored == stored).count() as u32;
    let [wide, narrow, hdr, pairs] =
        [Stored::Wide, Stored::Narrow, Stored::Blocks(Coding::Hdr), Stored::Blocks(Coding::Pair)].map(count);
    let stride = Layer::stride(wide, narrow) as usize;
    let mut words = vec![0u32; texels * stride];
    for (texel, row) in words.chunks_exact_mut(stride.max(1)).enumerate() {
        let mut bytes = Vec::with_capacity(4 * stride);
        for image in &images[..(wide + narrow) as usize] {
            for code in &image.codes[3 * texel..3 * texel + 3] {
                match image.stored {
                    Stored::Wide => bytes.extend_from_slice(&(*code as u16).to_le_bytes()),
                    _ => bytes.push(*code as u8),
                }
            }
        }
        bytes.resize(4 * stride, 0);
        for (word, bytes) in row.iter_mut().zip(bytes.chunks_exact(4)) {
            *word = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        }
    }
    let blocks = match layout {
        None => None,
        Some(layout) => {
            let bytes = images[(wide + narrow) as usize..].iter().flat_map(|image| image.blocks.iter().copied());
            Some(Blocks::read(hdr, pairs, bytes.collect(), layout)?)
        }
    };
    let table = images.iter().flat_map(|image| image.table.iter().copied()).collect();
    Ok(Layer { wide, narrow, table, words, blocks, ..Layer::none(0) })
}

/// What each dimension has of images, and their values.
fn known(images: &[Image]) -> Vec<(&[f32], &[f32])> {
    images.iter().map(|image| (image.table.as_slice(), image.decoded.as_slice())).collect()
}

/// Gives the first image what the mean of each dimension misses, so that neighbouring tiles fit together where a wall is even: the error that the
/// tolerance allows would otherwise be a step at their border.
fn keep_means(images: &mut [Image], rest: &mut Rest, light: Measured<'_>) {
    let missing = left_out(light, &known(images));
    let Some(first) = images.first_mut() else { return };
    let count = first.decoded.len().max(1) as f64;
    let mean = first.decoded.iter().map(|value| f64::from(*value)).sum::<f64>() / count;
    let square = first.decoded.iter().map(|value| f64::from(*value).powi(2)).sum::<f64>() / count;
    // An image that is dark here and bright there cannot carry a mean.
    if mean * mean < 0.1 * square || square == 0.0 {
        return;
    }
    let changed: Vec<f32> = first
        .table
        .iter()
        .zip(missing.iter().map(|channels| channels.iter().sum::<f64>() / 3.0))
        .map(|(along, missing)| if *along == 0.0 { 0.0 } else { rounded((f64::from(*along) + missing / mean) as f32) })
        .collect();
    let added: Vec<f32> = changed.iter().zip(&first.table).map(|(new, old)| new - old).collect();
    rest.remove(&added, &first.decoded);
    first.table = changed;
}
