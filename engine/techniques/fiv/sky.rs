//! An environment as a cube map of texels of constant radiance, with exact solid angles.
//!
//! The order of texels is that of [`scene::environment::Face`](crate::scene::environment::Face): face after face, the
//! top row first.
//!
//! Invalid radiance is repaired: NaN and negative values become 0, and infinite values become 65504, the largest 16-bit
//! float, as when files are read. [`Sky::repaired`] counts the repaired pixels.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, Vec3};

use crate::{Error, Result, scene::Environment, shaders::types};

/// The value that replaces infinite radiance.
const LARGEST: f64 = 65504.0;
/// Texels along an edge that are allowed.
pub const SIDES: std::ops::RangeInclusive<u32> = 8..=128;
/// Least share of all light that a separated texel sends.
const APART: f64 = 0.01;
/// Least number of wedges of azimuth, in addition to the edges of pixels and texels.
const WEDGES: u32 = 1024;

/// An environment as a cube.
#[derive(Clone, Debug, PartialEq)]
pub struct Sky {
    /// Texels along an edge.
    pub size: u32,
    /// Mean radiance of each of 6·size² texels, W/(sr·m²).
    pub radiance: Vec<Vec3>,
    /// Separated texels. They are black in `radiance`.
    pub suns: Vec<Sun>,
    /// Number of repaired pixels of the source.
    pub repaired: u64,
}

/// A separated bright texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    pub texel: u32,
    /// W/(sr·m²)
    pub radiance: Vec3,
}

/// The light of an environment in each texel, without its scale.
#[derive(Clone, Debug)]
pub(super) struct Sums {
    /// Texels along an edge.
    pub size: u32,
    /// Radiance × solid angle of the source, W/m², and solid angle, steradians.
    pub texels: Vec<(DVec3, f64)>,
    /// Number of repaired pixels of the source.
    pub repaired: u64,
}

impl Sums {
    /// Sums up the light of an environment with the rotation `rotation` (radians) instead of its own.
    ///
    /// # Errors
    /// As [`Sky::new`].
    pub fn of(environment: Option<&Environment>, rotation: f32, size: u32) -> Result<Self> {
        if !SIDES.contains(&size) || !size.is_multiple_of(8) {
            let what =
                format!("{size} is not allowed; allowed: multiples of 8 from {} to {}", SIDES.start(), SIDES.end());
            return Err(Error::usage(what).at("size"));
        }
        let texels = 6 * size as usize * size as usize;
        let Some(env) = environment.filter(|e| !e.pixels.is_empty()) else {
            return Ok(Self { size, texels: vec![(DVec3::ZERO, 0.0); texels], repaired: 0 });
        };
        usable(env, rotation, 1.0)?;
        let mut repaired = 0;
        let pixels: Vec<DVec3> = env
            .pixels
            .iter()
            .map(|pixel| {
                let (light, odd) = clean(*pixel);
                repaired += u64::from(odd);
                light
            })
            .collect();
        let mut texels = vec![(DVec3::ZERO, 0.0); texels];
        let rotation = f64::from(rotation);
        for (begin, end) in wedges(env.width, rotation, size) {
            wedge(&mut texels, (env, rotation), &pixels, size, begin, end);
        }
        Ok(Self { size, texels, repaired })
    }

    /// The cube map with `scale` as a factor on the light.
    pub fn sky(&self, scale: f32) -> Sky {
        let scale = f64::from(scale);
        let mean =
            |(sum, weight): &(DVec3, f64)| (*sum * (scale / weight.max(1e-30))).min(DVec3::splat(1e30)).as_vec3();
        let radiance = self.texels.iter().map(mean).collect();
        Sky { size: self.size, radiance, suns: Vec::new(), repaired: self.repaired }
    }
}

/// The repaired radiance of a pixel, and whether the pixel needed repair.
pub(super) fn clean(pixel: Vec3) -> (DVec3, bool) {
    let channels = pixel.to_array().map(|value| match value {
        f32::INFINITY => (LARGEST, true),
        _ if value >= 0.0 => (f64::from(value).min(1e30), false),
        _ => (0.0, true),
    });
    (DVec3::from_array(channels.map(|c| c.0)), channels.iter().any(|c| c.1))
}

/// Checks that an environment can be resampled with this rotation (radians) and this scale.
///
/// # Errors
/// `Input`, naming the environment.
pub(super) fn usable(env: &Environment, rotation: f32, scale: f32) -> Result<()> {
    let place = |error: Error| error.at(format!("environment `{}`", env.name));
    if env.pixels.len() as u64 != u64::from(env.width) * u64::from(env.height) {
        let what = format!("{} pixels for {}×{}", env.pixels.len(), env.width, env.height);
        return Err(place(Error::input(what)));
    }
    if !(scale.is_finite() && scale >= 0.0 && rotation.is_finite()) {
        let what = format!("a scale of {scale} and a rotation of {rotation} cannot be used");
        return Err(place(
            Error::input(what)
                .help("The scale must be a finite number from 0, the rotation a finite number in radians"),
        ));
    }
    Ok(())
}

impl Sky {
    /// Resamples an environment with its rotation and scale. Each texel gets the mean radiance of the pixels that it
    /// overlaps, weighted by the solid angle of each overlap. Pixels have constant radiance. `None` gives a black cube
    /// map.
    ///
    /// # Errors
    /// `Usage` if `size` is not a multiple of 8 in [`SIDES`]; `Input` if the environment has no numbers that can be used.
    pub fn new(environment: Option<&Environment>, size: u32) -> Result<Self> {
        Self::changed(environment, (0.0, 1.0), size)
    }

    /// As [`Self::new`], with an additional rotation (radians) and scale.
    fn changed(environment: Option<&Environment>, (turn, factor): (f32, f32), size: u32) -> Result<Self> {
        let (rotation, scale) = environment.map_or((turn, factor), |e| (e.rotation + turn, e.scale * factor));
        if let Some(environment) = environment.filter(|e| !e.pixels.is_empty()) {
            usable(environment, rotation, scale)?;
        }
        Ok(Sums::of(environment, rotation, size)?.sky(scale))
    }

    /// As [`Self::new`], with the size, the rotation and the exposure of `settings`.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of(environment: Option<&Environment>, settings: &super::Settings) -> Result<Self> {
        let sky = Self::changed(environment, settings.light(), settings.size)?;
        Ok(sky.apart(settings.apart()))
    }

    /// Separates the brightest texels, at most `most`. Only texels that send at least a hundredth of all light each are
    /// separated.
    #[must_use]
    pub fn apart(mut self, most: u32) -> Self {
        if most == 0 {
            return self;
        }
        let power = |i: u32| {
            let (_, x, y) = place(self.size, i);
            self.radiance[i as usize].as_dvec3().element_sum() * solid_angle(self.size, x, y)
        };
        let mut powers: Vec<(u32, f64)> = (0..self.radiance.len() as u32).map(|i| (i, power(i))).collect();
        let least = APART * powers.iter().map(|p| p.1).sum::<f64>();
        powers.retain(|p| p.1 > 0.0 && p.1 >= least);
        powers.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        for (texel, _) in powers.into_iter().take(most as usize) {
            let radiance = std::mem::take(&mut self.radiance[texel as usize]);
            self.suns.push(Sun { texel, radiance });
        }
        self
    }

    /// The texels in the form that shaders read.
    pub fn texels(&self) -> Vec<types::FivTexel> {
        let texel = |(i, radiance): (usize, &Vec3)| {
            let (face, x, y) = place(self.size, i as u32);
            types::FivTexel {
                radiance: radiance.to_array(),
                angle: solid_angle(self.size, x, y) as f32,
                area: area(face, self.size, x, y).as_vec3().to_array(),
            }
        };
        self.radiance.iter().enumerate().map(texel).collect()
    }

    /// Numbers of the texels that are neither black nor separated.
    pub fn lit(&self) -> Vec<u32> {
        (0..self.radiance.len() as u32).filter(|i| self.radiance[*i as usize] != Vec3::ZERO).collect()
    }

    /// A hash of the light, by which files of vectors identify their environment.
    pub fn hash(&self) -> u64 {
        let mut hash = super::hash::Hash::new();
        hash.word(self.size.into());
        self.radiance.iter().for_each(|r| hash.floats(&r.to_array()));
        for sun in &self.suns {
            hash.word(sun.texel.into());
            hash.floats(&sun.radiance.to_array());
        }
        hash.finish()
    }
}

/// Face, column and row of a texel.
pub fn place(size: u32, texel: u32) -> (u32, u32, u32) {
    let in_face = texel % (size * size);
    (texel / (size * size), in_face % size, in_face / size)
}

/// Direction (not normalised) of a point of a face, `st` in [0, 1]² from its top left corner.
pub fn direction(face: u32, st: DVec2) -> DVec3 {
    let p = 2.0 * st - 1.0;
    match face {
        0 => DVec3::new(1.0, -p.y, p.x),
        1 => DVec3::new(-1.0, -p.y, -p.x),
        2 => DVec3::new(p.x, 1.0, -p.y),
        3 => DVec3::new(p.x, -1.0, p.y),
        4 => DVec3::new(p.x, -p.y, -1.0),
        _ => DVec3::new(-p.x, -p.y, 1.0),
    }
}

/// The texel that contains a direction.
pub fn texel(size: u32, d: DVec3) -> u32 {
    let a = d.abs();
    let (face, depth) = if a.x >= a.y && a.x >= a.z {
        (u32::from(d.x < 0.0), a.x)
    } else if a.y >= a.z {
        (2 + u32::from(d.y < 0.0), a.y)
    } else {
        (4 + u32::from(d.z >= 0.0), a.z)
    };
    let p = match face {
        0 => DVec2::new(d.z, -d.y),
        1 => DVec2::new(-d.z, -d.y),
        2 => DVec2::new(d.x, -d.z),
        3 => DVec2::new(d.x, d.z),
        4 => DVec2::new(d.x, -d.y),
        _ => DVec2::new(-d.x, -d.y),
    };
    let at = ((p / depth + 1.0) * (0.5 * f64::from(size))).clamp(DVec2::ZERO, DVec2::splat(f64::from(size - 1)));
    (face * size + at.y as u32) * size + at.x as u32
}

/// Solid angle of a texel, steradians: exact differences of atan(xy / √(x² + y² + 1)).
pub fn solid_angle(size: u32, x: u32, y: u32) -> f64 {
    let bound = |i: u32| 2.0 * f64::from(i) / f64::from(size) - 1.0;
    let corner = |x: f64, y: f64| (x * y).atan2((x * x + y * y + 1.0).sqrt());
    let ([x0, x1], [y0, y1]) = ([bound(x), bound(x + 1)], [bound(y), bound(y + 1)]);
    corner(x0, y0) - corner(x0, y1) - corner(x1, y0) + corner(x1, y1)
}

/// Integral of the direction over a texel, steradians: exact, by Lambert's formula for a polygon.
pub fn area(face: u32, size: u32, x: u32, y: u32) -> DVec3 {
    let corner = |dx: u32, dy: u32| direction(face, DVec2::new((x + dx).into(), (y + dy).into()) / f64::from(size));
    let corners = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
    let mut sum = DVec3::ZERO;
    for (a, b) in (0..4).map(|i| (corners[i], corners[(i + 1) % 4])) {
        let cross = a.cross(b);
        let length = cross.length();
        sum += cross * (length.atan2(a.dot(b)) / length);
    }
    if sum.dot(corners[0]) < 0.0 { -0.5 * sum } else { 0.5 * sum }
}

/// Intervals of azimuth (0 over −Z, π/2 over +X), cut at every edge of a pixel and of a column of texels.
pub(super) fn wedges(width: u32, rotation: f64, size: u32) -> Vec<(f64, f64)> {
    let mut cuts: Vec<f64> = (0..WEDGES).map(|i| TAU * f64::from(i) / f64::from(WEDGES)).collect();
    cuts.extend((0..width).map(|c| TAU * (f64::from(c) / f64::from(width) - 0.5) - rotation));
    for column in 0..size {
        let angle = (2.0 * f64::from(column) / f64::from(size) - 1.0).atan();
        cuts.extend((0..4).map(|side| angle + 0.5 * PI * f64::from(side)));
    }
    cuts.iter_mut().for_each(|a| *a = a.rem_euclid(TAU));
    cuts.sort_by(f64::total_cmp);
    let ends = cuts.iter().skip(1).copied().chain([TAU + cuts[0]]).collect::<Vec<_>>();
    cuts.into_iter().zip(ends).filter(|(begin, end)| end - begin > 1e-12).collect()
}

/// Adds the light between two azimuths. The sum is exact along the meridian in the middle. It is taken over sines of
/// the latitude, because equal differences of the sine have equal areas.
fn wedge(
    sums: &mut [(DVec3, f64)],
    (env, rotation): (&Environment, f64),
    pixels: &[DVec3],
    size: u32,
    begin: f64,
    end: f64,
) {
    let middle = 0.5 * (begin + end);
    let (x, z) = (middle.sin(), -middle.cos());
    let (width, height) = (env.width as usize, env.height as usize);
    let u = ((middle + rotation) / TAU + 0.5).rem_euclid(1.0);
    let column = ((u * width as f64) as usize).min(width - 1);
    let mut cuts = vec![1.0, -1.0];
    cuts.extend((1..height).map(|row| (PI * row as f64 / height as f64).cos()));
    cuts.extend(rows(x, z, size));
    cuts.sort_by(f64::total_cmp);
    for pair in cuts.windows(2).filter(|p| p[1] > p[0]) {
        let sine = 0.5 * (pair[0] + pair[1]);
        let cosine = (1.0 - sine * sine).max(0.0).sqrt();
        let row = ((sine.acos() / PI * height as f64) as usize).min(height - 1);
        let (sum, weight) = &mut sums[texel(size, DVec3::new(x * cosine, sine, z * cosine)) as usize];
        let angle = (end - begin) * (pair[1] - pair[0]);
        *sum += pixels[row * width + column] * angle;
        *weight += angle;
    }
}

/// Sines of the latitudes at which the meridian over (x, z), a unit vector, crosses edges of texel rows, unsorted.
pub(super) fn rows(x: f64, z: f64, size: u32) -> Vec<f64> {
    let mut cuts = Vec::new();
    // On the side faces a row of texels ends at a height over the plane at distance one.
    let reach = x.abs().max(z.abs());
    for row in 0..=size {
        let edge = 2.0 * f64::from(row) / f64::from(size) - 1.0;
        let height = edge * reach;
        cuts.push(height / (1.0 + height * height).sqrt());
        // On the caps the meridian is a straight line from the middle.
        for run in [edge / x, edge / z].into_iter().filter(|r| *r > 0.0 && *r < 1.0 / reach) {
            let sine = 1.0 / (1.0 + run * run).sqrt();
            cuts.extend([sine, -sine]);
        }
    }
    cuts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texels(size: u32) -> impl Iterator<Item = (u32, u32, u32)> {
        (0..6 * size * size).map(move |i| place(size, i))
    }

    /// A latitude-longitude picture of a function of the direction.
    fn painted(width: u32, light: impl Fn(DVec3) -> Vec3) -> Environment {
        let height = width / 2;
        let at = |i: u32| {
            let (azimuth, polar) = (
                TAU * ((f64::from(i % width) + 0.5) / f64::from(width) - 0.5),
                PI * (f64::from(i / width) + 0.5) / f64::from(height),
            );
            light(DVec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos()))
        };
        let pixels = (0..width * height).map(at).collect();
        Environment { width, height, pixels, ..Environment::constant(Vec3::ZERO) }
    }

    fn power(sky: &Sky) -> DVec3 {
        texels(sky.size).zip(&sky.radiance).map(|((_, x, y), r)| r.as_dvec3() * solid_angle(sky.size, x, y)).sum()
    }

    #[test]
    fn texels_cover_the_sphere_once_and_their_vectors_cancel() {
        for size in [8, 32] {
            let angle: f64 = texels(size).map(|(_, x, y)| solid_angle(size, x, y)).sum();
            assert!((angle - 4.0 * PI).abs() < 1e-12, "{angle}");
            let sum: DVec3 = texels(size).map(|(f, x, y)| area(f, size, x, y)).sum();
            assert!(sum.length() < 1e-12, "{sum}");
            // A whole face has a vector along its axis, and the sum over texels does not depend on their number.
            let face: DVec3 = texels(size).filter(|t| t.0 == 2).map(|(f, x, y)| area(f, size, x, y)).sum();
            assert!((face - area(2, 1, 0, 0)).length() < 1e-12 && face.x.abs() < 1e-12, "{face}");
            for (i, (face, x, y)) in texels(size).enumerate() {
                let middle = direction(face, (DVec2::new(x.into(), y.into()) + 0.5) / f64::from(size));
                assert_eq!(texel(size, middle), i as u32);
                let v = area(face, size, x, y);
                let angle = solid_angle(size, x, y);
                assert!(v.length() < angle && v.length() > 0.99 * angle);
                assert!(v.normalize().dot(middle.normalize()) > 0.9999);
            }
        }
    }

    #[test]
    fn faces_are_those_of_the_scene() {
        use crate::scene::environment::Face;
        use glam::Vec2;
        for (number, face) in Face::ALL.into_iter().enumerate() {
            for st in [Vec2::new(0.1, 0.7), Vec2::new(0.9, 0.2)] {
                let ours = direction(number as u32, st.as_dvec2());
                assert!((ours.as_vec3() - face.direction(st)).length() < 1e-6, "{face:?}");
            }
        }
    }

    #[test]
    fn even_light_stays_even_and_power_is_kept() {
        for (width, rotation) in [(2, 0.0), (37 * 2, 0.3), (256, -2.0)] {
            let even = Environment { rotation, scale: 2.0, ..painted(width, |_| Vec3::new(1.0, 0.5, 3.0)) };
            let sky = Sky::new(Some(&even), 16).unwrap();
            for r in &sky.radiance {
                assert!((*r - Vec3::new(2.0, 1.0, 6.0)).length() < 1e-6, "{r}");
            }
            assert_eq!(sky.repaired, 0);
        }
        // The power of a single bright pixel is kept wherever it lies.
        for (x, y) in [(0, 0), (63, 31), (17, 3), (40, 16), (5, 30)] {
            let mut one = painted(64, |_| Vec3::ZERO);
            one.pixels[y * 64 + x] = Vec3::new(100.0, 1.0, 0.0);
            one.rotation = 0.7;
            let exact = 100.0 * crate::scene::environment::solid_angle(64, 32, y as u32);
            let found = power(&Sky::new(Some(&one), 32).unwrap()).x;
            assert!((found / exact - 1.0).abs() < 1e-3, "{x} {y}: {found} instead of {exact}");
        }
    }

    #[test]
    fn light_comes_from_where_the_picture_has_it() {
        // The environment's own lookup, with its rotation, is the witness.
        let env = Environment {
            rotation: 1.1,
            ..painted(512, |d| Vec3::new(1.0 + d.x as f32, 1.0 + d.y as f32, 1.0 + d.z as f32))
        };
        let sky = Sky::new(Some(&env), 32).unwrap();
        for (i, (face, x, y)) in texels(32).enumerate() {
            let middle = direction(face, (DVec2::new(x.into(), y.into()) + 0.5) / 32.0).as_vec3().normalize();
            let (found, witness) = (sky.radiance[i], env.radiance(middle));
            assert!((found - witness).length() < 4e-3, "{face} {x} {y}: {found} instead of {witness}");
        }
    }

    #[test]
    fn odd_values_are_counted_and_wrong_ones_refused() {
        let mut odd = painted(16, |_| Vec3::ONE);
        odd.pixels[0] = Vec3::new(f32::NAN, 1.0, 1.0);
        odd.pixels[1] = Vec3::new(f32::INFINITY, f32::NEG_INFINITY, -3.0);
        let sky = Sky::new(Some(&odd), 8).unwrap();
        assert_eq!(sky.repaired, 2);
        assert!(sky.radiance.iter().all(|r| r.is_finite() && r.min_element() >= 0.0));
        assert!(sky.radiance.iter().any(|r| r.x > 10.0));
        let black = Sky::new(None, 8).unwrap();
        assert!(black.radiance.iter().all(|r| *r == Vec3::ZERO) && black.lit().is_empty());
        for size in [0, 4, 20, 136] {
            let error = Sky::new(None, size).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains("multiples of 8"), "{error}");
        }
        for (scale, rotation) in [(f32::NAN, 0.0), (-1.0, 0.0), (1.0, f32::INFINITY)] {
            let wrong = Environment { scale, rotation, ..painted(16, |_| Vec3::ONE) };
            assert_eq!(Sky::new(Some(&wrong), 8).unwrap_err().exit_code(), 3);
        }
        let short = Environment { pixels: vec![Vec3::ONE; 3], ..painted(16, |_| Vec3::ONE) };
        assert!(Sky::new(Some(&short), 8).unwrap_err().to_string().contains("3 pixels for 16×8"));
    }
}
