//! Terrain from a height map, in as many triangles as its error allows.
//!
//! The mesh is a right-triangulated irregular network (Evans, Kirkpatrick and Townsend, *Right-triangulated irregular networks*, Algorithmica 30,
//! 2001): two right triangles cover the map, and each is halved at the middle of its longest side for as long as a height in it may differ by more than
//! the allowed error. The error of a triangle is bounded by what halving changes at the middle of its side, added to the larger bound of the halves.
//! The bound of a middle is that of both triangles beside it and of all below them, so that two neighbours are always halved together and no crack opens.

use std::path::Path;

use glam::{UVec2, Vec2, Vec3, Vec4, uvec2};

use super::{Limits, Material, Mesh, Node, Note, NoteKind, Primitive, Scene, extent};
use crate::{
    Error, ErrorKind, Result,
    image::{self, Layers},
};

/// Most squares between samples along an edge. A larger map is averaged.
const MOST_SQUARES: u32 = 4096;
/// Largest height and error, metres.
const HIGHEST: f32 = 1e5;
/// Albedo, linear Rec. 709: dry grass.
const GRASS: Vec3 = Vec3::new(0.21, 0.23, 0.11);
/// Name of the node, of the mesh and of the material.
pub const NAME: &str = "terrain";

/// A map of heights.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightMap {
    /// Columns and rows, at least two each.
    pub size: UVec2,
    /// Rows from the top of the picture, which lies at −Z. Whole numbers of a file are 0 to 1, floating-point numbers are as they are.
    pub values: Vec<f32>,
    /// The values are floating-point numbers of a file, usually metres.
    pub metres: bool,
}

/// The place of a terrain in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terrain {
    /// Length of the longer edge, metres.
    pub width: f32,
    /// Height of the value 1 over the value 0, metres.
    pub height: f32,
    /// Largest difference between a sample of the map and the surface, metres. 0: every sample of the map that is off its neighbours' plane.
    pub error: f32,
    /// World position of the middle at the value 0, metres.
    pub middle: Vec3,
}

impl Terrain {
    /// Usual numbers for a map, where none is given: one metre from sample to sample; a height of a tenth of the width, or of 1 m if the values are metres;
    /// an error of a thousandth of the difference between the highest and the lowest place.
    pub fn of(map: &HeightMap, width: Option<f32>, height: Option<f32>, error: Option<f32>) -> Self {
        let width = width.unwrap_or(map.size.max_element().saturating_sub(1) as f32);
        let height = height.unwrap_or(if map.metres { 1.0 } else { (0.1 * width).min(HIGHEST) });
        let most = map.values.iter().copied().fold(f32::MIN, f32::max);
        let least = map.values.iter().copied().fold(f32::MAX, f32::min);
        let error = error.unwrap_or_else(|| (1e-3 * height.abs() * (most - least)).clamp(0.0, HIGHEST));
        Self { width, height, error, middle: Vec3::ZERO }
    }

    /// Whether the numbers are in their ranges.
    ///
    /// # Errors
    /// `Usage`, naming the number.
    pub fn check(&self) -> Result<()> {
        let wrong = |name: &str, found: f32, allowed: &str| {
            Err(Error::usage(format!("{name} of a terrain is {found}; allowed: {allowed}")))
        };
        if !(1e-3..=1e6).contains(&self.width) {
            return wrong("the width", self.width, "0.001 to 1000000 metres");
        }
        if !(-HIGHEST..=HIGHEST).contains(&self.height) {
            return wrong("the height", self.height, "-100000 to 100000 metres");
        }
        if !(0.0..=HIGHEST).contains(&self.error) {
            return wrong("the error", self.error, "0 to 100000 metres");
        }
        if !self.middle.is_finite() {
            return Err(Error::usage("the middle of a terrain is not finite"));
        }
        Ok(())
    }
}

impl HeightMap {
    /// Reads a picture: PNG, JPEG, WebP, BMP or TGA with 8 or 16 bits, or EXR, PFM or HDR. Notes say which channels are left out.
    ///
    /// # Errors
    /// `Input` for a file that cannot be read, has fewer than two rows or columns, or a value that is no number; it names the file.
    pub fn read(path: &Path, limits: &Limits) -> Result<(Self, Vec<Note>)> {
        let bytes = image::read_file_checked(path, limits.max_file)?;
        Self::decode(&bytes, limits).map_err(|error| error.in_file(path))
    }

    fn decode(bytes: &[u8], limits: &Limits) -> Result<(Self, Vec<Note>)> {
        let (map, left_out) = match super::texture::luma(bytes, limits)? {
            Some((size, codes, color)) => {
                let values = codes.into_iter().map(|code| f32::from(code) / f32::from(u16::MAX)).collect();
                let left_out = color.then_some("colours of the height map are left out; its heights are their luma");
                (Self { size, values, metres: false }, left_out)
            }
            None => Self::of_layers(&image::decode(bytes, limits)?)?,
        };
        map.check()?;
        if let Some(at) = map.values.iter().position(|value| !value.is_finite()) {
            let (x, y) = (at as u32 % map.size.x, at as u32 / map.size.x);
            return Err(Error::input(format!("the value in column {x}, row {y} is no finite number")));
        }
        let note = |kind, text: &str| Note { kind, place: NAME.into(), text: text.to_owned() };
        let left_out = left_out.map(|text| note(NoteKind::Ignored, text));
        let missing = super::texture::missing(bytes).map(|text| note(NoteKind::Approximated, text));
        Ok((map, left_out.into_iter().chain(missing).collect()))
    }

    /// Whether there are two rows and two columns, and a value for each sample.
    fn check(&self) -> Result<()> {
        let wrong = |help: &str| {
            let what = format!("{} × {} samples with {} values", self.size.x, self.size.y, self.values.len());
            Err(Error::input(what).help(help))
        };
        if self.size.min_element() < 2 {
            return wrong("A height map has at least two rows and two columns");
        }
        if u64::from(self.size.x) * u64::from(self.size.y) != self.values.len() as u64 {
            return wrong("A height map has one value for each sample");
        }
        Ok(())
    }

    fn of_layers(picture: &Layers) -> Result<(Self, Option<&'static str>)> {
        let layer = picture.layers.first().ok_or_else(|| Error::input("has no layer"))?;
        let step = layer.channels.len().max(1);
        let values: Vec<f32> = layer.data.iter().copied().step_by(step).collect();
        let grey = layer.data.chunks_exact(step).all(|all| all.iter().take(3).all(|one| *one == all[0]));
        let more = picture.layers.len() > 1 || !grey;
        let map = Self { size: uvec2(picture.width, picture.height), values, metres: true };
        Ok((map, more.then_some("all channels of the height map but the first are left out")))
    }

    /// The value at a place, samples from the upper left one, between four samples.
    fn between(&self, place: Vec2) -> f32 {
        let place = place.clamp(Vec2::ZERO, (self.size - 1).as_vec2());
        let corner = place.floor().as_uvec2().min(self.size - 2);
        let share = place - corner.as_vec2();
        let value = |x: u32, y: u32| self.values[((corner.y + y) * self.size.x + corner.x + x) as usize];
        let row = |y: u32| value(0, y) + share.x * (value(1, y) - value(0, y));
        row(0) + share.y * (row(1) - row(0))
    }

    /// A map with at most [`MOST_SQUARES`] squares along an edge, each sample of which is the mean around its place.
    fn averaged(&self) -> Self {
        let before = (self.size - 1).as_vec2();
        let size = (before * (MOST_SQUARES as f32 / before.max_element())).round().as_uvec2().max(UVec2::ONE) + 1;
        let step = before / (size - 1).as_vec2();
        let taps = step.ceil().as_uvec2().max(UVec2::ONE);
        let mut values = Vec::with_capacity(size.x as usize * size.y as usize);
        for y in 0..size.y {
            for x in 0..size.x {
                let mut sum = 0f64;
                for tap_y in 0..taps.y {
                    for tap_x in 0..taps.x {
                        let off = (uvec2(tap_x, tap_y).as_vec2() + 0.5) / taps.as_vec2() - 0.5;
                        sum += f64::from(self.between((uvec2(x, y).as_vec2() + off) * step));
                    }
                }
                values.push((sum / (f64::from(taps.x) * f64::from(taps.y))) as f32);
            }
        }
        Self { size, values, metres: self.metres }
    }
}

/// Adds a terrain to a scene as its last node. The top of the picture lies at −Z, its left edge at −X.
///
/// # Errors
/// `Input` for a map with less than two rows or columns, or without a value for each sample; `Usage` for numbers out of range, heights that are too
/// large, and if the error needs more vertices than `limits` allow; `OutOfMemory` if there is no room for the grid.
pub fn add(scene: &mut Scene, map: &HeightMap, terrain: &Terrain, limits: &Limits) -> Result<()> {
    terrain.check()?;
    map.check()?;
    let edges = (map.size - 1).as_vec2();
    let size = terrain.width * edges / edges.max_element();
    let averaged = (map.size.max_element() - 1 > MOST_SQUARES).then(|| map.averaged());
    if let Some(averaged) = &averaged {
        let text = format!(
            "{} × {} samples are averaged to {} × {}; the error is that against the averages",
            map.size.x, map.size.y, averaged.size.x, averaged.size.y
        );
        scene.notes.push(Note { kind: NoteKind::Approximated, place: NAME.into(), text });
    }
    let grid = Grid::of(averaged.as_ref().unwrap_or(map), terrain.height)?;
    let mut primitive = grid.triangles(terrain, size, limits)?;
    let reach = primitive.positions.iter().map(|place| place.abs().max_element()).fold(0.0, f32::max);
    if reach > extent::FARTHEST {
        return Err(too_far(reach));
    }
    primitive.material = scene.materials.len() as u32;
    scene.materials.push(Material::diffuse(NAME, GRASS));
    let mesh = scene.meshes.len() as u32;
    scene.meshes.push(Mesh { name: NAME.into(), primitives: vec![primitive], ..Mesh::default() });
    scene.nodes.push(Node { name: NAME.into(), mesh: Some(mesh), ..Node::default() });
    Ok(())
}

fn too_far(reach: f32) -> Error {
    let what =
        format!("a terrain reaches {reach:e} m, which is too far from the origin; {:e} m is allowed", extent::FARTHEST);
    Error::usage(what).help("Give a smaller height, width or place")
}

/// The samples of a map on a square grid whose edge is a power of two, and the error of each middle. Beyond the map its last samples go on; triangles
/// that reach across its rim are always halved, and those beyond are left out.
struct Grid {
    /// Squares along an edge.
    squares: u32,
    /// Column and row of the map's last sample.
    last: UVec2,
    /// Metres over the value 0.
    heights: Vec<f32>,
    /// Bound of the error of the triangles that the vertex halves, metres.
    errors: Vec<f32>,
}

impl Grid {
    fn of(map: &HeightMap, height: f32) -> Result<Self> {
        let last = map.size - 1;
        let squares = last.max_element().next_power_of_two();
        let line = squares as usize + 1;
        let room = |list: &mut Vec<f32>| {
            let full = |error| Error::new(ErrorKind::OutOfMemory, "no room for the grid of a terrain").caused_by(error);
            list.try_reserve_exact(line * line).map_err(full)
        };
        let (mut heights, mut errors) = (Vec::new(), Vec::new());
        room(&mut heights)?;
        room(&mut errors)?;
        for y in 0..=squares {
            let row = &map.values[(y.min(last.y) * map.size.x) as usize..][..map.size.x as usize];
            heights.extend((0..=squares).map(|x| height * row[x.min(last.x) as usize]));
        }
        // A difference of infinite heights is no number, which the errors would not tell.
        if let Some(far) = heights.iter().find(|height| !height.is_finite() || height.abs() > extent::FARTHEST) {
            return Err(too_far(*far));
        }
        errors.resize(line * line, 0.0);
        let mut grid = Self { squares, last, heights, errors };
        grid.find_errors();
        Ok(grid)
    }

    fn index(&self, at: UVec2) -> usize {
        at.y as usize * (self.squares as usize + 1) + at.x as usize
    }

    fn height(&self, at: UVec2) -> f32 {
        self.heights[self.index(at)]
    }

    /// Finds the errors from the smallest triangles to the largest ones. `step` is half the edge of a square.
    fn find_errors(&mut self) {
        let mut step = 1;
        while step < self.squares {
            self.find_edges(step);
            self.find_middles(step);
            step *= 2;
        }
    }

    /// Middles of sides along an axis, of twice the step.
    fn find_edges(&mut self, step: u32) {
        let half = step / 2;
        for y in (0..=self.squares).step_by(step as usize) {
            // Where the row is an odd multiple of the step, sides run along Y.
            let along = if (y / step).is_multiple_of(2) { uvec2(step, 0) } else { uvec2(0, step) };
            let first = if along.x > 0 { step } else { 0 };
            for x in (first..=self.squares).step_by(2 * step as usize) {
                let at = uvec2(x, y);
                let own = self.own(at, step, at - along, at + along);
                let mut below = 0f32;
                if half > 0 {
                    // The middles of the four squares that meet the side at its middle.
                    for (dx, dy) in [(-1, -1), (1, -1), (-1, 1), (1, 1)] {
                        below = below.max(self.error_beside(at, dx * half as i32, dy * half as i32));
                    }
                }
                let index = self.index(at);
                self.errors[index] = own + below;
            }
        }
    }

    /// Middles of squares, whose diagonals are the longest sides.
    fn find_middles(&mut self, step: u32) {
        for y in (step..self.squares).step_by(2 * step as usize) {
            for x in (step..self.squares).step_by(2 * step as usize) {
                let at = uvec2(x, y);
                let end = self.diagonal(at, step);
                let own = self.own(at, step, end, at + at - end);
                let mut below = 0f32;
                for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
                    below = below.max(self.error_beside(at, dx * step as i32, dy * step as i32));
                }
                let index = self.index(at);
                self.errors[index] = own + below;
            }
        }
    }

    /// One end of the diagonal that halves the square around `at`: the middle of the square that is twice as large.
    fn diagonal(&self, at: UVec2, step: u32) -> UVec2 {
        if 2 * step == self.squares {
            return UVec2::ZERO;
        }
        let odd = |low: u32| if (low / (2 * step)).is_multiple_of(2) { low + 2 * step } else { low };
        uvec2(odd(at.x - step), odd(at.y - step))
    }

    /// The change of the height at the middle of two ends, if it is a sample; infinite where triangles that reach so far from it cross the rim.
    fn own(&self, at: UVec2, reach: u32, a: UVec2, b: UVec2) -> f32 {
        // The two triangles beside a side along an axis meet at the side, which may lie on the rim.
        let crosses = |at: u32, last: u32, along: bool| {
            at.saturating_sub(reach) < last && last < at + reach && !(along && at == last)
        };
        if crosses(at.x, self.last.x, a.x == b.x) || crosses(at.y, self.last.y, a.y == b.y) {
            return f32::INFINITY;
        }
        if at.cmpgt(self.last).any() {
            return 0.0;
        }
        (self.height(at) - 0.5 * (self.height(a) + self.height(b))).abs()
    }

    fn error_beside(&self, at: UVec2, dx: i32, dy: i32) -> f32 {
        let beside = |from: u32, by: i32| from.checked_add_signed(by).filter(|to| *to <= self.squares);
        match (beside(at.x, dx), beside(at.y, dy)) {
            (Some(x), Some(y)) => self.errors[self.index(uvec2(x, y))],
            _ => 0.0,
        }
    }

    /// The triangles in world space.
    fn triangles(&self, terrain: &Terrain, size: Vec2, limits: &Limits) -> Result<Primitive> {
        let far = UVec2::splat(self.squares);
        let mut numbers = vec![u32::MAX; self.heights.len()];
        let (mut used, mut indices) = (Vec::new(), Vec::<u32>::new());
        // Two triangles: ends of the longest side, and the right angle. Seen from above, with X to the right and Z down, they turn counter-clockwise.
        let mut left = vec![(UVec2::ZERO, far, uvec2(0, self.squares)), (far, UVec2::ZERO, uvec2(self.squares, 0))];
        while let Some((a, b, right)) = left.pop() {
            let middle = (a + b) / 2;
            let on_grid = (a + b) % 2 == UVec2::ZERO;
            if on_grid && self.errors[self.index(middle)] > terrain.error {
                left.extend([(right, a, middle), (b, right, middle)]);
                continue;
            }
            if [a, right, b].iter().any(|corner| corner.cmpgt(self.last).any()) {
                continue;
            }
            for corner in [a, right, b] {
                let index = self.index(corner);
                if numbers[index] == u32::MAX {
                    numbers[index] = used.len() as u32;
                    used.push(corner);
                }
                indices.push(numbers[index]);
            }
            if indices.len() as u64 > limits.max_vertices {
                let what = format!("an error of {} m takes more than {} indices", terrain.error, limits.max_vertices);
                return Err(Error::usage(what).help("Allow a larger error"));
            }
        }
        let count = used.len();
        let mut out = Primitive { indices, tangents: vec![Vec4::ZERO; count], ..Primitive::default() };
        let mut uvs = Vec::with_capacity(count);
        for at in used {
            let uv = at.as_vec2() / self.last.as_vec2();
            let flat = (uv - 0.5) * size;
            out.positions.push(terrain.middle + Vec3::new(flat.x, self.height(at), flat.y));
            out.normals.push(self.normal(at, size));
            uvs.push(uv);
        }
        out.uvs = vec![uvs];
        Ok(out)
    }

    /// The normal by the differences between the neighbours on the grid.
    fn normal(&self, at: UVec2, size: Vec2) -> Vec3 {
        let (low, high) = (at.saturating_sub(UVec2::ONE), (at + 1).min(self.last));
        let step = (high - low).as_vec2() * size / self.last.as_vec2();
        let slope_x = (self.height(uvec2(high.x, at.y)) - self.height(uvec2(low.x, at.y))) / step.x;
        let slope_z = (self.height(uvec2(at.x, high.y)) - self.height(uvec2(at.x, low.y))) / step.y;
        Vec3::new(-slope_x, 1.0, -slope_z).normalize()
    }
}

#[cfg(test)]
mod tests;
