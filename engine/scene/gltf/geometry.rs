//! Meshes: from accessors to triangle lists.

use super::{
    accessors::{Accessors, Format},
    types::{self, Attributes},
};
use crate::{
    Error, Result,
    scene::{MAX_UV_SETS, Material, Mesh, MorphTarget, Primitive, notes::Notes, surface::Repairs, tangents::Made},
};
use glam::{Vec2, Vec3, Vec4};

/// Sets of joints and weights that are read: eight influences a vertex.
const MAX_JOINT_SETS: usize = 2;

/// Reads the meshes of a file.
pub struct Meshes<'a> {
    pub accessors: &'a Accessors<'a>,
    /// The file's materials, then the default material.
    pub materials: &'a [Material],
    pub notes: &'a mut Notes,
}

impl Meshes<'_> {
    pub fn mesh(&mut self, index: usize) -> Result<Mesh> {
        let place = format!("meshes[{index}]");
        let source = &self.accessors.document.meshes[index];
        let targets = source.primitives.first().map_or(0, |primitive| primitive.targets.len());
        if source.primitives.is_empty() {
            return Err(Error::input("has no primitives").at(place));
        }
        let mut mesh =
            Mesh { name: source.name.clone().unwrap_or_default(), weights: source.weights.clone(), primitives: vec![] };
        if mesh.weights.is_empty() {
            mesh.weights = vec![0.0; targets];
        }
        if mesh.weights.len() != targets {
            return Err(Error::input(format!("{} weights for {targets} morph targets", mesh.weights.len()))
                .at("weights")
                .at(place));
        }
        if let Some(weight) = mesh.weights.iter().find(|weight| !weight.is_finite()) {
            return Err(Error::input(format!("{weight} is not finite")).at("weights").at(place));
        }
        for (i, primitive) in source.primitives.iter().enumerate() {
            let here = format!("{place}.primitives[{i}]");
            if primitive.targets.len() != targets {
                return Err(Error::input(format!(
                    "{} morph targets, the first primitive has {targets}",
                    primitive.targets.len()
                ))
                .at("targets")
                .at(here));
            }
            let primitive = self.primitive(primitive, &here).map_err(|error| error.at(&here))?;
            mesh.primitives.extend(primitive);
        }
        Ok(mesh)
    }

    fn primitive(&mut self, source: &types::Primitive, here: &str) -> Result<Option<Primitive>> {
        let material = match source.material {
            None => self.materials.len() - 1,
            Some(index) => {
                super::document::item(&self.accessors.document.materials, "materials", index)
                    .map_err(|error| error.at("material"))?;
                index as usize
            }
        };
        let attributes = &source.attributes;
        let count = self.vertex_count(attributes).map_err(|error| error.at("attributes"))?;
        let index_count = match source.indices {
            Some(indices) => self.accessors.count(indices).map_err(|error| error.at("indices"))?,
            None => count.unwrap_or(0),
        };
        match source.mode {
            0..=3 => {
                self.notes.ignored(here, "points and lines are not drawn");
                return Ok(None);
            }
            4..=6 => {}
            mode => return Err(Error::input(format!("{mode}, 0 to 6 are defined")).at("mode")),
        }
        let Some(count) = count else {
            self.notes.ignored(here, "has no positions");
            return Ok(None);
        };
        let corners = if source.mode == 4 { index_count } else { index_count.saturating_mul(3) };
        self.accessors.budget.primitive(count, corners)?;
        self.accessors.budget.take(corners, 4)?;

        let mut out = Primitive { material: material as u32, ..Primitive::default() };
        self.read_attributes(attributes, count, here, &mut out).map_err(|error| error.at("attributes"))?;
        for (i, target) in source.targets.iter().enumerate() {
            let morph = self.morph(target, attributes, count).map_err(|error| error.at(format!("targets[{i}]")))?;
            out.morphs.push(morph);
        }
        out.indices = self.indices(source, count, here).map_err(|error| error.at("indices"))?;
        self.finish(&mut out, &self.materials[material], here)?;
        Ok(Some(out))
    }

    /// Checks that all attributes have as many elements as the positions.
    fn vertex_count(&self, attributes: &Attributes) -> Result<Option<u64>> {
        let Some(&position) = attributes.get("POSITION") else {
            for (name, &accessor) in attributes {
                self.accessors.count(accessor).map_err(|error| error.at(name))?;
            }
            return Ok(None);
        };
        let count = self.accessors.count(position).map_err(|error| error.at("POSITION"))?;
        for (name, &accessor) in attributes {
            let other = self.accessors.count(accessor).map_err(|error| error.at(name))?;
            if other != count {
                return Err(Error::input(format!("{other} elements, POSITION has {count}")).at(name));
            }
        }
        Ok(Some(count))
    }

    fn read_attributes(&mut self, attributes: &Attributes, count: u64, here: &str, out: &mut Primitive) -> Result<()> {
        let accessors = self.accessors;
        let mut joints: Vec<(usize, Vec<[u16; 4]>)> = vec![];
        let mut weights: Vec<(usize, Vec<Vec4>)> = vec![];
        for (name, &index) in attributes {
            let at = |error: Error| error.at(name);
            match split_name(name) {
                ("POSITION", None) => out.positions = vec3s(accessors, index, Format::POINT).map_err(at)?,
                ("NORMAL", None) => out.normals = vec3s(accessors, index, Format::DIRECTION).map_err(at)?,
                ("TANGENT", None) => out.tangents = vec4s(accessors, index, Format::TANGENT).map_err(at)?,
                ("COLOR", Some(0)) => out.colors = vec4s(accessors, index, Format::COLOR).map_err(at)?,
                ("TEXCOORD", Some(set)) if set < MAX_UV_SETS => {
                    let uvs = accessors.floats::<2>(index, Format::UV).map_err(at)?;
                    put_set(&mut out.uvs, set, count, uvs.into_iter().map(Vec2::from).collect());
                }
                ("JOINTS", Some(set)) if set < MAX_JOINT_SETS => {
                    let (rows, _) = accessors.integers::<4>(index, Format::JOINTS).map_err(at)?;
                    joints.push((set, rows.into_iter().map(|row| row.map(|joint| joint as u16)).collect()));
                }
                ("WEIGHTS", Some(set)) if set < MAX_JOINT_SETS => {
                    weights.push((set, vec4s(accessors, index, Format::WEIGHTS).map_err(at)?));
                }
                _ if name.starts_with('_') => {}
                _ => self.notes.ignored(here, format!("attribute {name} is not read")),
            }
        }
        joints.sort_by_key(|(set, _)| *set);
        weights.sort_by_key(|(set, _)| *set);
        let sets = |n: usize, has: &dyn Fn(usize) -> Option<usize>| (0..n).all(|i| has(i) == Some(i));
        let paired = joints.len() == weights.len()
            && sets(joints.len(), &|i| joints.get(i).map(|j| j.0))
            && sets(weights.len(), &|i| weights.get(i).map(|w| w.0));
        if !paired {
            return Err(Error::input("JOINTS_n and WEIGHTS_n must come in pairs, counted from 0"));
        }
        out.joints = joints.into_iter().map(|(_, rows)| rows).collect();
        out.weights = weights.into_iter().map(|(_, rows)| rows).collect();
        let scaled = normalize_weights(out)?;
        if scaled > 0 {
            self.notes.repaired(here, format!("joint weights of {scaled} vertices scaled to a sum of one"));
        }
        Ok(())
    }

    fn morph(&mut self, target: &Attributes, base: &Attributes, count: u64) -> Result<MorphTarget> {
        let accessors = self.accessors;
        let mut out = MorphTarget::default();
        for (name, &index) in target {
            let at = |error: Error| error.at(name);
            let other = accessors.count(index).map_err(at)?;
            if other != count {
                return Err(Error::input(format!("{other} elements, POSITION has {count}")).at(name));
            }
            if !base.contains_key(name) && !name.starts_with('_') {
                return Err(Error::input("the primitive itself has no such attribute").at(name));
            }
            match split_name(name) {
                ("POSITION", None) => out.positions = vec3s(accessors, index, Format::POINT).map_err(at)?,
                ("NORMAL", None) => out.normals = vec3s(accessors, index, Format::DIRECTION).map_err(at)?,
                ("TANGENT", None) => out.tangents = vec3s(accessors, index, Format::DIRECTION).map_err(at)?,
                ("COLOR", Some(0)) => {
                    let mut colors = vec4s(accessors, index, Format::MORPH_COLOR).map_err(at)?;
                    if accessors.document.accessors[index as usize].kind == "VEC3" {
                        colors.iter_mut().for_each(|color| color.w = 0.0);
                    }
                    out.colors = colors;
                }
                ("TEXCOORD", Some(set)) if set < MAX_UV_SETS => {
                    let uvs = accessors.floats::<2>(index, Format::UV).map_err(at)?;
                    put_set(&mut out.uvs, set, count, uvs.into_iter().map(Vec2::from).collect());
                }
                _ if name.starts_with('_') => {}
                _ => self.notes.ignored("meshes.primitives.targets", format!("attribute {name} is not read")),
            }
        }
        Ok(out)
    }

    /// Corner indices of a triangle list.
    fn indices(&mut self, source: &types::Primitive, count: u64, here: &str) -> Result<Vec<u32>> {
        let order: Vec<u32> = match source.indices {
            None => (0..count as u32).collect(),
            Some(accessor) => {
                let (rows, restart) = self.accessors.integers::<1>(accessor, Format::INDICES)?;
                let bad = rows.iter().position(|&[index]| u64::from(index) >= count || index == restart);
                if let Some(at) = bad {
                    let index = rows[at][0];
                    let what = if index == restart { " (primitive restart, which glTF forbids)" } else { "" };
                    return Err(Error::input(format!(
                        "index {index}{what} (at {at}) but POSITION has {count} vertices"
                    ))
                    .help("The file is not valid glTF; re-export it or run glTF-Validator"));
                }
                rows.into_iter().map(|[index]| index).collect()
            }
        };
        if order.len() < 3 || (source.mode == 4 && !order.len().is_multiple_of(3)) {
            self.notes
                .ignored(here, format!("{} indices do not make whole triangles; the rest is left out", order.len()));
        }
        Ok(match source.mode {
            // A strip turns every second triangle around (glTF 2.0, section 3.7.2.1).
            5 => (2..order.len())
                .flat_map(|i| match i % 2 {
                    0 => [order[i - 2], order[i - 1], order[i]],
                    _ => [order[i - 2], order[i], order[i - 1]],
                })
                .collect(),
            6 => (2..order.len()).flat_map(|i| [order[i - 1], order[i], order[0]]).collect(),
            _ => {
                let mut order = order;
                order.truncate(order.len() / 3 * 3);
                order
            }
        })
    }

    /// Supplies what is missing: normals, tangents where the material has a normal map, uv sets that its textures use.
    fn finish(&mut self, primitive: &mut Primitive, material: &Material, here: &str) -> Result<()> {
        let mut repairs = Repairs { degenerate_triangles: primitive.drop_degenerate_triangles(), ..Repairs::default() };
        let corners = primitive.indices.len() as u64;
        if primitive.normals.is_empty() {
            self.accessors.budget.take(corners, primitive.vertex_size())?;
            self.accessors.budget.primitive(corners.saturating_sub(primitive.positions.len() as u64), 0)?;
            primitive.tangents.clear();
            primitive.make_flat();
        } else {
            repairs.bad_normals = primitive.repair_normals();
        }
        for (what, count) in [
            ("triangles without area dropped", repairs.degenerate_triangles),
            ("zero normals recomputed", repairs.bad_normals),
        ] {
            if count > 0 {
                self.notes.repaired(here, format!("{count} {what}"));
            }
        }
        for texture in material.textures() {
            let set = texture.uv_set as usize;
            if primitive.uvs.get(set).is_none_or(|uvs| uvs.is_empty()) {
                let count = primitive.positions.len();
                self.accessors.budget.take(count as u64, 8)?;
                put_set(&mut primitive.uvs, set, count as u64, vec![Vec2::ZERO; count]);
                self.notes.repaired(here, format!("has no TEXCOORD_{set}, which its material uses; zeros stand in"));
            }
        }
        match &material.normal_texture {
            None => primitive.tangents = vec![Vec4::ZERO; primitive.positions.len()],
            Some(_) if !primitive.tangents.is_empty() => primitive.repair_tangents(),
            Some(texture) => {
                // Corners with their tangents, the table that finds equal ones, and the split vertices.
                self.accessors.budget.take(corners, 200 + primitive.vertex_size())?;
                let before = primitive.positions.len();
                if primitive.make_tangents(texture.uv_set as usize) == Made::Mean {
                    self.notes
                        .approximated(here, "tangents are means instead of MikkTSpace: the mesh is too irregular");
                }
                let more = primitive.positions.len().saturating_sub(before);
                self.accessors.budget.primitive(more as u64, 0)?;
            }
        }
        Ok(())
    }
}

/// `TEXCOORD_1` → (`TEXCOORD`, 1).
fn split_name(name: &str) -> (&str, Option<usize>) {
    let numbered = name.split_once('_').and_then(|(semantic, set)| {
        let number: usize = set.parse().ok()?;
        // No sign, no leading zeros.
        (number.to_string() == set).then_some((semantic, Some(number)))
    });
    numbered.unwrap_or((name, None))
}

/// Puts a uv set into its place; sets that are left out before it are zero.
fn put_set(sets: &mut Vec<Vec<Vec2>>, set: usize, count: u64, uvs: Vec<Vec2>) {
    while sets.len() <= set {
        sets.push(vec![Vec2::ZERO; count as usize]);
    }
    sets[set] = uvs;
}

fn vec3s(accessors: &Accessors, index: u32, format: Format) -> Result<Vec<Vec3>> {
    Ok(accessors.floats::<3>(index, format)?.into_iter().map(Vec3::from).collect())
}

fn vec4s(accessors: &Accessors, index: u32, format: Format) -> Result<Vec<Vec4>> {
    Ok(accessors.floats::<4>(index, format)?.into_iter().map(Vec4::from).collect())
}

/// Makes the weights of each vertex sum to one, and says of how many vertices they did not. A vertex without weights
/// follows its first joint.
fn normalize_weights(primitive: &mut Primitive) -> Result<usize> {
    let Some(count) = primitive.weights.first().map(Vec::len) else { return Ok(0) };
    let mut scaled = 0;
    for i in 0..count {
        let weights = primitive.weights.iter().flat_map(|set| set[i].to_array());
        if let Some(weight) = weights.clone().find(|&weight| weight < 0.0) {
            return Err(Error::input(format!("weight {weight} of vertex {i} is negative")).at("WEIGHTS_0"));
        }
        let sum: f64 = weights.map(f64::from).sum();
        // Eight-bit weights cannot do better than half a step each.
        scaled += usize::from((sum - 1.0).abs() > 4.0 * 0.5 / 255.0);
        for (set, rows) in primitive.weights.iter_mut().enumerate() {
            rows[i] = match sum > 0.0 {
                true => Vec4::from_array(rows[i].to_array().map(|weight| (f64::from(weight) / sum) as f32)),
                false if set == 0 => Vec4::X,
                false => Vec4::ZERO,
            };
        }
    }
    Ok(scaled)
}
