//! Camera, lights, sky and global settings of a scene file.

use std::fmt::Write;

use glam::Vec3;
use lucerna::{
    Result,
    image::{self, Format, Layers, WriteOptions},
    scene::{LightKind, Pose, Scene, View, bvh::Bvh},
};

use super::{
    Export, Pov, material,
    text::{FADE, fading, number, parallel, vector},
};

/// Largest side of the sky's image, pixels.
const MAX_SKY: u32 = 4096;

/// `global_settings` with the radiosity block.
pub fn globals(out: &mut String, settings: &Pov) {
    // Light below the bail-out is dropped: POV-Ray's default of 1/255 is meant for 8 bits.
    out.push_str("global_settings {\n  assumed_gamma 1\n  max_trace_level 16\n  adc_bailout 1e-5\n");
    if settings.radiosity {
        let Pov { brightness, pretrace_start, pretrace_end, count, error_bound, recursion_limit, .. } = settings;
        let _ = write!(
            out,
            "  radiosity {{\n    brightness {}\n    pretrace_start {}\n    pretrace_end {}\n    count {count}\n    \
             error_bound {}\n    recursion_limit {recursion_limit}\n  }}\n",
            number(*brightness),
            number(*pretrace_start),
            number(*pretrace_end),
            number(*error_bound)
        );
    }
    out.push_str("}\n#default { finish { ambient 0 } }\n");
}

/// The camera by its vectors: the picture is as wide as `right` and as high as `up` at the end of `direction`.
pub fn camera(out: &mut String, view: &View, units: f32) {
    let [right, up, forward] = view.axes();
    let clip = view.clip_from_view;
    let (width, height) = (2.0 / clip.x_axis.x, 2.0 / clip.y_axis.y);
    let scale = if view.is_orthographic() { units } else { 1.0 };
    let kind = if view.is_orthographic() { "orthographic" } else { "perspective" };
    let _ = writeln!(
        out,
        "camera {{\n  {kind}\n  location {}\n  right {}\n  up {}\n  direction {}\n}}",
        vector(view.position * units),
        vector(right * width * scale),
        vector(up * height * scale),
        vector(forward)
    );
}

/// The environment as a sphere around everything, or black.
pub fn sky(out: &mut String, scene: &Scene, stem: &str, export: &mut Export) -> Result<()> {
    out.push_str("background { color rgb <0,0,0> }\n");
    let Some(environment) = &scene.environment else { return Ok(()) };
    let mean = environment.mean();
    if environment.pixels.iter().all(|p| *p == environment.pixels[0]) {
        let _ = writeln!(out, "sky_sphere {{ pigment {{ color rgb {} }} }}", vector(mean));
    } else {
        // The rotated and scaled sky is resampled to POV-Ray's spherical mapping, so that the file needs no transform.
        let (width, height) = (environment.width.clamp(64, MAX_SKY), environment.height.clamp(32, MAX_SKY / 2));
        let mut pixels = Vec::with_capacity(width as usize * height as usize * 3);
        for y in 0..height {
            for x in 0..width {
                let uv = glam::vec2((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
                pixels.extend(environment.radiance(spherical(uv)).max(Vec3::ZERO).to_array());
            }
        }
        let name = format!("{stem}-sky.hdr");
        let (bytes, _) = image::encode(Format::Hdr, &Layers::rgb(width, height, pixels), &WriteOptions::default())?;
        let _ = writeln!(
            out,
            "sky_sphere {{ pigment {{ image_map {{ hdr \"{name}\" gamma 1.0 map_type 1 interpolate 2 }} }} }}"
        );
        export.images.push((name, bytes));
    }
    export.notes.push("the environment lights surfaces by radiosity only; without radiosity it is only visible".into());
    Ok(())
}

/// Direction that POV-Ray's `map_type 1` shows at `uv` of an image (v = 0 at the top): u runs from +X over +Z.
fn spherical(uv: glam::Vec2) -> Vec3 {
    let (azimuth, polar) = (uv.x * std::f32::consts::TAU, uv.y * std::f32::consts::PI);
    Vec3::new(polar.sin() * azimuth.cos(), polar.cos(), polar.sin() * azimuth.sin())
}

/// Point, spot and directional lights.
pub fn lights(
    out: &mut String,
    scene: &Scene,
    pose: &Pose,
    units: f32,
    (bounds, shadows): ((Vec3, Vec3), bool),
    notes: &mut Vec<String>,
) {
    let shadowless = if shadows { "" } else { " shadowless" };
    let centre = 0.5 * (bounds.0 + bounds.1);
    let radius = (bounds.1 - bounds.0).length().max(1e-3);
    for (node, world) in scene.nodes.iter().zip(&pose.world) {
        let Some(light) = node.light.and_then(|light| scene.lights.get(light as usize)) else { continue };
        let power = light.color * light.intensity;
        let at = world.w_axis.truncate();
        let along = world.transform_vector3(Vec3::NEG_Z).normalize_or(Vec3::NEG_Z);
        let name = if light.name.is_empty() { &node.name } else { &light.name };
        let _ = writeln!(out, "// light: {}", super::text::comment(name));
        if let LightKind::Point { range: Some(_) } | LightKind::Spot { range: Some(_), .. } = light.kind {
            notes.push(format!("light {name:?} is cut off at its range, which POV-Ray cannot: it reaches on there"));
        }
        match light.kind {
            LightKind::Directional => {
                let from = (centre - along * (2.0 * radius)) * units;
                let to = centre * units;
                let color = vector(parallel(power));
                let _ = writeln!(
                    out,
                    "light_source {{ {} color rgb {color}{shadowless} parallel point_at {} }}",
                    vector(from),
                    vector(to)
                );
            }
            LightKind::Point { .. } => faded(out, at * units, fading(power, units), shadowless),
            LightKind::Spot { inner, outer, .. } => {
                faded(out, at * units, fading(power, units), "");
                // The cone is the shadow of a filter around the light.
                if !shadows {
                    notes.push(format!("light {name:?} casts shadows, because its cone is made by a shadow"));
                }
                cone(out, at * units, along, inner, outer);
            }
        }
    }
}

fn faded(out: &mut String, at: Vec3, color: Vec3, more: &str) {
    let (at, color, fade) = (vector(at), vector(color), number(FADE as f32));
    let _ = writeln!(out, "light_source {{ {at} color rgb {color} fade_distance {fade} fade_power 2{more} }}");
}

/// A small filter around a point light that leaves the cone of KHR_lights_punctual: ((cos − cos outer) / (cos inner − cos outer))²,
/// which POV-Ray's own spotlights do not have.
fn cone(out: &mut String, at: Vec3, along: Vec3, inner: f32, outer: f32) {
    let (outer, span) = (outer.cos(), (inner.cos() - outer.cos()).max(1e-3));
    let [x, y, z] = along.to_array().map(number);
    let _ = writeln!(
        out,
        "sphere {{ 0, 0.01 hollow no_image no_reflection no_radiosity\n  pigment {{ function {{ \
         pow(min(1,max(0,((x*({x})+y*({y})+z*({z}))/max(1e-9,sqrt(x*x+y*y+z*z))-({}))/({}))),2) }}\n    \
         color_map {{ [0 color rgbf <0,0,0,1>] [1 color rgbf <1,1,1,1>] }} }}\n  finish {{ ambient 0 diffuse 0 }}\n  \
         translate {}\n}}",
        number(outer),
        number(span),
        vector(at)
    );
}

/// Emissive triangles as patches of lights whose intensity falls with the cosine, as that of a Lambertian source does.
pub fn emitters(
    out: &mut String,
    scene: &Scene,
    pose: &Pose,
    bvh: &Bvh,
    units: f32,
    settings: &Pov,
    notes: &mut Vec<String>,
) {
    let patches = material::patches(scene, pose, bvh, settings.emissive_lights);
    if patches.is_empty() {
        return;
    }
    let shadowless = if settings.shadows { "" } else { " shadowless" };
    for patch in &patches {
        let target = vector((patch.position + patch.normal) * units);
        // tightness 1: attenuation is the cosine, without the smooth edge that lies between radius and falloff.
        let cosine = format!(" spotlight point_at {target} radius 89.99 falloff 90 tightness 1{shadowless}");
        // Off the surface by more than the tolerance of shadow rays, so that the emitter does not shade itself.
        let at = patch.position * units + patch.normal * 2e-3;
        faded(out, at, fading(patch.radiance * patch.area, units), &cosine);
    }
    notes.push(format!("emissive surfaces light as {} point samples with the cosine's falloff", patches.len()));
}
