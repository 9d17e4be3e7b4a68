//! Bakes for a camera that turns in place: the surfaces around one point in six faces.
//!
//! The faces lie beside each other in one picture: +X, -X, +Y, -Y, +Z, -Z. A face is what a camera with a square picture of 90° sees. Columns and
//! rows of the faces follow the directions of [`AXES`]. A pixel finds its light by its direction from the camera
//! (`shaders-glsl/daylight/cube.glsl`).

use glam::{Mat4, Vec2, Vec3};

use super::{Kind, Plan};
use crate::{
    Error, Result,
    gpu::{BufferDesc, Gpu, OwnedBuffer},
    graph::{Graph, Runner},
    passes::gbuffer,
    resident::Resident,
    scene::{Camera, Pose, Projection, Scene, View},
    shaders::{daylight::around, types},
};

/// Faces of a cube.
pub const FACES: u32 = 6;
/// Largest side of a face, texels.
pub const MOST_SIDE: u32 = 4096;
/// How far the camera may be from the place of the bake, as a share of its distance from the origin, and at least in metres.
const APART: f32 = 1e-4;

/// Forward, right and down of each face.
pub const AXES: [[Vec3; 3]; 6] = [
    [Vec3::X, Vec3::Z, Vec3::NEG_Y],
    [Vec3::NEG_X, Vec3::NEG_Z, Vec3::NEG_Y],
    [Vec3::Y, Vec3::X, Vec3::NEG_Z],
    [Vec3::NEG_Y, Vec3::X, Vec3::Z],
    [Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y],
    [Vec3::NEG_Z, Vec3::X, Vec3::NEG_Y],
];

/// The views of the six faces of `side`×`side` texels from a point. `near`: nearest distance along the axis of a face that is seen, metres.
pub fn views(position: Vec3, near: f32, side: u32) -> [View; 6] {
    AXES.map(|[forward, right, down]| {
        let world_from_camera =
            Mat4::from_cols(right.extend(0.0), (-down).extend(0.0), (-forward).extend(0.0), position.extend(1.0));
        let projection =
            Projection::Perspective { yfov: std::f32::consts::FRAC_PI_2, aspect: None, znear: near, zfar: None };
        View::new(&Camera { name: String::new(), projection }, world_from_camera, [side; 2])
    })
}

/// The face in a direction (any length), and the place on it: 0 to 1, to the right and downwards. Twin: `day_cube_face`.
pub fn face(direction: Vec3) -> (usize, Vec2) {
    let size = direction.abs();
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let face = 2 * axis + usize::from(direction[axis] < 0.0);
    let [forward, right, down] = AXES[face];
    let depth = direction.dot(forward);
    (face, 0.5 + 0.5 * Vec2::new(direction.dot(right), direction.dot(down)) / depth)
}

/// The direction through a place on a face; not of length 1.
pub fn direction(face: usize, place: Vec2) -> Vec3 {
    let [forward, right, down] = AXES[face];
    forward + (2.0 * place.x - 1.0) * right + (2.0 * place.y - 1.0) * down
}

/// Column, row and face of a texel that may be one step beyond the border of a face of `side` texels, where the next face begins; `None`: three
/// faces meet there, so that there is no such texel. Twin: `day_cube_texel`.
pub fn texel(of: usize, [x, y]: [i32; 2], side: u32) -> Option<[u32; 3]> {
    let inside = |at: i32| (0..side as i32).contains(&at);
    match (inside(x), inside(y)) {
        (true, true) => Some([x as u32, y as u32, of as u32]),
        (false, false) => None,
        _ => {
            // A quarter of a texel beyond the border: the row along the border stays the same.
            let beyond = 0.25 / side as f32;
            let place = (Vec2::new(x as f32, y as f32) + 0.5) / side as f32;
            let place = place.clamp(Vec2::splat(-beyond), Vec2::splat(1.0 + beyond));
            let (next, there) = face(direction(of, place));
            let at = |part: f32| ((part * side as f32) as u32).min(side - 1);
            Some([at(there.x), at(there.y), next as u32])
        }
    }
}

/// Checks the extent of the picture of all faces.
///
/// # Errors
/// `Input` if it is no row of six squares.
pub fn check_extent([width, height]: [u32; 2]) -> Result<()> {
    match height > 0 && height <= MOST_SIDE && width / FACES == height && width % FACES == 0 {
        true => Ok(()),
        false => Err(Error::input(format!("{width}×{height} texels are no row of six squares"))),
    }
}

/// Checks that a view is from the place of the bake.
///
/// # Errors
/// `Usage` if it is not.
pub fn check_view(view: &View, camera: &str, position: Vec3) -> Result<()> {
    if view.is_orthographic() {
        let what = format!("the bake is for a camera that turns in place, and {camera} has parallel rays here");
        return Err(Error::usage(what).help("Render with a perspective camera, or bake a lightmap"));
    }
    let apart = view.position.distance(position);
    if apart > APART * position.length().max(1.0) {
        let at = |p: Vec3| format!("{}, {}, {}", p.x, p.y, p.z);
        let what = format!(
            "the bake is for a camera that turns in place at {} (camera `{camera}`), and this one is at {}",
            at(position),
            at(view.position)
        );
        return Err(Error::usage(what).help("Render from that place, or bake a lightmap, which is for a free camera"));
    }
    Ok(())
}

/// The surfaces that the texels of the faces show, on the device.
#[derive(Debug)]
pub(super) struct Around(OwnedBuffer);

impl Around {
    /// Draws the faces of a bake for a camera that turns in place; `None` for other bakes. The scene is at rest, as it was for the bake.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan) -> Result<Option<Self>> {
        let Kind::Cube { position, near, .. } = &plan.receivers else { return Ok(None) };
        let side = plan.extent[1];
        let bytes = u64::from(FACES * side * side) * size_of::<types::CubeTexel>() as u64;
        let guide = OwnedBuffer::new(gpu, "daylight.around", BufferDesc::device(bytes))?;
        let scene = Scene { environment: None, ..scene.clone() };
        let mut resident = Resident::new(gpu, &scene)?;
        let pose = Pose::rest(&scene);
        let mut runner = Runner::new(gpu);
        for (face, view) in views(Vec3::from(*position), *near, side).into_iter().enumerate() {
            let mut graph = Graph::new("daylight.around");
            let handles = resident.frame_in(&mut graph, &scene, &pose);
            let view = view.fit_far(&handles.bounds());
            let seen = gbuffer::draw(&mut graph, &handles, &view, &gbuffer::Settings::default());
            let args = around::Args {
                depth: seen.depth,
                normal: seen.normal,
                around: graph.import_buffer(&guide),
                push: around::Push { side, face: face as u32, far: view.far },
            };
            graph.compute(args, view.extent);
            runner.run(&graph)?;
        }
        Ok(Some(Self(guide)))
    }

    /// A depth and a normal for each texel ([`types::CubeTexel`]).
    pub fn guide(&self) -> &OwnedBuffer {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_and_directions_are_inverse_and_views_see_along_them() {
        let views = views(Vec3::new(1.0, 2.0, 3.0), 0.1, 16);
        for (number, view) in views.iter().enumerate() {
            for place in [Vec2::new(0.1, 0.2), Vec2::new(0.9, 0.4), Vec2::splat(0.5), Vec2::new(0.3, 0.95)] {
                let along = direction(number, place);
                let (found, there) = face(3.0 * along);
                assert!(found == number && there.distance(place) < 1e-6, "{number} {place}: {found} {there}");
                let clip = view.clip_from_world * (view.position + 5.0 * along).extend(1.0);
                let uv = 0.5 + Vec2::new(0.5, -0.5) * Vec2::new(clip.x, clip.y) / clip.w;
                assert!(clip.w > 0.0 && uv.distance(place) < 1e-5, "{number} {place}: {uv}");
            }
        }
        // Every direction has one face, and the borders belong to both.
        for i in 0..2000 {
            let t = i as f32;
            let along = Vec3::new((t * 0.7).sin(), (t * 1.3).sin(), (t * 2.1).cos());
            let (number, place) = face(along);
            assert!(place.min_element() >= 0.0 && place.max_element() <= 1.0);
            assert!(direction(number, place).normalize().distance(along.normalize()) < 1e-5);
        }
    }

    /// Texels on both sides of a border are each other's neighbours, and they touch.
    #[test]
    fn texels_beside_a_border_are_neighbours_of_each_other() {
        let side = 16;
        let centre = |[x, y, number]: [u32; 3]| {
            direction(number as usize, (Vec2::new(x as f32, y as f32) + 0.5) / side as f32).normalize()
        };
        for number in 0..6 {
            for along in 0..side as i32 {
                let last = side as i32 - 1;
                for (mine, step) in
                    [([0, along], [-1, 0]), ([last, along], [1, 0]), ([along, 0], [0, -1]), ([along, last], [0, 1])]
                {
                    let other = texel(number, [mine[0] + step[0], mine[1] + step[1]], side).unwrap();
                    let mine = [mine[0] as u32, mine[1] as u32, number as u32];
                    assert_ne!(other[2], mine[2]);
                    assert!(centre(other).distance(centre(mine)) < 2.1 / side as f32, "{mine:?} {other:?}");
                    let back = [[-1, 0], [1, 0], [0, -1], [0, 1]].into_iter().filter_map(|step| {
                        texel(other[2] as usize, [other[0] as i32 + step[0], other[1] as i32 + step[1]], side)
                    });
                    assert!(back.into_iter().any(|found| found == mine), "{mine:?} {other:?}");
                }
            }
            assert_eq!(texel(number, [-1, 16], side), None);
            assert_eq!(texel(number, [3, 5], side), Some([3, 5, number as u32]));
        }
    }

    #[test]
    fn extents_are_rows_of_six_squares() {
        assert!(check_extent([96, 16]).is_ok());
        for extent in [[0, 0], [16, 16], [96, 17], [6 * 5000, 5000], [u32::MAX, u32::MAX]] {
            assert!(check_extent(extent).is_err(), "{extent:?}");
        }
    }
}
