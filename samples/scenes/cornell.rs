//! The Cornell box.
//!
//! Geometry, reflectance spectra, emission spectrum and camera are those that the Cornell University Program of
//! Computer Graphics measured and published ("Cornell Box Data", graphics.cornell.edu/online/box/data.html; the box of
//! Goral, Torrance, Greenberg and Battaile 1984 in its later form). Published millimetres become metres, axes stay: the
//! camera looks along +Z, so that x grows to the left. Spectra become linear Rec. 709 by [`reflectance`] and
//! [`emission`].
//!
//! Walls are sheets as published; the ceiling has the published lamp's rectangle cut out so that the lamp, which lies in
//! its plane, does not overlap it.

use super::kit::{Geometry, Model, Stage};
use glam::{Vec3, vec3};
use lucerna::scene::{Camera, Material, Node, Projection, Scene};

mod spectra;

pub use spectra::{GREEN, RED, WHITE, emission, reflectance};

/// Corners of the floor, millimetres.
pub const FLOOR: [[f32; 3]; 4] = [[552.8, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 559.2], [549.6, 0.0, 559.2]];
/// Corners of the lamp, millimetres.
pub const LIGHT: [[f32; 3]; 4] =
    [[343.0, 548.8, 227.0], [343.0, 548.8, 332.0], [213.0, 548.8, 332.0], [213.0, 548.8, 227.0]];
/// Corners of the ceiling, millimetres.
pub const CEILING: [[f32; 3]; 4] = [[556.0, 548.8, 0.0], [556.0, 548.8, 559.2], [0.0, 548.8, 559.2], [0.0, 548.8, 0.0]];
/// Corners of the back wall, millimetres.
pub const BACK: [[f32; 3]; 4] = [[549.6, 0.0, 559.2], [0.0, 0.0, 559.2], [0.0, 548.8, 559.2], [556.0, 548.8, 559.2]];
/// Corners of the right wall (green), millimetres.
pub const RIGHT: [[f32; 3]; 4] = [[0.0, 0.0, 559.2], [0.0, 0.0, 0.0], [0.0, 548.8, 0.0], [0.0, 548.8, 559.2]];
/// Corners of the left wall (red), millimetres.
pub const LEFT: [[f32; 3]; 4] = [[552.8, 0.0, 0.0], [549.6, 0.0, 559.2], [556.0, 548.8, 559.2], [556.0, 548.8, 0.0]];
/// Upper corners of the short block, millimetres; it stands on the floor.
pub const SHORT_BLOCK: [[f32; 3]; 4] =
    [[130.0, 165.0, 65.0], [82.0, 165.0, 225.0], [240.0, 165.0, 272.0], [290.0, 165.0, 114.0]];
/// Upper corners of the tall block, millimetres; it stands on the floor.
pub const TALL_BLOCK: [[f32; 3]; 4] =
    [[423.0, 330.0, 247.0], [265.0, 330.0, 296.0], [314.0, 330.0, 456.0], [472.0, 330.0, 406.0]];
/// Camera position, millimetres; it looks along +Z with +Y up.
pub const CAMERA: [f32; 3] = [278.0, 273.0, -800.0];
/// Focal length and side of the square film, metres.
pub const FILM: (f32, f32) = (0.035, 0.025);

/// Where the stand-in hangs: metres below the centre of the lamp.
pub const SPOT_DROP: f32 = 0.02;
/// Outer angle of the stand-in's cone, degrees from its axis. A shadow map cannot see 90°.
pub const SPOT_OUTER: f32 = 80.0;

/// The box lit by a spot light that stands in for the lamp, so that techniques without area lights show the box too.
///
/// The spot hangs [`SPOT_DROP`] below the lamp's centre and shines down. Its axial intensity is the lamp's (radiance ·
/// area), and its inner angle is chosen so that its flux under glTF's squared ramp is the flux π · radiance · area of
/// the Lambertian lamp as well: with c the cosines of both angles, 1 − 2/3·c_inner − 1/3·c_outer = 1/2. The lamp's
/// rectangle glows where it is, but as an unlit pane, which casts no light: nothing is counted twice.
pub(super) fn build() -> Scene {
    let (mut stage, lamp) = room("cornell");
    let shown = stage.material(Material { unlit: true, ..Material::diffuse("light", Vec3::ONE) });
    stage.add("light", Model::of(shown, lamp));
    let [a, b, c, d] = LIGHT.map(metres);
    let intensity = emission() * (b - a).length() * (d - a).length();
    let peak = intensity.max_element();
    let place = (a + c) * 0.5 - Vec3::Y * SPOT_DROP;
    let inner = (0.75 - 0.5 * SPOT_OUTER.to_radians().cos()).acos().to_degrees();
    let way = (place.to_array(), [place.x, 0.0, place.z]);
    stage.spot("light", way, intensity / peak, peak, (inner, SPOT_OUTER));
    stage.finish()
}

/// The box with its lamp as published: an emissive rectangle, for techniques that serve area lights.
pub(super) fn build_area() -> Scene {
    let (mut stage, lamp) = room("cornell-area");
    let light = stage.material(Material::emitter("light", emission()));
    stage.add("light", Model::of(light, lamp));
    stage.finish()
}

/// Everything except the lamp, and the lamp's rectangle.
fn room(name: &str) -> (Stage, Geometry) {
    let mut stage = Stage::new(name);
    let white = stage.material(Material::diffuse("white", reflectance(&WHITE)));
    let green = stage.material(Material::diffuse("green", reflectance(&GREEN)));
    let red = stage.material(Material::diffuse("red", reflectance(&RED)));
    let sheet = |corners: [[f32; 3]; 4]| {
        let mut geometry = Geometry::default();
        geometry.flat_quad(corners.map(metres));
        geometry
    };
    stage.add("floor", Model::of(white, sheet(FLOOR)));
    stage.add("ceiling", Model::of(white, ceiling()));
    stage.add("back wall", Model::of(white, sheet(BACK)));
    stage.add("right wall", Model::of(green, sheet(RIGHT)));
    stage.add("left wall", Model::of(red, sheet(LEFT)));
    stage.add("short block", Model::of(white, block(SHORT_BLOCK)));
    stage.add("tall block", Model::of(white, block(TALL_BLOCK)));

    // The published film is square; only its height is kept, so that any image shows the published height.
    let yfov = 2.0 * (FILM.1 * 0.5 / FILM.0).atan();
    let projection = Projection::Perspective { yfov, aspect: None, znear: 0.05, zfar: Some(10.0) };
    stage.scene.cameras.push(Camera { name: "front".to_owned(), projection });
    let eye = metres(CAMERA);
    let local = super::kit::looking(eye, eye + Vec3::Z);
    stage.node(Node { name: "front".to_owned(), local, camera: Some(0), ..Node::default() });
    stage.camera("red corner", [0.1, 0.33, 0.06], [0.5, 0.17, 0.45], 62.0);
    stage.camera("green corner", [0.52, 0.4, 0.04], [0.16, 0.14, 0.42], 58.0);
    stage.camera("between the blocks", [0.46, 0.09, -0.2], [0.22, 0.17, 0.4], 56.0);
    (stage, sheet(LIGHT))
}

/// The ceiling around the lamp: four quads that meet at the lamp's corners and share every edge.
fn ceiling() -> Geometry {
    let (outer, inner) = (CEILING.map(metres), LIGHT.map(metres));
    let mut geometry = Geometry::default();
    for i in 0..4 {
        let j = (i + 1) % 4;
        geometry.flat_quad([outer[i], outer[j], inner[j], inner[i]]);
    }
    geometry
}

/// A closed block from its upper corners down to the floor.
fn block(top: [[f32; 3]; 4]) -> Geometry {
    let top = top.map(metres);
    let foot = top.map(|p| vec3(p.x, 0.0, p.z));
    let mut geometry = Geometry::default();
    geometry.flat_quad(top);
    geometry.flat_quad([foot[3], foot[2], foot[1], foot[0]]);
    for i in 0..4 {
        let j = (i + 1) % 4;
        geometry.flat_quad([foot[i], foot[j], top[j], top[i]]);
    }
    geometry
}

fn metres(millimetres: [f32; 3]) -> Vec3 {
    Vec3::from(millimetres) / 1000.0
}
