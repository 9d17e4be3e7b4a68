//! A lightmap atlas for any triangle scene.
//!
//! [`build`] cuts every mesh into charts, scales the charts to the wanted texel density and packs them into one
//! atlas. [`texels`] lists the texels that the charts cover, and [`padding_sources`] lists the texels around them that
//! bilinear filtering reads. The result depends on the input only: the module uses one thread, no clock and no hash
//! order.

mod chart;
mod connected;
mod dilate;
mod groups;
mod layout;
mod pack;
mod place;
mod raster;
mod surface;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_scenes;
mod uv2;

use std::collections::BTreeMap;

use glam::{DMat3, Mat4, Vec2, Vec3};

pub use connected::connected;
pub use dilate::padding_sources;
pub use raster::{Texel, texels};
pub(super) use raster::{spread, touched_by};

use layout::Layout;
use surface::Surface;

/// A triangle mesh.
#[derive(Clone, Copy, Debug)]
pub struct MeshInput<'a> {
    /// The vertex positions in object space.
    pub positions: &'a [Vec3],
    /// The vertices of every triangle.
    pub triangles: &'a [[u32; 3]],
    /// The second texture coordinates, one for every vertex.
    pub uv2: Option<&'a [Vec2]>,
}

/// A mesh in the scene.
#[derive(Clone, Copy, Debug)]
pub struct Instance<'a> {
    /// The index of the mesh.
    pub mesh: usize,
    /// The map from object space to world space in metres. It may mirror and scale.
    pub world_from_object: Mat4,
    /// Whether each triangle needs texels; `None`: all do. Charts without such a triangle are left out.
    pub wanted: Option<&'a [bool]>,
}

/// The wishes of the caller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The texels along one metre of a surface.
    pub texels_per_metre: f32,
    /// The largest width and height of the atlas in texels.
    pub max_size: u32,
    /// The least number of free texels between two charts, and between a chart and the border. At least 2.
    pub padding: u32,
    /// The time in seconds that one mesh may take in the unwrap library.
    ///
    /// A fixed rule turns the time into a number of triangles, so that the clock never changes the result. A mesh with
    /// more curved triangles takes projections.
    pub unwrap_seconds_per_mesh: f64,
    /// Charts start at multiples of this number of texels.
    pub block: u32,
    /// Whether a valid uv2 gives the charts of a mesh.
    pub use_uv2: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            texels_per_metre: 16.0,
            max_size: 4096,
            padding: 4,
            unwrap_seconds_per_mesh: 20.0,
            block: 4,
            use_uv2: true,
        }
    }
}

/// The lightmap coordinates of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Atlas {
    /// The width in texels, a multiple of 4.
    pub width: u32,
    /// The height in texels, a multiple of 4.
    pub height: u32,
    /// The corners of every triangle in texels: all triangles of instance 0, then of instance 1, and so on.
    ///
    /// The centre of the first texel is (0.5, 0.5). Triangles of a chart that was left out have infinite corners.
    pub corners: Vec<[Vec2; 3]>,
    /// The chart of every triangle, in the order of the corners; `u32::MAX`: it was left out.
    pub triangle_charts: Vec<u32>,
    /// The number of charts.
    pub charts: u32,
    /// Complete sentences about every mesh that took a fallback.
    pub notes: Vec<String>,
}

/// Builds the lightmap atlas of a scene.
///
/// # Errors
///
/// It fails if the input is empty or not finite, if an index is out of range, or if the charts do not fit into
/// `settings.max_size`. The last error names the texel density that fits.
pub fn build(meshes: &[MeshInput], instances: &[Instance<'_>], settings: &Settings) -> Result<Atlas, String> {
    check_settings(settings)?;
    for (index, mesh) in meshes.iter().enumerate() {
        check_mesh(index, mesh)?;
    }
    check_instances(meshes, instances)?;
    let mut notes = Vec::new();
    let mut variants: BTreeMap<(usize, [i64; 6]), usize> = BTreeMap::new();
    let mut layouts: Vec<Layout> = Vec::new();
    let mut placed = Vec::with_capacity(instances.len());
    for instance in instances {
        let (scale, shape, key) = scale_and_shape(instance.world_from_object);
        let mesh = &meshes[instance.mesh];
        let layout = *variants.entry((instance.mesh, key)).or_insert_with(|| {
            let stretched = if key == [0; 6] { "" } else { " (stretched by an instance)" };
            let source = layout::Source {
                triangles: mesh.triangles,
                vertices: mesh.positions.len(),
                uv2: mesh.uv2.filter(|_| settings.use_uv2),
                budget: layout::triangle_budget(settings.unwrap_seconds_per_mesh),
                name: format!("Mesh {}{stretched}", instance.mesh),
            };
            let surface = Surface::new(mesh.positions, mesh.triangles, shape);
            layouts.push(layout::layout(&surface, &source, &mut notes));
            layouts.len() - 1
        });
        placed.push(place::Placed { layout, scale, triangles: mesh.triangles.len(), wanted: instance.wanted });
    }
    place::place(&layouts, &placed, settings, notes)
}

/// Checks the settings.
fn check_settings(settings: &Settings) -> Result<(), String> {
    let Settings { texels_per_metre, max_size, padding, unwrap_seconds_per_mesh: seconds, block, .. } = *settings;
    if !(texels_per_metre.is_finite() && texels_per_metre > 0.0) {
        return Err(format!(
            "The lightmap density is {texels_per_metre} texels per metre, but it must be finite and above 0. Set \
             texels_per_metre to a value such as 16."
        ));
    }
    if !(2..=64).contains(&padding) {
        return Err(format!(
            "The lightmap padding is {padding} texels, but bilinear filtering needs 2 to 64. Set padding to a value \
             such as 4."
        ));
    }
    if !(1..=64).contains(&block) {
        return Err(format!(
            "The lightmap block is {block} texels, but it must be from 1 to 64. Set block to a value such as 4."
        ));
    }
    if !(16..=32_768).contains(&max_size) {
        return Err(format!(
            "The largest lightmap size is {max_size} texels, but it must be from 16 to 32768. Set max_size to a value \
             such as 4096."
        ));
    }
    if !(seconds.is_finite() && seconds >= 0.0) {
        return Err(format!(
            "The unwrap time is {seconds} seconds, but it must be finite and not negative. Set unwrap_seconds_per_mesh \
             to a value such as 20."
        ));
    }
    Ok(())
}

/// Checks one mesh.
fn check_mesh(index: usize, mesh: &MeshInput) -> Result<(), String> {
    if let Some(vertex) = mesh.positions.iter().position(|p| !p.is_finite()) {
        return Err(format!(
            "Mesh {index} has the position {} at vertex {vertex}, but a lightmap needs finite positions. Repair or \
             remove this vertex.",
            mesh.positions[vertex]
        ));
    }
    let count = mesh.positions.len();
    if let Some(bad) = mesh.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= count)) {
        return Err(format!(
            "Mesh {index} has the vertices {:?} in triangle {bad}, but it has only {count} positions. Repair the \
             triangle list.",
            mesh.triangles[bad]
        ));
    }
    Ok(())
}

/// Checks all instances and the total number of triangles.
fn check_instances(meshes: &[MeshInput], instances: &[Instance<'_>]) -> Result<(), String> {
    let mut total = 0_u64;
    for (index, instance) in instances.iter().enumerate() {
        let Some(mesh) = meshes.get(instance.mesh) else {
            return Err(format!(
                "Instance {index} uses mesh {}, but the scene has {} meshes. Give an existing mesh.",
                instance.mesh,
                meshes.len()
            ));
        };
        if !instance.world_from_object.is_finite() {
            return Err(format!(
                "Instance {index} has a transform that is not finite, but a lightmap needs a finite one. Repair the \
                 transform."
            ));
        }
        if let Some(wanted) = instance.wanted
            && wanted.len() != mesh.triangles.len()
        {
            return Err(format!(
                "Instance {index} chooses among {} triangles, but its mesh has {}. Say for each triangle whether it \
                 needs texels.",
                wanted.len(),
                mesh.triangles.len()
            ));
        }
        total += mesh.triangles.len() as u64;
    }
    if total == 0 {
        return Err(format!(
            "The scene has no triangles in {} instances, but a lightmap needs at least one. Add a mesh and an \
             instance.",
            instances.len()
        ));
    }
    if total >= u64::from(u32::MAX) {
        return Err(format!(
            "The scene has {total} triangles in all instances, but a lightmap allows fewer than {}. Remove instances.",
            u32::MAX
        ));
    }
    Ok(())
}

/// Splits a transform into its mean scale and its shape, and gives a key that equal shapes share.
///
/// The key of a uniform scale is zero, and its shape is the identity. A stretched instance needs charts of its own,
/// because its charts have other proportions.
fn scale_and_shape(world_from_object: Mat4) -> (f64, DMat3, [i64; 6]) {
    let linear = DMat3::from_mat4(world_from_object.as_dmat4());
    let gram = linear.transpose() * linear;
    let square = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    let scale = square.sqrt();
    if scale.is_nan() || scale < 1.0e-30 {
        return (1.0, DMat3::ZERO, [i64::MAX; 6]);
    }
    let relative = gram * square.recip();
    let entries = [
        relative.x_axis.x,
        relative.y_axis.y,
        relative.z_axis.z,
        relative.x_axis.y,
        relative.x_axis.z,
        relative.y_axis.z,
    ];
    let uniform = entries.iter().zip([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]).all(|(entry, want)| (entry - want).abs() < 0.01);
    if uniform {
        return (scale, DMat3::IDENTITY, [0; 6]);
    }
    (scale, linear * scale.recip(), entries.map(|entry| (entry * 4096.0).round() as i64))
}
