//! The texels of a whole bake: which ones are neighbours, in the bake and by tile.

use super::{Plan, gathered::Gathered};

/// A texel of the whole bake.
#[derive(Clone, Copy, Debug)]
pub struct Texel {
    pub tile: u32,
    /// Among the tile's texels on surfaces.
    pub number: u32,
    column: u32,
    row: u32,
    pub position: [f32; 3],
    pub normal: [f32; 3],
    /// From its centre to its position, texels.
    pub offset: [f32; 2],
    /// Distance to the next texels, metres.
    pub size: f32,
}

impl Texel {
    #[cfg(test)]
    pub fn at([column, row]: [u32; 2], position: [f32; 3], normal: [f32; 3], offset: [f32; 2]) -> Self {
        Self { tile: 0, number: 0, column, row, position, normal, offset, size: 1.0 }
    }

    /// From this texel to another, metres.
    pub fn way_to(&self, other: &Self) -> [f32; 3] {
        [0, 1, 2].map(|i| other.position[i] - self.position[i])
    }
}

/// All texels of a bake on surfaces, tile after tile.
#[derive(Debug)]
pub struct Listed {
    pub texels: Vec<Texel>,
    /// The first texel of each tile, and their number.
    firsts: Vec<u32>,
    /// The texel at each place of the bake.
    at: Vec<u32>,
    extent: [u32; 2],
}

/// No texel.
const NONE: u32 = u32::MAX;

impl Listed {
    pub fn new(plan: &Plan, tiles: &[Gathered]) -> Self {
        let [columns, rows] = plan.extent;
        let at = vec![NONE; columns as usize * rows as usize];
        let mut listed = Self { texels: Vec::new(), firsts: vec![0], at, extent: plan.extent };
        for (tile, gathered) in tiles.iter().enumerate() {
            let covered = plan.covered(tile as u32, &gathered.mask);
            for (number, ([column, row], spot)) in covered.zip(&gathered.spots).enumerate() {
                listed.at[row as usize * columns as usize + column as usize] = listed.texels.len() as u32;
                listed.texels.push(Texel {
                    tile: tile as u32,
                    number: number as u32,
                    column,
                    row,
                    position: spot.position,
                    normal: spot.normal,
                    offset: spot.offset,
                    size: 0.0,
                });
            }
            listed.firsts.push(listed.texels.len() as u32);
        }
        listed.set_sizes();
        listed
    }

    #[cfg(test)]
    pub fn of(texels: Vec<Texel>, extent: [u32; 2]) -> Self {
        let mut at = vec![NONE; extent[0] as usize * extent[1] as usize];
        for (number, texel) in (0..).zip(&texels) {
            at[(texel.row * extent[0] + texel.column) as usize] = number;
        }
        Self { firsts: vec![0, texels.len() as u32], texels, at, extent }
    }

    /// The texels of a tile.
    pub fn of_tile(&self, tile: usize) -> std::ops::Range<u32> {
        self.firsts[tile]..self.firsts[tile + 1]
    }

    /// The texel that is so many columns and rows away from another texel in the bake.
    pub fn beside(&self, texel: &Texel, [columns, rows]: [i64; 2]) -> Option<u32> {
        let (x, y) = (i64::from(texel.column) + columns, i64::from(texel.row) + rows);
        let inside = x >= 0 && y >= 0 && x < i64::from(self.extent[0]) && y < i64::from(self.extent[1]);
        inside.then(|| self.at[(y * i64::from(self.extent[0]) + x) as usize]).filter(|other| *other != NONE)
    }

    /// Sets the distance of each texel to its next neighbours in the bake. Texels without neighbours take the median of all.
    fn set_sizes(&mut self) {
        let found: Vec<f32> = self
            .texels
            .iter()
            .map(|texel| {
                let distance = |way| {
                    let way = texel.way_to(&self.texels[self.beside(texel, way)? as usize]);
                    Some(dot(way, way).sqrt()).filter(|distance| *distance > 0.0)
                };
                [[1, 0], [-1, 0], [0, 1], [0, -1]].into_iter().filter_map(distance).fold(f32::INFINITY, f32::min)
            })
            .collect();
        let mut known: Vec<f32> = found.iter().copied().filter(|size| size.is_finite()).collect();
        known.sort_by(f32::total_cmp);
        let median = known.get(known.len() / 2).copied().unwrap_or(1.0);
        // A neighbour in the bake may be far away on another surface, or very near in a narrow chart.
        for (texel, size) in self.texels.iter_mut().zip(found) {
            texel.size = if size.is_finite() { size.clamp(0.25 * median, 4.0 * median) } else { median };
        }
    }
}

pub(super) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
