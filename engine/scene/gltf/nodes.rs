//! The node hierarchy of the shown scene, and what stands at its nodes.

use super::{
    document::{Document, extension, item},
    types::{self, LightUse},
};
use crate::{
    Error, Result,
    scene::{Camera, Light, LightKind, Limits, Node, Projection, Transform, notes::Notes},
};
use glam::{Mat4, Quat, Vec3};
use std::collections::HashSet;

/// The nodes that are shown, parents before children, and where the file's nodes went.
#[derive(Debug)]
pub struct Hierarchy {
    pub nodes: Vec<Node>,
    /// For each node of the file its index in `nodes`.
    pub new_index: Vec<Option<u32>>,
}

/// Reads the default scene, or the first one, or, in a file without scenes, all nodes.
pub fn read(document: &Document, limits: &Limits, notes: &mut Notes) -> Result<Hierarchy> {
    let count = document.nodes.len();
    if count as u64 > limits.max_nodes {
        return Err(Error::input(format!("{count} nodes, {} are allowed", limits.max_nodes)).at("nodes"));
    }
    let parents = parents(document)?;
    let order = breadth_first(document, &parents, limits)?;
    let roots = roots(document, &parents, notes)?;

    // Roots that are shown, and everything below them, and joints of shown skins with their ancestors.
    let mut shown = vec![false; count];
    for &root in &roots {
        shown[root as usize] = true;
    }
    for &node in &order {
        if let Some(parent) = parents[node as usize] {
            shown[node as usize] |= shown[parent as usize];
        }
    }
    let mut needed = shown.clone();
    let mut skins = HashSet::new();
    for (i, node) in document.nodes.iter().enumerate() {
        let Some(skin) = node.skin.filter(|&skin| shown[i] && skins.insert(skin)) else { continue };
        let skin = item(&document.skins, "skins", skin).map_err(|error| error.at(format!("nodes[{i}].skin")))?;
        for &joint in &skin.joints {
            let mut at = Some(joint);
            while let Some(node) = at.filter(|&node| needed.get(node as usize) == Some(&false)) {
                needed[node as usize] = true;
                at = parents[node as usize];
            }
        }
    }

    let mut out = Hierarchy { nodes: Vec::new(), new_index: vec![None; count] };
    for &index in &order {
        let i = index as usize;
        // Unused nodes are checked like the others.
        let mut node = node(document, i, notes).map_err(|error| error.at(format!("nodes[{i}]")))?;
        if !needed[i] {
            continue;
        }
        if !shown[i] {
            node = Node { name: node.name, local: node.local, ..Node::default() };
        }
        node.parent = parents[i].and_then(|parent| out.new_index[parent as usize]);
        out.new_index[i] = Some(out.nodes.len() as u32);
        out.nodes.push(node);
    }
    Ok(out)
}

/// The parent of each node; two parents are an error.
fn parents(document: &Document) -> Result<Vec<Option<u32>>> {
    let mut parents = vec![None; document.nodes.len()];
    for (i, node) in document.nodes.iter().enumerate() {
        for (c, &child) in node.children.iter().enumerate() {
            let place = || format!("nodes[{i}].children[{c}]");
            item(&document.nodes, "nodes", child).map_err(|error| error.at(place()))?;
            if let Some(other) = parents[child as usize].replace(i as u32) {
                return Err(Error::input(format!("nodes[{child}] is already a child of nodes[{other}]"))
                    .at(place())
                    .help("A node may have one parent; duplicate the node in the program that made the file"));
            }
        }
    }
    Ok(parents)
}

/// All nodes, parents first. What cannot be reached from a node without parent lies on a cycle.
fn breadth_first(document: &Document, parents: &[Option<u32>], limits: &Limits) -> Result<Vec<u32>> {
    let mut depth = vec![0u32; parents.len()];
    let mut order: Vec<u32> = (0..parents.len() as u32).filter(|&i| parents[i as usize].is_none()).collect();
    let mut next = 0;
    while let Some(&node) = order.get(next) {
        next += 1;
        let below = depth[node as usize] + 1;
        let children = &document.nodes[node as usize].children;
        if below > limits.max_depth && !children.is_empty() {
            return Err(Error::input(format!("the hierarchy is deeper than {} nodes", limits.max_depth))
                .at(format!("nodes[{node}].children")));
        }
        for &child in children {
            depth[child as usize] = below;
            order.push(child);
        }
    }
    if order.len() < parents.len() {
        let mut reached = vec![false; parents.len()];
        order.iter().for_each(|&node| reached[node as usize] = true);
        let on_cycle = reached.iter().position(|reached| !reached).unwrap_or_default();
        return Err(Error::input("the node is its own ancestor")
            .at(format!("nodes[{on_cycle}]"))
            .help("Break the cycle in the program that made the file"));
    }
    Ok(order)
}

fn roots(document: &Document, parents: &[Option<u32>], notes: &mut Notes) -> Result<Vec<u32>> {
    for (s, scene) in document.scenes.iter().enumerate() {
        for (n, &node) in scene.nodes.iter().enumerate() {
            let place = || format!("scenes[{s}].nodes[{n}]");
            item(&document.nodes, "nodes", node).map_err(|error| error.at(place()))?;
            if let Some(parent) = parents[node as usize] {
                return Err(
                    Error::input(format!("nodes[{node}] is no root, but a child of nodes[{parent}]")).at(place())
                );
            }
        }
    }
    let scene = match document.scene {
        Some(index) => Some(item(&document.scenes, "scenes", index).map_err(|error| error.at("scene"))?),
        None => document.scenes.first(),
    };
    if document.scenes.len() > 1 {
        let name = scene.and_then(|scene| scene.name.as_deref()).unwrap_or_default();
        notes.ignored("scenes", format!("{} scenes, only the default one {name:?} is shown", document.scenes.len()));
    }
    Ok(match scene {
        Some(scene) => scene.nodes.clone(),
        None => (0..parents.len() as u32).filter(|&i| parents[i as usize].is_none()).collect(),
    })
}

fn node(document: &Document, index: usize, notes: &mut Notes) -> Result<Node> {
    let source = &document.nodes[index];
    let mut out = Node { name: source.name.clone().unwrap_or_default(), ..Node::default() };
    out.local = transform(source, index, notes)?;
    if let Some(mesh) = source.mesh {
        let mesh_of = item(&document.meshes, "meshes", mesh).map_err(|error| error.at("mesh"))?;
        out.mesh = Some(mesh);
        let targets = mesh_of.primitives.first().map_or(0, |primitive| primitive.targets.len());
        if !source.weights.is_empty() && source.weights.len() != targets {
            return Err(Error::input(format!(
                "{} weights, meshes[{mesh}] has {targets} morph targets",
                source.weights.len()
            ))
            .at("weights"));
        }
        finite(&source.weights, "weights")?;
        out.weights = source.weights.clone();
    } else if !source.weights.is_empty() || source.skin.is_some() {
        return Err(Error::input("has weights or a skin, but no mesh"));
    }
    if let Some(skin) = source.skin {
        item(&document.skins, "skins", skin).map_err(|error| error.at("skin"))?;
        out.skin = Some(skin);
    }
    if let Some(camera) = source.camera {
        item(&document.cameras, "cameras", camera).map_err(|error| error.at("camera"))?;
        out.camera = Some(camera);
    }
    if let Some(LightUse { light }) = extension(&source.extensions, "KHR_lights_punctual")? {
        item(&document.lights, "lights", light).map_err(|error| error.at("extensions.KHR_lights_punctual.light"))?;
        out.light = Some(light);
    }
    Ok(out)
}

fn transform(source: &types::Node, index: usize, notes: &mut Notes) -> Result<Transform> {
    if let Some(matrix) = source.matrix {
        finite(&matrix, "matrix")?;
        if source.translation.is_some() || source.rotation.is_some() || source.scale.is_some() {
            return Err(Error::input("has both a matrix and translation, rotation or scale").at("matrix"));
        }
        if matrix[3] != 0.0 || matrix[7] != 0.0 || matrix[11] != 0.0 || matrix[15] != 1.0 {
            return Err(Error::input("the last row must be 0 0 0 1").at("matrix"));
        }
        return Ok(Transform::Matrix(Mat4::from_cols_array(&matrix)));
    }
    let translation = source.translation.unwrap_or_default();
    let rotation = source.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let scale = source.scale.unwrap_or([1.0; 3]);
    finite(&translation, "translation")?;
    finite(&rotation, "rotation")?;
    finite(&scale, "scale")?;
    let length = rotation.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>().sqrt();
    if length < 1e-6 {
        return Err(Error::input("the quaternion has no direction").at("rotation"));
    }
    if (length - 1.0).abs() > 1e-3 {
        notes.repaired(format!("nodes[{index}].rotation"), format!("quaternion of length {length:.4} normalised"));
    }
    let rotation = rotation.map(|v| (f64::from(v) / length) as f32);
    Ok(Transform::Trs {
        translation: Vec3::from(translation),
        rotation: Quat::from_array(rotation),
        scale: Vec3::from(scale),
    })
}

fn finite(values: &[f32], what: &str) -> Result<()> {
    match values.iter().find(|value| !value.is_finite()) {
        None => Ok(()),
        Some(value) => Err(Error::input(format!("{value} is not finite")).at(what)),
    }
}

/// The cameras of a file.
pub fn cameras(document: &Document) -> Result<Vec<Camera>> {
    document
        .cameras
        .iter()
        .enumerate()
        .map(|(i, camera)| self::camera(camera).map_err(|error| error.at(format!("cameras[{i}]"))))
        .collect()
}

fn camera(camera: &types::Camera) -> Result<Camera> {
    let positive = |value: f32, what: &str| match value.is_finite() && value > 0.0 {
        true => Ok(value),
        false => Err(Error::input(format!("{value}, must be above 0")).at(what)),
    };
    let behind = |znear: f32, zfar: f32| match zfar.is_finite() && zfar > znear {
        true => Ok(zfar),
        false => Err(Error::input(format!("{zfar}, must be above znear {znear}")).at("zfar")),
    };
    let projection = match (camera.kind.as_str(), &camera.perspective, &camera.orthographic) {
        ("perspective", Some(p), _) => {
            let read = || {
                let yfov = positive(p.yfov, "yfov")?;
                if yfov >= std::f32::consts::PI {
                    return Err(Error::input(format!("{yfov} rad, must be below π")).at("yfov"));
                }
                let znear = positive(p.znear, "znear")?;
                let zfar = p.zfar.map(|zfar| behind(znear, zfar)).transpose()?;
                let aspect = p.aspect_ratio.map(|aspect| positive(aspect, "aspectRatio")).transpose()?;
                Ok(Projection::Perspective { yfov, aspect, znear, zfar })
            };
            read().map_err(|error: Error| error.at("perspective"))?
        }
        ("orthographic", _, Some(o)) => {
            let read = || {
                // Negative magnitudes would mirror the picture; the format discourages them.
                let (xmag, ymag) = (positive(o.xmag, "xmag")?, positive(o.ymag, "ymag")?);
                if !o.znear.is_finite() || o.znear < 0.0 {
                    return Err(Error::input(format!("{}, must not be below 0", o.znear)).at("znear"));
                }
                Ok(Projection::Orthographic { xmag, ymag, znear: o.znear, zfar: behind(o.znear, o.zfar)? })
            };
            read().map_err(|error: Error| error.at("orthographic"))?
        }
        (kind @ ("perspective" | "orthographic"), _, _) => {
            return Err(Error::input(format!("the camera has no {kind:?}")));
        }
        (kind, _, _) => return Err(Error::input(format!("{kind:?} is unknown")).at("type")),
    };
    Ok(Camera { name: camera.name.clone().unwrap_or_default(), projection })
}

/// The lights of a file (KHR_lights_punctual).
pub fn lights(document: &Document, notes: &mut Notes) -> Result<Vec<Light>> {
    let mut out = Vec::with_capacity(document.lights.len());
    for (i, light) in document.lights.iter().enumerate() {
        let place = format!("extensions.KHR_lights_punctual.lights[{i}]");
        out.push(self::light(light, &place, notes).map_err(|error| error.at(&place))?);
    }
    Ok(out)
}

fn light(light: &types::Light, place: &str, notes: &mut Notes) -> Result<Light> {
    let not_negative = |value: f32, what: &str| match value.is_finite() && value >= 0.0 {
        true => Ok(value),
        false => Err(Error::input(format!("{value}, must not be below 0")).at(what)),
    };
    for value in light.color {
        not_negative(value, "color")?;
    }
    let range = match light.range {
        Some(range) if !(range.is_finite() && range > 0.0) => {
            return Err(Error::input(format!("{range}, must be above 0")).at("range"));
        }
        range => range,
    };
    let kind = match light.kind.as_str() {
        "directional" => LightKind::Directional,
        "point" => LightKind::Point { range },
        "spot" => {
            let spot = light.spot.as_ref().ok_or_else(|| Error::input("is missing").at("spot"))?;
            let mut outer = spot.outer_cone_angle;
            let mut inner = not_negative(spot.inner_cone_angle, "spot.innerConeAngle")?;
            if !(outer > 0.0 && outer <= std::f32::consts::FRAC_PI_2 + 1e-4) {
                return Err(
                    Error::input(format!("{outer} rad, must be above 0 and at most π/2")).at("spot.outerConeAngle")
                );
            }
            outer = outer.min(std::f32::consts::FRAC_PI_2);
            if inner >= outer {
                // A hard edge, which exporters write though the format wants a soft one.
                notes.repaired(place, format!("inner cone angle {inner} made smaller than the outer one, {outer}"));
                inner = outer * 0.999;
            }
            LightKind::Spot { range, inner, outer }
        }
        other => {
            // Types may be added to the extension. The light keeps its place in the list, without shining.
            notes.ignored(place, format!("a light of type {other:?} is not supported"));
            let name = light.name.clone().unwrap_or_default();
            return Ok(Light { name, kind: LightKind::Point { range: None }, color: Vec3::ZERO, intensity: 0.0 });
        }
    };
    Ok(Light {
        name: light.name.clone().unwrap_or_default(),
        kind,
        color: Vec3::from(light.color),
        intensity: not_negative(light.intensity, "intensity")?,
    })
}
