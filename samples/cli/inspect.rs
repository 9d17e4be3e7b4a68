//! `lucerna inspect`: the contents of a scene.

use std::fmt::Write;

use glam::{Mat4, Vec3};
use lucerna::scene::{Aabb, AlphaMode, LightKind, Material, Node, Note, Pose, Projection, Scene};
use serde::Serialize;

use crate::scene_bounds;

/// Nodes that the text lists at most.
const NODES: usize = 100;

/// The summary of a scene; its fields are those of the JSON output.
#[derive(Debug, Serialize)]
pub struct Summary {
    pub scene: String,
    pub counts: Counts,
    /// World space, metres, rest pose.
    pub bounds: Option<Bounds>,
    pub memory: Memory,
    pub cameras: Vec<CameraInfo>,
    pub lights: Vec<LightInfo>,
    pub nodes: Vec<NodeInfo>,
    pub materials: Vec<MaterialInfo>,
    pub textures: Vec<TextureInfo>,
    pub animations: Vec<AnimationInfo>,
    pub environment: Option<TextureInfo>,
    /// Notes about unsupported, approximated and repaired parts.
    pub notes: Vec<Note>,
}

#[derive(Debug, Serialize)]
pub struct Bounds {
    pub min: Vec3,
    pub max: Vec3,
}

#[derive(Debug, Serialize)]
pub struct Counts {
    pub nodes: usize,
    pub meshes: usize,
    pub primitives: usize,
    /// Triangles of all meshes, each counted once.
    pub triangles: usize,
    /// Triangles of all instances.
    pub triangles_drawn: usize,
    pub vertices: usize,
    pub morph_targets: usize,
    pub skins: usize,
    pub joints: usize,
}

/// Approximate memory on the device, bytes.
#[derive(Debug, Serialize)]
pub struct Memory {
    pub geometry: u64,
    /// With mip levels.
    pub textures: u64,
}

#[derive(Debug, Serialize)]
pub struct CameraInfo {
    pub index: usize,
    pub name: String,
    pub kind: &'static str,
    /// Full vertical angle, degrees.
    pub yfov_degrees: Option<f32>,
    pub znear: f32,
    pub zfar: Option<f32>,
    pub position: Option<Vec3>,
    pub forward: Option<Vec3>,
}

#[derive(Debug, Serialize)]
pub struct LightInfo {
    pub name: String,
    pub kind: &'static str,
    pub color: Vec3,
    /// W/sr, or W/m² for directional lights.
    pub intensity: f32,
    pub range: Option<f32>,
    pub cone_degrees: Option<[f32; 2]>,
    pub position: Option<Vec3>,
    pub direction: Option<Vec3>,
}

#[derive(Debug, Serialize)]
pub struct NodeInfo {
    pub name: String,
    /// Number of the node above.
    pub parent: Option<u32>,
    /// Name of the mesh.
    pub mesh: Option<String>,
}

#[derive(Debug, Serialize)]
pub struct MaterialInfo {
    pub name: String,
    pub base_color: [f32; 4],
    pub metallic: f32,
    pub roughness: f32,
    pub emissive: Vec3,
    pub alpha: &'static str,
    /// Names of the texture slots in use.
    pub textures: Vec<&'static str>,
    /// `double-sided`, `unlit`, `mirror`, `transmission`.
    pub flags: Vec<&'static str>,
}

#[derive(Debug, Serialize)]
pub struct TextureInfo {
    pub name: String,
    pub width: u32,
    pub height: u32,
}

#[derive(Debug, Serialize)]
pub struct AnimationInfo {
    pub name: String,
    pub channels: usize,
    pub seconds: f32,
}

/// Summarises a scene.
pub fn summary(scene: &Scene) -> Summary {
    let pose = Pose::rest(scene);
    let world = &pose.world;
    let place = |index: usize, of: fn(&lucerna::scene::Node) -> Option<u32>| {
        let found = scene.nodes.iter().position(|node| of(node) == Some(index as u32))?;
        world.get(found).copied()
    };
    Summary {
        scene: scene.name.clone(),
        counts: counts(scene),
        bounds: scene_bounds::in_pose(scene, &pose).map(|Aabb { min, max }| Bounds { min, max }),
        memory: memory(scene),
        cameras: (0..scene.cameras.len()).map(|i| camera(scene, i, place(i, |node| node.camera))).collect(),
        lights: lights(scene, world),
        nodes: scene.nodes.iter().map(|n| node(scene, n)).collect(),
        materials: scene.materials.iter().map(material).collect(),
        textures: scene
            .textures
            .iter()
            .map(|t| TextureInfo { name: t.name.clone(), width: t.width, height: t.height })
            .collect(),
        animations: scene
            .animations
            .iter()
            .map(|a| AnimationInfo { name: a.name.clone(), channels: a.channels.len(), seconds: a.duration() })
            .collect(),
        environment: scene.environment.as_ref().map(|e| TextureInfo {
            name: e.name.clone(),
            width: e.width,
            height: e.height,
        }),
        notes: scene.notes.clone(),
    }
}

fn counts(scene: &Scene) -> Counts {
    let triangles = |mesh: &lucerna::scene::Mesh| mesh.primitives.iter().map(|p| p.indices.len() / 3).sum::<usize>();
    let primitives = || scene.meshes.iter().flat_map(|mesh| &mesh.primitives);
    Counts {
        nodes: scene.nodes.len(),
        meshes: scene.meshes.len(),
        primitives: primitives().count(),
        triangles: scene.meshes.iter().map(triangles).sum(),
        triangles_drawn: scene
            .nodes
            .iter()
            .filter_map(|node| scene.meshes.get(node.mesh? as usize))
            .map(triangles)
            .sum(),
        vertices: primitives().map(|p| p.positions.len()).sum(),
        morph_targets: primitives().map(|p| p.morphs.len()).sum(),
        skins: scene.skins.len(),
        joints: scene.skins.iter().map(|skin| skin.joints.len()).sum(),
    }
}

fn memory(scene: &Scene) -> Memory {
    let mut geometry = 0;
    for p in scene.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        let vertex = 12 + 12 + 16 + 8 * p.uvs.len() + 16 * usize::from(!p.colors.is_empty()) + 24 * p.joints.len();
        let morphs: usize = p
            .morphs
            .iter()
            .map(|m| 12 * (m.positions.len() + m.normals.len() + m.tangents.len()) + 16 * m.colors.len())
            .sum();
        geometry += p.positions.len() * vertex + p.indices.len() * 4 + morphs;
    }
    let texels: u64 = scene.textures.iter().map(|t| u64::from(t.width) * u64::from(t.height)).sum();
    Memory { geometry: geometry as u64, textures: texels * 4 * 4 / 3 }
}

fn camera(scene: &Scene, index: usize, world: Option<Mat4>) -> CameraInfo {
    let camera = &scene.cameras[index];
    let (kind, yfov, znear, zfar) = match camera.projection {
        Projection::Perspective { yfov, znear, zfar, .. } => ("perspective", Some(yfov.to_degrees()), znear, zfar),
        Projection::Orthographic { znear, zfar, .. } => ("orthographic", None, znear, Some(zfar)),
    };
    CameraInfo {
        index,
        name: camera.name.clone(),
        kind,
        yfov_degrees: yfov,
        znear,
        zfar,
        position: world.map(position),
        forward: world.map(forward),
    }
}

fn lights(scene: &Scene, world: &[Mat4]) -> Vec<LightInfo> {
    let mut list = Vec::new();
    for (node, matrix) in scene.nodes.iter().zip(world) {
        let Some(light) = node.light.and_then(|light| scene.lights.get(light as usize)) else { continue };
        let (kind, range, cone) = match light.kind {
            LightKind::Directional => ("directional", None, None),
            LightKind::Point { range } => ("point", range, None),
            LightKind::Spot { range, inner, outer } => ("spot", range, Some([inner.to_degrees(), outer.to_degrees()])),
        };
        list.push(LightInfo {
            name: if light.name.is_empty() { node.name.clone() } else { light.name.clone() },
            kind,
            color: light.color,
            intensity: light.intensity,
            range,
            cone_degrees: cone,
            position: (kind != "directional").then(|| position(*matrix)),
            direction: (kind != "point").then(|| forward(*matrix)),
        });
    }
    list
}

fn node(scene: &Scene, node: &Node) -> NodeInfo {
    let mesh = node.mesh.and_then(|mesh| scene.meshes.get(mesh as usize));
    NodeInfo { name: node.name.clone(), parent: node.parent, mesh: mesh.map(|mesh| mesh.name.clone()) }
}

fn position(world: Mat4) -> Vec3 {
    world.w_axis.truncate()
}

fn forward(world: Mat4) -> Vec3 {
    world.transform_vector3(Vec3::NEG_Z).normalize_or_zero()
}

fn material(material: &Material) -> MaterialInfo {
    let named = |list: &[(&'static str, bool)]| list.iter().filter(|(_, on)| *on).map(|(name, _)| *name).collect();
    MaterialInfo {
        name: material.name.clone(),
        base_color: material.base_color.to_array(),
        metallic: material.metallic,
        roughness: material.roughness,
        emissive: material.emissive,
        alpha: match material.alpha {
            AlphaMode::Opaque => "opaque",
            AlphaMode::Mask { .. } => "mask",
            AlphaMode::Blend => "blend",
        },
        textures: named(&[
            ("base-color", material.base_color_texture.is_some()),
            ("metallic-roughness", material.metallic_roughness_texture.is_some()),
            ("normal", material.normal_texture.is_some()),
            ("occlusion", material.occlusion_texture.is_some()),
            ("emissive", material.emissive_texture.is_some()),
            ("transmission", material.transmission_texture.is_some()),
        ]),
        flags: named(&[
            ("double-sided", material.double_sided),
            ("unlit", material.unlit),
            ("mirror", material.is_mirror()),
            ("transmission", material.transmission > 0.0),
        ]),
    }
}

impl Summary {
    /// As text for terminals.
    pub fn text(&self) -> String {
        let mut out = String::new();
        // Writing into a String cannot fail.
        let _ = self.write(&mut out);
        out.truncate(out.trim_end().len());
        out
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        let c = &self.counts;
        writeln!(out, "{}", self.scene)?;
        writeln!(
            out,
            "  {} triangles ({} drawn), {} vertices, {} primitives in {} meshes, {} nodes",
            c.triangles, c.triangles_drawn, c.vertices, c.primitives, c.meshes, c.nodes
        )?;
        if c.skins + c.morph_targets > 0 {
            writeln!(out, "  {} skins with {} joints, {} morph targets", c.skins, c.joints, c.morph_targets)?;
        }
        match &self.bounds {
            Some(b) => writeln!(out, "  from {} to {} m, size {}", vec3(b.min), vec3(b.max), vec3(b.max - b.min))?,
            None => writeln!(out, "  no geometry")?,
        }
        let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        let (geometry, textures) = (mib(self.memory.geometry), mib(self.memory.textures));
        writeln!(out, "  about {geometry:.1} MiB of geometry and {textures:.1} MiB of textures on the device")?;

        section(out, "cameras", self.cameras.len())?;
        for camera in &self.cameras {
            let angle = camera.yfov_degrees.map_or(String::new(), |angle| format!(" {angle:.1}°"));
            let stands = camera.position.map_or("not placed in the scene".to_owned(), |p| format!("at {}", vec3(p)));
            let looks = camera.forward.map_or(String::new(), |f| format!(", looks along {}", vec3(f)));
            writeln!(out, "  {} {:?} {}{angle}, {stands}{looks}", camera.index, camera.name, camera.kind)?;
        }
        section(out, "lights", self.lights.len())?;
        for light in &self.lights {
            let unit = if light.kind == "directional" { "W/m²" } else { "W/sr" };
            let at = light.position.map_or(String::new(), |p| format!(", at {}", vec3(p)));
            let along = light.direction.map_or(String::new(), |d| format!(", along {}", vec3(d)));
            let color = vec3(light.color);
            writeln!(out, "  {:?} {} {color} × {} {unit}{at}{along}", light.name, light.kind, light.intensity)?;
        }
        if let Some(e) = &self.environment {
            writeln!(out, "environment\n  {:?} {}×{}", e.name, e.width, e.height)?;
        }
        let named: Vec<&NodeInfo> = self.nodes.iter().filter(|node| !node.name.is_empty()).collect();
        section(out, "nodes with a name", named.len())?;
        for node in named.iter().take(NODES) {
            let mesh = node.mesh.as_ref().map_or(String::new(), |mesh| format!(", mesh {mesh:?}"));
            let parent = node.parent.and_then(|parent| self.nodes.get(parent as usize));
            let parent = parent.filter(|parent| !parent.name.is_empty());
            let under = parent.map_or(String::new(), |parent| format!(", child of {:?}", parent.name));
            writeln!(out, "  {:?}{mesh}{under}", node.name)?;
        }
        if named.len() > NODES {
            writeln!(out, "  and {} more (--json lists all)", named.len() - NODES)?;
        }
        section(out, "materials", self.materials.len())?;
        for m in &self.materials {
            let [r, g, b, a] = m.base_color;
            let base = format!("base {r:.3} {g:.3} {b:.3} {a:.3}, metal {:.2}, rough {:.2}", m.metallic, m.roughness);
            let emits = if m.emissive == Vec3::ZERO { String::new() } else { format!(", emits {}", vec3(m.emissive)) };
            let mut words = vec![m.alpha];
            words.extend(&m.flags);
            let maps =
                if m.textures.is_empty() { String::new() } else { format!(", textures: {}", m.textures.join(" ")) };
            writeln!(out, "  {:?} {base}{emits}, {}{maps}", m.name, words.join(" "))?;
        }
        section(out, "textures", self.textures.len())?;
        for t in &self.textures {
            writeln!(out, "  {:?} {}×{}", t.name, t.width, t.height)?;
        }
        section(out, "animations", self.animations.len())?;
        for a in &self.animations {
            writeln!(out, "  {:?} {} channels, {:.2} s", a.name, a.channels, a.seconds)?;
        }
        section(out, "notes", self.notes.len())?;
        for note in &self.notes {
            let kind = format!("{:?}", note.kind).to_lowercase();
            writeln!(out, "  {kind}: {}: {}", note.place, note.text)?;
        }
        Ok(())
    }
}

/// A headline, if its section is not empty.
fn section(out: &mut String, name: &str, count: usize) -> std::fmt::Result {
    if count > 0 { writeln!(out, "{name} ({count})") } else { Ok(()) }
}

fn vec3(v: Vec3) -> String {
    // Adding zero turns −0 into 0.
    format!("({:.3} {:.3} {:.3})", v.x + 0.0, v.y + 0.0, v.z + 0.0)
}

#[cfg(test)]
mod tests {
    use lucerna::scene::{Camera, Light, Mesh, Node, NoteKind, Primitive};

    use super::*;

    #[test]
    fn counts_instances_and_names_everything() {
        let primitive = Primitive {
            positions: vec![Vec3::ZERO; 4],
            normals: vec![Vec3::Y; 4],
            tangents: vec![glam::Vec4::ZERO; 4],
            indices: vec![0, 1, 2, 2, 1, 3],
            ..Primitive::default()
        };
        let instance = || Node { mesh: Some(0), ..Node::default() };
        let child = |number: usize| Node { name: format!("child {number}"), parent: Some(4), ..Node::default() };
        let projection = Projection::Perspective { yfov: 1.0, aspect: None, znear: 0.1, zfar: None };
        let scene = Scene {
            name: "test".into(),
            meshes: vec![Mesh { primitives: vec![primitive], ..Mesh::default() }],
            nodes: vec![
                instance(),
                instance(),
                Node { light: Some(0), ..Node::default() },
                Node { camera: Some(0), ..Node::default() },
                Node { name: "hero".into(), parent: Some(0), ..Node::default() },
            ]
            .into_iter()
            .chain((0..NODES).map(child))
            .collect(),
            materials: vec![Material::emitter("lamp", Vec3::ONE)],
            lights: vec![Light {
                name: "spot one".into(),
                kind: LightKind::Point { range: None },
                color: Vec3::ONE,
                intensity: 3.0,
            }],
            cameras: vec![Camera { name: "front".into(), projection }],
            notes: vec![Note { kind: NoteKind::Ignored, place: "extensionsUsed".into(), text: "EXT_x".into() }],
            ..Scene::default()
        };
        let summary = summary(&scene);
        assert_eq!((summary.counts.triangles, summary.counts.triangles_drawn), (2, 4));
        let text = summary.text();
        for part in [
            "2 triangles (4 drawn)",
            "\"front\" perspective 57.3°",
            "point",
            "lamp",
            "ignored: extensionsUsed: EXT_x",
            "  \"hero\"\n",
            "  \"child 98\", child of \"hero\"\n  and 1 more",
        ] {
            assert!(text.contains(part), "{part} is not in:\n{text}");
        }
        let json = serde_json::to_value(&summary).unwrap();
        assert_eq!(json["cameras"][0]["forward"], serde_json::json!([0.0, 0.0, -1.0]));
        assert_eq!(json["notes"][0]["kind"], "ignored");
        assert_eq!(json["nodes"].as_array().unwrap().len(), 5 + NODES);
        assert_eq!(json["nodes"][5], serde_json::json!({ "name": "child 0", "parent": 4, "mesh": null }));
    }
}
