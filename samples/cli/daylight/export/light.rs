//! The light of one time as pictures: EXR, Radiance and KTX2.

use lucerna::{
    Result,
    image::{self, Format, Ktx2Format, Layers, Metadata, WriteOptions, encode_ktx2, encode_ktx2_cube},
    techniques::daylight::{
        Kind, Stored,
        cube::FACES,
        export::{self, Levels, Moment},
    },
};
use serde_json::{Value, json};

use super::{Folder, TexelArg, moments::Clock, table};
use crate::{console::Console, program};

/// Writes pictures of a bake.
pub struct Writer<'a> {
    pub stored: &'a Stored,
    /// Of [`export::sources`].
    pub sources: &'a [u32],
    pub format: TexelArg,
    pub console: Console,
}

impl Writer<'_> {
    /// Writes the pictures of a time and names them in its `entry` of the table. Radiance and KTX2 files only if they are wanted.
    ///
    /// # Errors
    /// `Output`; `Runtime` if a picture cannot be encoded.
    pub fn write(
        &self,
        folder: &mut Folder<'_>,
        moment: &Moment,
        clock: &Clock,
        date: &str,
        [radiance, blocks]: [bool; 2],
        entry: &mut Value,
    ) -> Result<()> {
        let light = export::irradiance(self.stored, moment);
        let is_lightmap = matches!(self.stored.plan.receivers, Kind::Lightmap { .. });
        let width = is_lightmap.then_some(self.stored.plan.extent[0]);
        let layers = self.pixels(&export::filled(&light, self.sources, width), clock, date);
        let encoded = |format| image::encode(format, &layers, &WriteOptions::default()).map(|(bytes, _)| bytes);
        let exr = format!("lightmap-{}.exr", clock.name);
        folder.write(exr.clone(), &encoded(Format::Exr)?)?;
        entry["exr"] = json!(exr);
        // The scene of a lightmap names this picture.
        if radiance && let Kind::Lightmap { .. } = self.stored.plan.receivers {
            let hdr = format!("lightmap-{}.hdr", clock.name);
            folder.write(hdr.clone(), &encoded(Format::Hdr)?)?;
            entry["hdr"] = json!(hdr);
        }
        if blocks {
            let ktx2 = format!("lightmap-{}.ktx2", clock.name);
            folder.write(ktx2.clone(), &self.ktx2(&light, clock)?)?;
            entry["ktx2"] = json!(ktx2);
        }
        Ok(())
    }

    /// The light as a picture of a file.
    fn pixels(&self, light: &[[f32; 3]], clock: &Clock, date: &str) -> Layers {
        let plan = &self.stored.plan;
        let [width, height] = plan.extent;
        let mut layers = Layers::rgb(width, height, light.as_flattened().to_vec());
        let extra = [("date", date), ("time", &clock.label), ("unit", table::UNIT)];
        layers.metadata = Metadata {
            program: "daylight export".into(),
            version: program::VERSION.into(),
            scene: plan.scene.clone(),
            technique: "daylight".into(),
            extra: extra.map(|(key, text)| (key.to_owned(), text.to_owned())).into(),
            ..Metadata::default()
        };
        layers
    }

    /// The light of a time with its levels: a picture, or the faces of a cube.
    fn ktx2(&self, light: &[[f32; 3]], clock: &Clock) -> Result<Vec<u8>> {
        let extent = self.stored.plan.extent;
        let about = [("lucerna.time", clock.label.as_str()), ("lucerna.unit", table::UNIT)];
        if let Kind::Cube { .. } = self.stored.plan.receivers {
            let side = extent[0] / FACES;
            let faces = export::faces(light, self.sources, side);
            let faces: Vec<Levels> = faces.iter().map(|(light, own)| export::levels(light, own, [side; 2])).collect();
            let (format, levels) = self.texels(&faces, clock);
            return encode_ktx2_cube(format, side, &levels, &about);
        }
        let (format, levels) = self.texels(&[export::levels(light, self.sources, extent)], clock);
        encode_ktx2(format, extent, &levels, &about)
    }

    /// The bytes of each level, face after face.
    fn texels(&self, faces: &[Levels], clock: &Clock) -> (Ktx2Format, Vec<Vec<u8>>) {
        let joined = |of: Vec<Vec<Vec<u8>>>| {
            let levels = of.first().map_or(0, Vec::len);
            (0..levels).map(|level| of.iter().flat_map(|face| face[level].iter().copied()).collect()).collect()
        };
        match self.format {
            TexelArg::Half => (Ktx2Format::R16g16b16a16Sfloat, joined(faces.iter().map(Levels::halves).collect())),
            TexelArg::Bc6h => {
                let (blocks, errors): (Vec<_>, Vec<f64>) = faces.iter().map(Levels::blocks).unzip();
                let error = errors.into_iter().fold(0.0, f64::max);
                let of = if faces.len() > 1 { " of the worst face" } else { "" };
                self.console.info(&format!(
                    "{}: BC6H, error {:.2} % of the mean{of} (root mean square)",
                    clock.label,
                    100.0 * error
                ));
                (Ktx2Format::Bc6hUfloatBlock, joined(blocks))
            }
        }
    }
}
