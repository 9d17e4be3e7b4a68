//! Environments made by code: those that the experiments of the fullsphere irradiance vectors name (Michael 2010, section 5.2).

use super::kit::{fbm, value_noise};
use glam::{Vec2, Vec3, vec2, vec3};
use lucerna::{Error, Result, scene::Environment};
use std::f32::consts::{PI, TAU};

/// Names of [`environment`].
pub const ENVIRONMENTS: [&str; 5] = ["point", "area", "areas", "grove", "dome"];

/// An environment made by code: `point`, one small light; `area`, a white area light; `areas`, a green and a red one; `grove`, sun and sky through leaves,
/// with radiances of which the largest is more than 10,000 times the smallest; `dome`, an even sky above the horizon.
///
/// # Errors
/// `Usage` if there is none of this name.
pub fn environment(name: &str) -> Result<Environment> {
    match name {
        "point" => Ok(point()),
        "area" => Ok(area()),
        "areas" => Ok(areas()),
        "grove" => Ok(grove()),
        "dome" => Ok(dome()),
        _ => {
            let what = format!("there is no built-in environment {name:?}");
            Err(Error::usage(what).help(format!("Built-in environments: {}", ENVIRONMENTS.join(", "))))
        }
    }
}

fn painted(name: &str, width: u32, radiance: impl Fn(Vec3) -> Vec3) -> Environment {
    let height = width / 2;
    let pixel = |i: u32| {
        let azimuth = (((i % width) as f32 + 0.5) / width as f32 - 0.5) * TAU;
        let elevation = (0.5 - ((i / width) as f32 + 0.5) / height as f32) * PI;
        let (sin, cos) = azimuth.sin_cos();
        radiance(vec3(sin * elevation.cos(), elevation.sin(), -cos * elevation.cos()))
    };
    let pixels = (0..width * height).map(pixel).collect();
    Environment { name: name.to_owned(), width, height, pixels, rotation: 0.0, scale: 1.0 }
}

/// A light of half a degree's radius to the upper left behind, 3 W/m² on a plane that faces it.
fn point() -> Environment {
    let to = vec3(-0.55, 0.75, -0.3).normalize();
    let edge = 0.5f32.to_radians().cos();
    let radiance = 3.0 / (TAU * (1.0 - edge));
    painted("point", 1024, |d| if d.dot(to) > edge { Vec3::splat(radiance) } else { Vec3::ZERO })
}

/// A rectangle of light: its middle, half its width and height as tangents.
fn inside(d: Vec3, middle: Vec3, half: Vec2) -> bool {
    let axis = middle.normalize();
    let right = axis.cross(Vec3::Y).normalize();
    let up = right.cross(axis);
    let along = d.dot(axis);
    along > 0.0 && (d.dot(right) / along).abs() < half.x && (d.dot(up) / along).abs() < half.y
}

/// A square light of 33° to the left, 3 W/m² on a plane that faces it.
fn area() -> Environment {
    painted("area", 512, |d| Vec3::splat(9.5) * f32::from(inside(d, vec3(-0.8, 0.75, -0.2), vec2(0.3, 0.3))))
}

fn areas() -> Environment {
    painted("areas", 512, |d| {
        let green = inside(d, vec3(-0.8, 0.75, -0.2), vec2(0.3, 0.3));
        let red = inside(d, vec3(0.7, 0.8, 0.35), vec2(0.3, 0.3));
        vec3(0.25, 6.0, 0.4) * f32::from(green) + vec3(6.0, 0.3, 0.25) * f32::from(red)
    })
}

/// A sky of the same radiance everywhere, π W/m² on a plane that faces up.
fn dome() -> Environment {
    painted("dome", 512, |d| Vec3::splat(f32::from(d.y > 0.0)))
}

pub(super) fn grove() -> Environment {
    let sun = vec3(0.45, 0.72, -0.35).normalize();
    painted("grove", 1024, |d| {
        // Distance from the sun as an angle, degrees.
        let off = d.dot(sun).clamp(-1.0, 1.0).acos().to_degrees();
        let glow = 6.0 * (-off / 6.0).exp() + 1.5 * (-off / 25.0).exp();
        let sky = vec3(0.35, 0.55, 0.95).lerp(vec3(0.9, 0.95, 1.0), (1.0 - d.y).clamp(0.0, 1.0).powi(3))
            + glow * vec3(1.0, 0.95, 0.8);
        let disc = if off < 0.6 { vec3(9000.0, 8200.0, 6500.0) } else { Vec3::ZERO };
        if d.y < -0.02 {
            let patch = 0.5 + fbm(vec2(d.x, d.z) / -d.y.min(-0.05) * 1.3, 64, 4, 91);
            return vec3(0.10, 0.09, 0.05) * patch.max(0.1);
        }
        // Crowns: dense near the horizon, with holes of all sizes overhead.
        // Sixteen cells around, so that there is no seam.
        let at = vec2((d.x.atan2(-d.z) / TAU + 0.5) * 16.0, d.y * 5.0 + 4.0);
        let crowns = fbm(at, 16, 5, 17) + 0.35 * value_noise(at * 6.0, 96, 23);
        let dense = 0.5 + 0.45 * (1.0 - d.y).powi(2);
        if crowns < dense {
            let lit = 0.4 + 1.2 * value_noise(at * 14.0, 224, 5).abs() + 0.15 * glow;
            return vec3(0.05, 0.085, 0.018) * lit;
        }
        sky + disc
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_what_it_is_called() {
        for name in ENVIRONMENTS {
            let env = environment(name).unwrap();
            assert_eq!((env.name.as_str(), env.pixels.len() as u32), (name, env.width * env.height));
            assert!(env.pixels.iter().all(|p| p.is_finite() && p.min_element() >= 0.0), "{name}");
        }
        // Half of all directions.
        assert!((environment("dome").unwrap().mean() - 0.5).abs().max_element() < 1e-3);
        assert!(environment("moon").unwrap_err().to_string().contains("point, area, areas, grove, dome"));
        // Irradiance of the small light, facing it: radiance times solid angle.
        let point = environment("point").unwrap();
        let power = point.mean().y * 4.0 * PI;
        assert!((power / 3.0 - 1.0).abs() < 0.15, "{power}");
        let area = environment("area").unwrap().mean().y * 4.0 * PI;
        assert!((area / 3.0 - 1.0).abs() < 0.1, "{area}");
        let areas = environment("areas").unwrap().mean();
        assert!((areas.x / areas.y - 1.0).abs() < 0.1 && areas.z < 0.2 * areas.x, "{areas}");
        let grove = environment("grove").unwrap();
        let light = |p: &Vec3| p.element_sum();
        let (low, high) = grove.pixels.iter().map(light).fold((f32::MAX, 0.0f32), |(l, h), v| (l.min(v), h.max(v)));
        assert!(high > 1e4 * low && low > 0.0, "{low} to {high}");
        let open = grove.pixels[..512 * 512].iter().filter(|p| p.z > 0.3).count() as f32 / (512.0 * 512.0);
        assert!((0.15..0.75).contains(&open), "{open} of the upper half is open");
    }
}
