//! Skins and animations.

use super::{
    accessors::{Accessors, Format},
    document::item,
    nodes::Hierarchy,
    types,
};
use crate::{
    Error, Result,
    scene::{Animation, Channel, Interpolation, Keys, Skin, Transform, notes::Notes},
};
use glam::{Mat4, Quat, Vec3};
use std::collections::HashSet;

/// Reads the skins of a file. Those that no shown node uses come out empty, as their joints may not be shown.
pub fn skins(accessors: &Accessors, hierarchy: &Hierarchy) -> Result<Vec<Skin>> {
    let document = accessors.document;
    let mut out = Vec::with_capacity(document.skins.len());
    let used: HashSet<u32> = hierarchy.nodes.iter().filter_map(|node| node.skin).collect();
    for (i, source) in document.skins.iter().enumerate() {
        let used = used.contains(&(i as u32));
        let skin = skin(accessors, hierarchy, source, used).map_err(|error| error.at(format!("skins[{i}]")))?;
        out.push(skin);
    }
    Ok(out)
}

fn skin(accessors: &Accessors, hierarchy: &Hierarchy, source: &types::Skin, used: bool) -> Result<Skin> {
    let document = accessors.document;
    if source.joints.is_empty() {
        return Err(Error::input("is empty").at("joints"));
    }
    if let Some(skeleton) = source.skeleton {
        item(&document.nodes, "nodes", skeleton).map_err(|error| error.at("skeleton"))?;
    }
    let mut skin = Skin { name: source.name.clone().unwrap_or_default(), joints: vec![], inverse_bind: vec![] };
    for (j, &joint) in source.joints.iter().enumerate() {
        item(&document.nodes, "nodes", joint).map_err(|error| error.at(format!("joints[{j}]")))?;
        skin.joints.extend(hierarchy.new_index[joint as usize]);
    }
    skin.inverse_bind = match source.inverse_bind_matrices {
        None => vec![Mat4::IDENTITY; source.joints.len()],
        Some(accessor) => {
            let read = || {
                let rows = accessors.floats::<16>(accessor, Format::MATRIX)?;
                if rows.len() < source.joints.len() {
                    return Err(Error::input(format!("{} matrices for {} joints", rows.len(), source.joints.len())));
                }
                Ok(rows.iter().take(source.joints.len()).map(Mat4::from_cols_array).collect())
            };
            read().map_err(|error: Error| error.at("inverseBindMatrices"))?
        }
    };
    if !used {
        (skin.joints, skin.inverse_bind) = (vec![], vec![]);
    }
    Ok(skin)
}

/// Reads the animations of a file.
pub fn animations(accessors: &Accessors, hierarchy: &Hierarchy, notes: &mut Notes) -> Result<Vec<Animation>> {
    let document = accessors.document;
    let mut out = Vec::with_capacity(document.animations.len());
    for (i, source) in document.animations.iter().enumerate() {
        let place = format!("animations[{i}]");
        let mut animation = Animation { name: source.name.clone().unwrap_or_default(), channels: vec![] };
        let mut moved = HashSet::new();
        for (c, channel) in source.channels.iter().enumerate() {
            let here = format!("{place}.channels[{c}]");
            let read = channel_of(accessors, hierarchy, source, channel, &here, notes);
            let Some(read) = read.map_err(|error| error.at(&here))? else { continue };
            if !moved.insert((read.node, std::mem::discriminant(&read.values))) {
                return Err(Error::input("another channel of the animation moves the same property").at(here));
            }
            animation.channels.push(read);
        }
        out.push(animation);
    }
    Ok(out)
}

fn channel_of(
    accessors: &Accessors,
    hierarchy: &Hierarchy,
    animation: &types::Animation,
    channel: &types::Channel,
    here: &str,
    notes: &mut Notes,
) -> Result<Option<Channel>> {
    let document = accessors.document;
    let sampler = item(&animation.samplers, "samplers", channel.sampler).map_err(|error| error.at("sampler"))?;
    let Some(target) = channel.target.node else {
        notes.ignored(here, format!("target {:?} is no node", channel.target.path));
        return Ok(None);
    };
    let node = item(&document.nodes, "nodes", target).map_err(|error| error.at("target.node"))?;
    let interpolation = match sampler.interpolation.as_deref() {
        None | Some("LINEAR") => Interpolation::Linear,
        Some("STEP") => Interpolation::Step,
        Some("CUBICSPLINE") => Interpolation::CubicSpline,
        Some(other) => {
            notes.approximated(here, format!("interpolation {other:?} is unknown, LINEAR is used"));
            Interpolation::Linear
        }
    };
    let at = |error: Error| error.at(format!("samplers[{}]", channel.sampler));
    let mut times = times(accessors, sampler.input).map_err(|error| at(error.at("input")))?;
    let rows = times.len() * if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
    let output = |error: Error| at(error.at("output"));
    let exactly = |count: usize, wanted: usize| match count == wanted {
        true => Ok(()),
        false => Err(Error::input(format!("{count} values, {wanted} are needed for {} keys", times.len()))),
    };
    let vectors = || -> Result<Vec<Vec3>> {
        let values = accessors.floats::<3>(sampler.output, Format::KEY_VECTOR)?;
        exactly(values.len(), rows)?;
        Ok(values.into_iter().map(Vec3::from).collect())
    };
    let mut values = match channel.target.path.as_str() {
        "translation" => Keys::Translation(vectors().map_err(output)?),
        "scale" => Keys::Scale(vectors().map_err(output)?),
        "rotation" => Keys::Rotation(rotations(accessors, sampler.output, rows, interpolation).map_err(output)?),
        "weights" => {
            let mesh = node.mesh.and_then(|mesh| document.meshes.get(mesh as usize));
            let count = mesh.and_then(|mesh| mesh.primitives.first()).map_or(0, |primitive| primitive.targets.len());
            if count == 0 {
                return Err(Error::input(format!("nodes[{target}] has no morph targets")).at("target"));
            }
            let values = accessors.floats::<1>(sampler.output, Format::KEY_WEIGHT).map_err(output)?;
            exactly(values.len(), rows * count).map_err(output)?;
            Keys::Weights { count, values: values.into_iter().map(|[value]| value).collect() }
        }
        other => {
            notes.ignored(here, format!("target path {other:?} is unknown"));
            return Ok(None);
        }
    };
    let Some(new) = hierarchy.new_index[target as usize] else {
        notes.ignored(here, format!("nodes[{target}] is not in the shown scene"));
        return Ok(None);
    };
    if !matches!(values, Keys::Weights { .. }) && matches!(hierarchy.nodes[new as usize].local, Transform::Matrix(_)) {
        return Err(Error::input(format!("nodes[{target}] has a matrix, which cannot be animated")).at("target.node"));
    }
    let repeated = drop_repeated_keys(&mut times, &mut values, interpolation);
    if repeated > 0 {
        notes.repaired(here, format!("{repeated} keys dropped that are not later than the one before"));
    }
    Ok(Some(Channel { node: new, interpolation, times, values }))
}

/// Keeps the first of keys at the same time, and says how many went.
fn drop_repeated_keys(times: &mut Vec<f32>, values: &mut Keys, interpolation: Interpolation) -> usize {
    let before = times.len();
    let kept: Vec<bool> = (0..before).map(|i| i == 0 || times[i] > times[i - 1]).collect();
    if kept.iter().all(|&kept| kept) {
        return 0;
    }
    let rows = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
    fn retain<T>(list: &mut Vec<T>, width: usize, kept: &[bool]) {
        let mut at = 0;
        list.retain(|_| {
            at += 1;
            kept[(at - 1) / width]
        });
    }
    retain(times, 1, &kept);
    match values {
        Keys::Translation(values) | Keys::Scale(values) => retain(values, rows, &kept),
        Keys::Rotation(values) => retain(values, rows, &kept),
        Keys::Weights { count, values } => retain(values, rows * *count, &kept),
    }
    before - times.len()
}

fn times(accessors: &Accessors, index: u32) -> Result<Vec<f32>> {
    let times: Vec<f32> = accessors.floats::<1>(index, Format::TIME)?.into_iter().map(|[time]| time).collect();
    let bad = (0..times.len()).find(|&i| times[i] < 0.0 || (i > 0 && times[i] < times[i - 1]));
    match bad {
        None => Ok(times),
        Some(i) => Err(Error::input(format!("time {} (at {i}) is negative or earlier than the one before", times[i]))),
    }
}

fn rotations(accessors: &Accessors, index: u32, rows: usize, interpolation: Interpolation) -> Result<Vec<Quat>> {
    let values = accessors.floats::<4>(index, Format::KEY_ROTATION)?;
    if values.len() != rows {
        return Err(Error::input(format!("{} values, {rows} are needed", values.len())));
    }
    let cubic = interpolation == Interpolation::CubicSpline;
    let mut out = Vec::with_capacity(rows);
    for (i, value) in values.into_iter().enumerate() {
        // Tangents of a spline are differences, which have no length to keep.
        if cubic && i % 3 != 1 {
            out.push(Quat::from_array(value));
            continue;
        }
        let length = value.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>().sqrt();
        if length < 1e-6 {
            return Err(Error::input(format!("the quaternion at {i} has no direction")));
        }
        out.push(Quat::from_array(value.map(|v| (f64::from(v) / length) as f32)));
    }
    Ok(out)
}
