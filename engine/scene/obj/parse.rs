//! OBJ text to lists of attributes and triangles.

use super::polygon;
use crate::{
    Error, Result,
    scene::{budget::Budget, folder::shorten},
};
use glam::{Vec2, Vec3, Vec4};
use std::collections::{BTreeMap, HashMap};

/// Stands for an attribute that a corner does not have.
pub const NONE: u32 = u32::MAX;

/// Indices of a corner's attributes, from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Corner {
    pub position: u32,
    pub uv: u32,
    pub normal: u32,
}

/// Triangles of one group or object with one material.
#[derive(Debug, Default)]
pub struct Part {
    /// Name of the group or object; parts with the same number belong together.
    pub name: String,
    pub group: usize,
    /// Index into [`Obj::materials`].
    pub material: Option<usize>,
    /// Three a triangle.
    pub corners: Vec<Corner>,
}

/// The content of an OBJ file.
#[derive(Debug, Default)]
pub struct Obj {
    pub positions: Vec<Vec3>,
    /// Linear RGBA; empty if no vertex has a colour.
    pub colors: Vec<Vec4>,
    pub uvs: Vec<Vec2>,
    pub normals: Vec<Vec3>,
    pub parts: Vec<Part>,
    /// Names in the order of their first use.
    pub materials: Vec<String>,
    /// Names of material files, and the lines that name them.
    pub libraries: Vec<(String, usize)>,
    /// Elements that are not triangles, by keyword.
    pub skipped: BTreeMap<String, usize>,
}

/// Reads OBJ text. `budget` bounds what it may become.
pub fn parse(text: &str, budget: &Budget) -> Result<Obj> {
    let mut reader =
        Reader { obj: Obj::default(), material_of: HashMap::new(), part: Part::default(), groups: 0, budget };
    let mut joined = String::new();
    let mut lines = 0;
    for line in text.split('\n') {
        lines += 1;
        let line = without_comment(line);
        // A backslash at the end continues the line.
        if let Some(begin) = line.strip_suffix('\\') {
            joined.push_str(begin);
            joined.push(' ');
            continue;
        }
        let whole;
        let line = match joined.is_empty() {
            true => line,
            false => {
                joined.push_str(line);
                whole = std::mem::take(&mut joined);
                whole.trim()
            }
        };
        reader.line(line, lines).map_err(|error| error.at(format!("line {lines}")))?;
    }
    reader.line(joined.trim(), lines).map_err(|error| error.at(format!("line {lines}")))?;
    reader.close()?;
    Ok(reader.obj)
}

/// The line without a comment, which begins with `#` at its start or after a space.
pub fn without_comment(line: &str) -> &str {
    let comment = line.match_indices('#').find(|&(at, _)| line[..at].ends_with(char::is_whitespace) || at == 0);
    line[..comment.map_or(line.len(), |(at, _)| at)].trim()
}

struct Reader<'a> {
    obj: Obj,
    material_of: HashMap<String, usize>,
    part: Part,
    groups: usize,
    budget: &'a Budget,
}

impl Reader<'_> {
    fn line(&mut self, line: &str, number: usize) -> Result<()> {
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        match keyword {
            "" | "s" => Ok(()),
            "v" => self.vertex(rest),
            "vt" => {
                let (values, _) = numbers::<3>(rest, 1)?;
                // OBJ has v upwards, the scene model downwards.
                self.obj.uvs.push(Vec2::new(values[0], 1.0 - values[1]));
                self.budget.take(1, 8)
            }
            "vn" => {
                let (values, _) = numbers::<3>(rest, 3)?;
                self.obj.normals.push(Vec3::from(values));
                self.budget.take(1, 12)
            }
            "f" => self.face(rest),
            "g" | "o" => {
                self.close()?;
                self.groups += 1;
                self.part.name = rest.to_owned();
                Ok(())
            }
            "usemtl" => {
                self.close()?;
                self.budget.take(1, 2 * rest.len() as u64 + 256)?;
                let next = self.obj.materials.len();
                let index = *self.material_of.entry(rest.to_owned()).or_insert(next);
                if index == next {
                    self.obj.materials.push(rest.to_owned());
                }
                self.part.material = Some(index);
                Ok(())
            }
            "mtllib" => {
                self.budget.take(1, 2 * rest.len() as u64 + 64)?;
                self.obj.libraries.push((rest.to_owned(), number));
                Ok(())
            }
            "p" | "l" | "curv" | "curv2" | "surf" | "call" => {
                *self.obj.skipped.entry(keyword.to_owned()).or_default() += 1;
                Ok(())
            }
            // Statements of free-form surfaces and of display, and what programs add of their own.
            _ => Ok(()),
        }
    }

    fn vertex(&mut self, rest: &str) -> Result<()> {
        let (values, count) = numbers::<7>(rest, 3)?;
        let mut position = Vec3::new(values[0], values[1], values[2]);
        // x y z [w] [r g b]
        let (weight, color) = match count {
            4 | 5 => (values[3], None),
            6 => (1.0, Some([values[3], values[4], values[5]])),
            7 => (values[3], Some([values[4], values[5], values[6]])),
            _ => (1.0, None),
        };
        if weight != 1.0 {
            position /= weight;
            if !position.is_finite() {
                return Err(Error::input(format!("the weight {weight} puts the vertex at infinity")));
            }
        }
        self.budget.take(1, 28)?;
        self.budget.primitive(1, 0)?;
        let before = self.obj.positions.len();
        self.obj.positions.push(position);
        match color {
            Some([r, g, b]) => {
                self.obj.colors.resize(before, Vec4::ONE);
                self.obj.colors.push(Vec4::new(r, g, b, 1.0));
            }
            None if !self.obj.colors.is_empty() => self.obj.colors.push(Vec4::ONE),
            None => {}
        }
        Ok(())
    }

    fn face(&mut self, rest: &str) -> Result<()> {
        let mut corners = Vec::new();
        for word in rest.split_whitespace() {
            corners.push(self.corner(word)?);
        }
        if corners.len() < 3 {
            *self.obj.skipped.entry("f with fewer than 3 corners".to_owned()).or_default() += 1;
            return Ok(());
        }
        let triangles = corners.len() as u64 - 2;
        self.budget.primitive(0, 3 * triangles)?;
        // The corners, and the vertices, indices and table entries that they become.
        self.budget.take(3 * triangles, 100)?;
        let positions = &self.obj.positions;
        polygon::triangulate(&corners, |corner| positions[corner.position as usize], &mut self.part.corners);
        Ok(())
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&self, word: &str) -> Result<Corner> {
        let mut parts = word.split('/');
        let mut next = |count: usize, what: &str| index(parts.next().unwrap_or_default(), count, what, word);
        let corner = Corner {
            position: next(self.obj.positions.len(), "vertices")?,
            uv: next(self.obj.uvs.len(), "texture coordinates")?,
            normal: next(self.obj.normals.len(), "normals")?,
        };
        if corner.position == NONE || parts.next().is_some() {
            return Err(Error::input(format!("{:?} is no corner of a face", shorten(word))));
        }
        Ok(corner)
    }

    /// Ends the current part; the next one has the same group and material until told otherwise.
    fn close(&mut self) -> Result<()> {
        self.part.group = self.groups;
        if self.part.corners.is_empty() {
            return Ok(());
        }
        // A node, a mesh and a primitive.
        self.budget.take(1, 2048 + 3 * self.part.name.len() as u64)?;
        let next = Part { name: self.part.name.clone(), material: self.part.material, ..Part::default() };
        self.obj.parts.push(std::mem::replace(&mut self.part, next));
        Ok(())
    }
}

/// An index as it stands in the file: from 1, or from the end if negative. Empty: [`NONE`].
fn index(word: &str, count: usize, what: &str, corner: &str) -> Result<u32> {
    if word.is_empty() {
        return Ok(NONE);
    }
    let number: i64 =
        word.parse().map_err(|_| Error::input(format!("{:?} is no corner of a face", shorten(corner))))?;
    let index = if number < 0 { count as i64 + number } else { number - 1 };
    match u32::try_from(index) {
        Ok(index) if (index as usize) < count && index != NONE => Ok(index),
        _ => Err(Error::input(format!("index {number}, but there are {count} {what} so far"))
            .help("The file is not valid OBJ; export it again")),
    }
}

/// Up to `N` numbers, at least `least`, and how many there are. More are left alone.
pub fn numbers<const N: usize>(text: &str, least: usize) -> Result<([f32; N], usize)> {
    let mut out = [0.0; N];
    let mut count = 0;
    for (word, out) in text.split_whitespace().zip(&mut out) {
        *out = number(word)?;
        count += 1;
    }
    match count >= least {
        true => Ok((out, count)),
        false => Err(Error::input(format!("{count} numbers, {least} are needed"))),
    }
}

/// A finite number.
pub fn number(word: &str) -> Result<f32> {
    match word.parse::<f32>() {
        Ok(number) if number.is_finite() => Ok(number),
        Ok(number) => Err(Error::input(format!("{number} is not finite"))),
        Err(_) => Err(Error::input(format!("{:?} is no number", shorten(word)))),
    }
}
