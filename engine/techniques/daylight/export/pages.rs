//! The images of all tiles on pages: plain images of which each tile has a square.

use half::f16;

use super::super::{Stored, layer::Layer, units::Tile};

/// One kind of light of all tiles.
#[derive(Clone, Debug)]
pub struct Pages {
    /// Short name: `sun`.
    pub name: &'static str,
    /// What a column of the table belongs to: `times`, `patches` or `lamps`.
    pub dimensions: &'static str,
    /// Columns of the table.
    pub columns: u32,
    pub pages: Vec<Page>,
    /// Coefficients: a row for each image of each tile. The light of an image is its values times the coefficient.
    pub table: Vec<f32>,
    /// For each tile its first row of the table.
    pub rows: Vec<u32>,
    /// For each tile the places of its images, in the order of the rows.
    pub spots: Vec<Vec<Spot>>,
}

/// An image that holds images of many tiles.
#[derive(Clone, Debug)]
pub struct Page {
    pub extent: [u32; 2],
    /// Whether the values are floats; else they are signed bytes, and 127 stands for 1.
    pub wide: bool,
    /// Four values for each texel; the fourth is 1 on a surface and else 0.
    pub values: Vec<[f32; 4]>,
}

/// Where the image of a tile is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spot {
    pub page: u32,
    /// Column and row of its first texel.
    pub corner: [u32; 2],
}

/// Largest side of a page, texels, if a tile is not larger.
const MOST_SIDE: u32 = 2048;

/// The kinds of light of a bake: sun, sky, and lamps if they are wanted.
pub fn layers(stored: &Stored, lamps: bool) -> Vec<Pages> {
    let mut out = vec![
        Pages::new(stored, "sun", "times", |tile| &tile.sun),
        Pages::new(stored, "sky", "patches", |tile| &tile.sky),
    ];
    if lamps {
        out.push(Pages::new(stored, "lamps", "lamps", |tile| &tile.lamps));
    }
    out
}

impl Pages {
    fn new(stored: &Stored, name: &'static str, dimensions: &'static str, of: impl Fn(&Tile) -> &Layer) -> Self {
        let side = stored.plan.side();
        let columns = stored.tiles.iter().map(|tile| of(tile).dimensions).max().unwrap_or(0);
        let mut out = Self {
            name,
            dimensions,
            columns,
            pages: Vec::new(),
            table: Vec::new(),
            rows: Vec::new(),
            spots: vec![Vec::new(); stored.tiles.len()],
        };
        for tile in &stored.tiles {
            let layer = of(tile);
            out.rows.push((out.table.len() / columns.max(1) as usize) as u32);
            for (image, row) in layer.table.chunks_exact(columns.max(1) as usize).enumerate() {
                // A byte of 127 is 1 in a page.
                let scale = if image < layer.wide as usize { 1.0 } else { 127.0 };
                out.table.extend(row.iter().map(|coefficient| coefficient * scale));
            }
        }
        // Spots are given out kind by kind and image by image: the most important images of all tiles come first.
        for wide in [true, false] {
            let count = |layer: &Layer| if wide { layer.wide } else { layer.narrow };
            let most = stored.tiles.iter().map(|tile| count(of(tile))).max().unwrap_or(0);
            let mut all: Vec<(u32, usize)> = Vec::new();
            for image in 0..most {
                let tiles = stored.tiles.iter().enumerate().filter(|(_, tile)| count(of(tile)) > image);
                all.extend(tiles.map(|(number, _)| (image, number)));
            }
            let along = (MOST_SIDE / side).max(1);
            for group in all.chunks((along * along) as usize) {
                let per_row = along.min((group.len() as f64).sqrt().ceil() as u32);
                let extent = [per_row * side, (group.len() as u32).div_ceil(per_row) * side];
                let texels = extent[0] as usize * extent[1] as usize;
                let mut page = Page { extent, wide, values: vec![[0.0; 4]; texels] };
                for (slot, (image, number)) in group.iter().enumerate() {
                    let corner = [slot as u32 % per_row * side, slot as u32 / per_row * side];
                    let layer = of(&stored.tiles[*number]);
                    let index = if wide { *image } else { layer.wide + image };
                    page.put(stored, *number, layer, index, corner);
                    out.spots[*number].push(Spot { page: out.pages.len() as u32, corner });
                }
                out.pages.push(page);
            }
        }
        out
    }

    /// Bytes of the table, little-endian.
    pub fn table_bytes(&self) -> Vec<u8> {
        self.table.iter().flat_map(|value| value.to_le_bytes()).collect()
    }
}

impl Page {
    /// Copies an image of a tile.
    fn put(&mut self, stored: &Stored, number: usize, layer: &Layer, image: u32, corner: [u32; 2]) {
        let [column, row, _, _] = stored.plan.tile(number as u32);
        // Coefficients of this image alone give its values.
        let mut alone = vec![[0.0; 3]; layer.images() as usize];
        alone[image as usize] = if self.wide { [1.0; 3] } else { [1.0 / 127.0; 3] };
        for (texel, [x, y]) in stored.plan.covered(number as u32, &stored.tiles[number].mask).enumerate() {
            let [r, g, b] = layer.decode(texel, &alone);
            let at = (corner[1] + y - row) * self.extent[0] + corner[0] + x - column;
            self.values[at as usize] = [r, g, b, 1.0];
        }
    }

    /// The bytes of the page without loss: 16-bit floats or signed bytes.
    pub fn bytes(&self) -> Vec<u8> {
        match self.wide {
            true => self.values.iter().flatten().flat_map(|value| f16::from_f32(*value).to_le_bytes()).collect(),
            false => {
                let byte = |value: &f32| ((value * 127.0).round() as i8).to_le_bytes();
                self.values.iter().flatten().flat_map(byte).collect()
            }
        }
    }
}
