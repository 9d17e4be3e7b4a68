//! Assignment of shadow maps to lights, and the projection of each map.

use super::{Kind, Settings};
use crate::{
    scene::{
        Aabb, View,
        view::{looking_along, orthographic, perspective},
    },
    shaders::{consts, types},
};
use glam::{Mat4, Vec2, Vec3, Vec3Swizzles, Vec4Swizzles};

/// Spot lights with a larger half angle, radians, get six maps like point lights.
const WIDEST_SPOT: f32 = 1.2;
/// Width of the border that filters may read around a map's useful part, texels.
const BORDER: f32 = 3.0;

/// The maps of all lights.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Assignment {
    pub slots: Vec<types::ShadowSlot>,
    /// One entry for each light.
    pub lights: Vec<types::ShadowLight>,
    /// Lights for which no map was left.
    pub unshadowed: Vec<usize>,
}

impl Assignment {
    /// No map for any of `lights` lights.
    pub fn none(lights: usize) -> Self {
        Self { lights: vec![types::ShadowLight::default(); lights], ..Self::default() }
    }
}

/// Gives maps to the lights that `casts` chooses, in their order, until [`consts::MAX_SHADOW_SLOTS`] are taken. `bounds`: the scene's, which limit
/// the reach of lights without a range.
pub fn assign(
    lights: &[types::Light],
    bounds: &Aabb,
    view: &View,
    settings: &Settings,
    casts: impl Fn(&types::Light) -> bool,
) -> Assignment {
    let mut out = Assignment::none(lights.len());
    if !bounds.is_finite() {
        return out;
    }
    for (index, light) in lights.iter().enumerate().filter(|(_, light)| casts(light)) {
        let slots = match light.kind {
            consts::LIGHT_DIRECTIONAL => cascades(light, bounds, view, settings),
            _ if local_maps(light) == 1 => vec![spot(light, bounds, settings)],
            _ => faces(light, bounds, settings).to_vec(),
        };
        if out.slots.len() + slots.len() > consts::MAX_SHADOW_SLOTS as usize {
            out.unshadowed.push(index);
            continue;
        }
        out.lights[index] = types::ShadowLight { first: out.slots.len() as u32, count: slots.len() as u32 };
        out.slots.extend(slots);
    }
    out
}

/// Maps of a point or spot light.
pub fn local_maps(light: &types::Light) -> u32 {
    if light.kind == consts::LIGHT_SPOT && outer_angle(light) <= WIDEST_SPOT { 1 } else { 6 }
}

/// Where a spot light's cone ends, radians.
fn outer_angle(light: &types::Light) -> f32 {
    (-light.spot_offset / light.spot_scale).clamp(-1.0, 1.0).acos()
}

/// Metres that the light reaches: its range, but not beyond the scene.
fn reach(light: &types::Light, bounds: &Aabb) -> f32 {
    let at = Vec3::from(light.position);
    let scene = bounds.corners().into_iter().map(|c| c.distance(at)).fold(0.0, f32::max) * 1.01;
    let reach = if light.range > 0.0 { light.range.min(scene) } else { scene };
    reach.max(1e-3)
}

/// c for linear depth that spans `range` metres.
fn exponent(range: f32, settings: &Settings) -> f32 {
    let reach = settings.exponent_reach;
    if reach > 0.0 { settings.exponent * (range / reach).max(1.0) } else { settings.exponent }
}

/// Texels of border on each side for the filter that reads the map.
fn border(settings: &Settings) -> f32 {
    BORDER + if settings.kind == Kind::Exponential { 2.0 * settings.blur } else { 0.0 }
}

fn looking(at: Vec3, along: Vec3, half: f32, far: f32, settings: &Settings) -> types::ShadowSlot {
    // Reversed floating-point depth is precise for any near plane.
    let near = (far * 1e-3).min(0.02);
    let size = settings.size as f32;
    let half = half * size / (size - 2.0 * border(settings)).max(1.0);
    let view = looking_along(at, along);
    types::ShadowSlot {
        clip_from_world: (perspective(Vec2::splat(half), near, far) * view).to_cols_array_2d(),
        near,
        far,
        texel: 2.0 * half / size,
        perspective: 1,
        half_angle: [half; 2],
        exponent: exponent(far, settings),
    }
}

fn spot(light: &types::Light, bounds: &Aabb, settings: &Settings) -> types::ShadowSlot {
    let half = outer_angle(light).max(1e-3).tan();
    looking(light.position.into(), light.direction.into(), half, reach(light, bounds), settings)
}

/// In the order of `cube_face` in `lib/shadow.glsl`.
fn faces(light: &types::Light, bounds: &Aabb, settings: &Settings) -> [types::ShadowSlot; 6] {
    let far = reach(light, bounds);
    let along = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    along.map(|along| looking(light.position.into(), along, 1.0, far, settings))
}

/// Cascades: parallel maps around consecutive parts of the view. Each has a constant size (a sphere around the part) and moves in whole
/// texels, so that shadow edges do not flicker while the camera moves.
fn cascades(light: &types::Light, bounds: &Aabb, view: &View, settings: &Settings) -> Vec<types::ShadowSlot> {
    let along = Vec3::from(light.direction);
    let light_from_world = looking_along(Vec3::ZERO, along);
    // The whole scene casts; depth is measured along the light.
    let depths = bounds.corners().map(|c| along.dot(c));
    let near = depths.into_iter().fold(f32::INFINITY, f32::min);
    let far = depths.into_iter().fold(f32::NEG_INFINITY, f32::max);
    let margin = (far - near) * 0.01 + 1e-3;
    let (near, far) = (near - margin, far + margin);
    let [_, _, forward] = view.axes();
    let farthest = bounds.corners().into_iter().map(|c| forward.dot(c - view.position)).fold(0.0, f32::max);
    let mut end = view.far.min(farthest * 1.01 + 1e-3);
    if settings.distance > 0.0 {
        end = end.min(settings.distance);
    }
    let start = view.near.max(0.0);
    let end = end.max(start * 1.01 + 1e-3);
    let scene = (bounds.centre(), bounds.half().length());
    let mut out = Vec::new();
    for range in split(start, end, settings.cascades, settings.split) {
        let (centre, radius) = sphere(view, range);
        // If a part is larger than the scene, one last map around the whole scene is enough.
        let whole = radius >= scene.1;
        let (centre, radius) = if whole { scene } else { (centre, radius) };
        out.push(parallel(&light_from_world, centre, radius.max(1e-3), near, far, settings));
        if whole {
            break;
        }
    }
    out
}

fn parallel(
    light_from_world: &Mat4,
    centre: Vec3,
    radius: f32,
    near: f32,
    far: f32,
    settings: &Settings,
) -> types::ShadowSlot {
    let size = settings.size as f32;
    // `cascade_of` keeps three texels away from the border; one is for the rounding below.
    let radius = radius * size / (size - 2.0 * (border(settings) + 4.0)).max(1.0);
    let texel = 2.0 * radius / size;
    let at = light_from_world.transform_point3(centre);
    let at = (at / texel).round() * texel;
    let view = Mat4::from_translation(Vec3::new(-at.x, -at.y, 0.0)) * *light_from_world;
    types::ShadowSlot {
        clip_from_world: (orthographic(Vec2::splat(radius), near, far) * view).to_cols_array_2d(),
        near,
        far,
        texel,
        perspective: 0,
        half_angle: [1.0; 2],
        exponent: exponent(far - near, settings),
    }
}

/// Start and end of each part of the view: a weighted mean of even and geometric spacing (Zhang et al. 2006, "practical split scheme").
fn split(start: f32, end: f32, count: u32, geometric: f32) -> Vec<[f32; 2]> {
    let first = start.max(end * 1e-3);
    let at = |i: u32| {
        let t = i as f32 / count as f32;
        let even = start + (end - start) * t;
        let progression = first * (end / first).powf(t);
        even + (progression - even) * geometric
    };
    (0..count).map(|i| [if i == 0 { start } else { at(i) }, if i + 1 == count { end } else { at(i + 1) }]).collect()
}

/// A sphere around the part of the view between two distances. Its radius depends only on the camera's projection.
fn sphere(view: &View, range: [f32; 2]) -> (Vec3, f32) {
    let corner = |uv: Vec2, distance: f32| view.world_from_depth(uv, distance / view.far);
    let near = corner(Vec2::ZERO, range[0]);
    let far = corner(Vec2::ZERO, range[1]);
    let axis = |distance| corner(Vec2::splat(0.5), distance);
    // The point on the axis that is as far from the near corners as from the far ones, but not beyond the far plane.
    let (rn, rf) = (axis(range[0]).distance(near), axis(range[1]).distance(far));
    let length = range[1] - range[0];
    let t = ((length * length + rf * rf - rn * rn) / (2.0 * length.max(1e-9))).clamp(0.0, length);
    let radius = (t * t + rn * rn).max((length - t) * (length - t) + rf * rf).sqrt();
    // The radius is rounded up to a coarse step, so that rounding errors of a moving camera do not change it.
    let step = 2.0_f32.powf(radius.log2().floor() - 6.0);
    (axis(range[0] + t), (radius / step).ceil() * step)
}

/// Position of a world point in a slot, for tests and tools: x and y in −1..1, linear depth 0..1 (`shadow_linear_depth`).
pub fn project(slot: &types::ShadowSlot, world: Vec3) -> Option<Vec3> {
    let clip = Mat4::from_cols_array_2d(&slot.clip_from_world) * world.extend(1.0);
    let ndc = clip.xyz() / clip.w;
    let inside = clip.w > 0.0 && ndc.xy().abs().max_element() <= 1.0 && (0.0..=1.0).contains(&ndc.z);
    inside.then(|| {
        let depth = if slot.perspective != 0 {
            let axis = slot.near * slot.far / (slot.near + ndc.z * (slot.far - slot.near));
            axis * (ndc.xy() * Vec2::from(slot.half_angle)).extend(1.0).length() / slot.far
        } else {
            1.0 - ndc.z
        };
        ndc.xy().extend(depth)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Projection};
    use proptest::prelude::*;

    fn view(at: Vec3, yaw: f32) -> View {
        let projection = Projection::Perspective { yfov: 0.9, aspect: None, znear: 0.1, zfar: Some(80.0) };
        let world = Mat4::from_translation(at) * Mat4::from_rotation_y(yaw);
        View::new(&Camera { name: String::new(), projection }, world, [640, 480])
    }

    fn bounds() -> Aabb {
        Aabb { min: Vec3::new(-60.0, -1.0, -70.0), max: Vec3::new(60.0, 20.0, 70.0) }
    }

    fn light(kind: u32) -> types::Light {
        let direction = Vec3::new(0.3, -1.0, 0.2).normalize().to_array();
        let (spot_scale, spot_offset) =
            if kind == consts::LIGHT_SPOT { (2.0, -2.0 * 0.6_f32.cos()) } else { (0.0, 1.0) };
        types::Light { kind, direction, position: [1.0, 15.0, 2.0], spot_scale, spot_offset, ..Default::default() }
    }

    #[test]
    fn lights_get_maps_in_order_until_none_are_left() {
        use consts::*;
        let mut lights = vec![light(LIGHT_SPOT), light(LIGHT_DIRECTIONAL)];
        lights.extend([light(LIGHT_POINT); 10]);
        lights.push(light(LIGHT_SPOT));
        let got = assign(&lights, &bounds(), &view(Vec3::ZERO, 0.0), &Settings::default(), |_| true);
        let counts: Vec<u32> = got.lights.iter().map(|l| l.count).collect();
        assert_eq!(counts, [1, 4, 6, 6, 6, 6, 6, 6, 6, 6, 6, 0, 1]);
        assert_eq!(got.unshadowed, [11]);
        assert!(got.slots.len() <= MAX_SHADOW_SLOTS as usize);
    }

    #[test]
    fn splits_cover_the_range_without_gaps() {
        for geometric in [0.0, 0.5, 1.0] {
            let parts = split(0.1, 80.0, 4, geometric);
            assert_eq!((parts[0][0], parts[3][1]), (0.1, 80.0));
            assert!(parts.windows(2).all(|w| w[0][1] == w[1][0] && w[0][0] < w[0][1]));
        }
    }

    proptest! {
        #[test]
        fn every_visible_point_has_a_cascade(
            at in [-20.0f32..20.0, 1.0..10.0, -20.0..20.0], yaw in -3.0f32..3.0,
            uv in [0.0f32..1.0, 0.0f32..1.0], z in 0.002f32..1.0, cascades in 1u32..6,
        ) {
            let view = view(at.into(), yaw);
            let point = view.world_from_depth(uv.into(), z);
            let b = bounds();
            prop_assume!(point.cmpge(b.min).all() && point.cmple(b.max).all());
            let settings = Settings { cascades, ..Settings::default() };
            let got = assign(&[light(consts::LIGHT_DIRECTIONAL)], &b, &view, &settings, |_| true);
            prop_assert!(got.slots.iter().any(|s| project(s, point).is_some()), "{point}");
        }

        #[test]
        fn cascades_move_in_whole_texels_and_keep_their_size(step in [-0.3f32..0.3, -0.3..0.3, -0.3..0.3]) {
            let settings = Settings { distance: 30.0, ..Settings::default() };
            let at = |p: Vec3| assign(&[light(consts::LIGHT_DIRECTIONAL)], &bounds(), &view(p, 0.4), &settings, |_| true).slots;
            let (a, b) = (at(Vec3::ZERO), at(step.into()));
            prop_assert_eq!(a.len(), b.len());
            for (a, b) in a.iter().zip(&b) {
                prop_assert_eq!(a.texel, b.texel);
                let (a, b) = (project(a, Vec3::new(0.0, 5.0, -3.0)), project(b, Vec3::new(0.0, 5.0, -3.0)));
                if let (Some(a), Some(b)) = (a, b) {
                    let texels = (b - a).truncate() * 0.5 * settings.size as f32;
                    prop_assert!((texels - texels.round()).abs().max_element() < 0.02, "{texels}");
                }
            }
        }

        #[test]
        fn the_six_faces_see_every_direction_and_agree_on_depth(d in [-1.0f32..1.0, -1.0..1.0, -1.0..1.0]) {
            let d = Vec3::from(d);
            prop_assume!(d.length() > 0.1);
            let light = light(consts::LIGHT_POINT);
            let point = Vec3::from(light.position) + d.normalize() * 10.0;
            let got = assign(&[light], &bounds(), &view(Vec3::ZERO, 0.0), &Settings::default(), |_| true);
            let depths: Vec<f32> = got.slots.iter().filter_map(|s| project(s, point)).map(|p| p.z).collect();
            prop_assert!(!depths.is_empty());
            for depth in depths {
                prop_assert!((depth - 10.0 / got.slots[0].far).abs() < 1e-4, "{depth}");
            }
        }

        #[test]
        fn a_spot_map_holds_its_cone(angle in 0.0f32..0.6, turn in 0.0f32..std::f32::consts::TAU, distance in 0.5f32..20.0) {
            let light = light(consts::LIGHT_SPOT);
            let along = Vec3::from(light.direction);
            let side = glam::Quat::from_axis_angle(along, turn) * along.any_orthonormal_vector();
            let point = Vec3::from(light.position) + (along * angle.cos() + side * angle.sin()) * distance;
            let slot = assign(&[light], &bounds(), &view(Vec3::ZERO, 0.0), &Settings::default(), |_| true).slots[0];
            let place = project(&slot, point);
            prop_assert!(place.is_some_and(|p| p.truncate().abs().max_element() < 0.999), "{place:?}");
        }
    }
}
