//! Lamps: their groups in a bake, and when they burn.

use super::{Course, Group, Settings};
use crate::{Error, Result, scene::Scene};

/// When the lamps of a group burn.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Schedule {
    On,
    Off,
    /// While the sun is low.
    Dusk,
    /// From the first to the second second of the day; over midnight if the first is larger.
    Hours([f64; 2]),
}

/// All groups that a scene can have: its point and spot lights, and its emissive materials, by name. `wanted`: names of lights, of the nodes that
/// hold them, or of materials, each for a group; `*` at an end stands for any text. Empty: one group with all of them.
///
/// # Errors
/// `Usage`, with the names that exist, if a name fits nothing, or if two groups want the same lamp.
pub fn groups(scene: &Scene, wanted: &[String]) -> Result<Vec<Group>> {
    use crate::scene::LightKind::Directional;
    let lights: Vec<(u32, Vec<&str>)> = (0..)
        .zip(&scene.lights)
        .filter(|(_, light)| !matches!(light.kind, Directional) && light.intensity > 0.0)
        .map(|(index, light)| {
            let nodes = scene.nodes.iter().filter(|node| node.light == Some(index)).map(|node| node.name.as_str());
            (index, std::iter::once(light.name.as_str()).chain(nodes).collect())
        })
        .collect();
    let shines = |material: &&crate::scene::Material| material.emissive.max_element() > 0.0 && !material.unlit;
    let materials: Vec<(u32, &str)> = (0..)
        .zip(&scene.materials)
        .filter(|(_, material)| shines(material))
        .map(|(index, material)| (index, material.name.as_str()))
        .collect();
    if wanted.is_empty() {
        let all = Group {
            name: "lamps".into(),
            lights: lights.iter().map(|(index, _)| *index).collect(),
            materials: materials.iter().map(|(index, _)| *index).collect(),
        };
        return Ok(if all.lights.is_empty() && all.materials.is_empty() { Vec::new() } else { vec![all] });
    }
    let mut out: Vec<Group> = Vec::new();
    for name in wanted {
        let of_lights = lights.iter().filter(|(_, names)| names.iter().any(|found| fits(name, found)));
        let of_materials = materials.iter().filter(|(_, found)| fits(name, found));
        let group = Group {
            name: name.clone(),
            lights: of_lights.map(|(index, _)| *index).collect(),
            materials: of_materials.map(|(index, _)| *index).collect(),
        };
        if group.lights.is_empty() && group.materials.is_empty() {
            let mut names: Vec<&str> =
                lights.iter().flat_map(|(_, names)| names).copied().chain(materials.iter().map(|m| m.1)).collect();
            names.sort_unstable();
            names.dedup();
            let error = Error::usage(format!("no light and no emissive material is named `{name}`")).at("--lamp");
            return Err(match names.is_empty() {
                true => error.help("The scene has no lamps"),
                false => error.help(format!("Its lamps are {}", names.join(", "))),
            });
        }
        let twice = out.iter().find(|other| {
            other.lights.iter().any(|light| group.lights.contains(light))
                || other.materials.iter().any(|material| group.materials.contains(material))
        });
        if let Some(other) = twice {
            let what = format!("`{name}` and `{}` name the same lamp, and a lamp can be in one group", other.name);
            return Err(Error::usage(what).at("--lamp"));
        }
        out.push(group);
    }
    Ok(out)
}

/// The group of each placed light of a scene, in the order of the lights of the device: those of the nodes.
pub(super) fn placed(scene: &Scene, groups: &[Group]) -> impl Iterator<Item = Option<usize>> {
    let placed = scene.nodes.iter().filter_map(|node| node.light);
    let placed = placed.filter(|light| (*light as usize) < scene.lights.len());
    placed.map(|light| groups.iter().position(|group| group.lights.contains(&light)))
}

/// Whether a name fits a pattern in which `*` at either end stands for any text.
fn fits(pattern: &str, name: &str) -> bool {
    match (pattern.strip_prefix('*'), pattern.strip_suffix('*')) {
        (Some(_), Some(_)) => name.contains(pattern.trim_matches('*')),
        (Some(end), None) => name.ends_with(end),
        (None, Some(start)) => name.starts_with(start),
        (None, None) => name == pattern,
    }
}

/// How much of its light each group gives, 0 to 1. `elevation`: of the sun, degrees.
///
/// # Errors
/// `Usage` if the schedule cannot be read or names a group that the bake does not have.
pub fn burning(
    settings: &Settings,
    groups: &[Group],
    course: &Course,
    seconds: f64,
    elevation: f64,
) -> Result<Vec<f32>> {
    let wrong = |what: String| {
        let help =
            "Allowed are dusk, on, off and hours (18:30-06:00), also for single groups: NAME=on,OTHER=18:30-06:00";
        Error::usage(what).at("daylight.lamps").help(help)
    };
    let read = |text: &str| match text {
        "on" => Ok(Schedule::On),
        "off" => Ok(Schedule::Off),
        "dusk" => Ok(Schedule::Dusk),
        hours => {
            let cannot = || wrong(format!("`{hours}` is no schedule"));
            let (from, to) = hours.split_once('-').ok_or_else(cannot)?;
            let second =
                |text: &str| course.parse_time(text.trim()).map_err(|what| wrong(format!("`{hours}`: {what}")));
            Ok(Schedule::Hours([second(from)?, second(to)?]))
        }
    };
    let mut schedules = vec![Schedule::Dusk; groups.len()];
    for part in settings.lamps.split(',').map(str::trim).filter(|part| !part.is_empty()) {
        let Some((name, schedule)) = part.split_once('=') else {
            schedules.fill(read(part)?);
            continue;
        };
        let Some(at) = groups.iter().position(|group| group.name == name.trim()) else {
            let names: Vec<&str> = groups.iter().map(|group| group.name.as_str()).collect();
            let has = if names.is_empty() { "none".into() } else { names.join(", ") };
            return Err(wrong(format!("the bake has no lamps named `{}`; it has {has}", name.trim())));
        };
        schedules[at] = read(schedule.trim())?;
    }
    let share = |schedule: &Schedule| match *schedule {
        Schedule::On => 1.0,
        Schedule::Off => 0.0,
        Schedule::Dusk => (settings.dusk + 0.5 - elevation).clamp(0.0, 1.0) as f32,
        Schedule::Hours([from, to]) if from <= to => f32::from(u8::from(seconds >= from && seconds < to)),
        Schedule::Hours([from, to]) => f32::from(u8::from(seconds >= from || seconds < to)),
    };
    Ok(schedules.iter().map(share).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(name: &str) -> Group {
        Group { name: name.into(), lights: vec![0], materials: Vec::new() }
    }

    #[test]
    fn lamps_burn_by_the_sun_by_hours_and_by_name() {
        let day = Box::new(crate::techniques::daylight::Day::new("2026-06-21", "UTC", 50.0, 0.0).unwrap());
        let day = Course::Almanac { day, north: 0.0 };
        let groups = [group("posts"), group("office")];
        let at = |lamps: &str, hour: f64, elevation: f64| {
            let settings = Settings { lamps: lamps.into(), ..Settings::default() };
            burning(&settings, &groups, &day, 3600.0 * hour, elevation).unwrap()
        };
        assert_eq!(at("dusk", 12.0, 60.0), [0.0, 0.0]);
        assert_eq!(at("dusk", 23.0, -10.0), [1.0, 1.0]);
        assert!((at("dusk", 20.0, 3.0)[0] - 0.5).abs() < 1e-6);
        assert_eq!(at("18:30-06:00", 23.0, 60.0), [1.0, 1.0]);
        assert_eq!(at("18:30-06:00", 6.0, -60.0), [0.0, 0.0]);
        assert_eq!(at("08:00-17:00", 12.0, -60.0), [1.0, 1.0]);
        assert_eq!(at("off, office=on", 12.0, 60.0), [0.0, 1.0]);
        assert_eq!(at("posts=off", 23.0, -60.0), [0.0, 1.0]);
        for wrong in ["sometimes", "25:00-06:00", "hall=on", "18:00"] {
            let settings = Settings { lamps: wrong.into(), ..Settings::default() };
            let error = burning(&settings, &groups, &day, 0.0, 0.0).unwrap_err();
            assert_eq!(error.exit_code(), 2, "{error}");
        }
    }

    #[test]
    fn names_fit_with_stars() {
        for (pattern, name, wanted) in
            [("lamp", "lamp", true), ("lamp", "lamps", false), ("lamp*", "lamps", true), ("*st", "post", true)]
        {
            assert_eq!(fits(pattern, name), wanted, "{pattern} {name}");
        }
        assert!(fits("*os*", "post") && !fits("*ox*", "post") && fits("*", ""));
    }
}
