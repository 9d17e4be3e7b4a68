//! Masks of an occluder from many points at once, by orthographic depth images along the directions of the
//! environment's texels.
//!
//! A texel of the environment lies in the same direction from every point, so all rays to this texel are parallel. One
//! orthographic depth image of the occluder along this direction answers all these rays. The image stores how far the
//! occluder extends to the back on each line. The occluder hides the texel from a point if this depth lies behind the
//! point. A sample then costs one lookup per texel, and the number of rays does not depend on the number of samples:
//! 6·32² images of 128² lines are a hundred million rays. Rays from the points of the set 256×129×30 are two thousand
//! million.
//!
//! The depth images have a limited resolution: pixels are a 64th of the radius wide, and lookups read the nearest
//! pixel. Edges of masks are off by at most half a pixel, without bias. From a third of the radius on, a texel is at
//! least as wide as a pixel.

use super::{cover::reach, light::Light, occluder::Occluder, plan::Plan, settings::Masks};
use crate::{
    Result,
    gpu::{BufferDesc, Gpu, OwnedBuffer},
    graph::{Buffer, Graph, Runner},
    rays::Rays,
    resident::Resident,
    scene::{AlphaMode, Pose},
    shaders::{consts::FIV_PARALLEL_SIDE, fiv},
};

/// Rays of a dispatch, approximately.
const MOST_RAYS: u32 = 1 << 22;
/// Directions that an invocation looks up.
const EACH: u32 = 512;
/// Most bytes of the depth images of a face.
const MOST_BYTES: u64 = 1 << 26;

/// The depth images of an occluder.
#[derive(Debug)]
pub(super) struct Parallel {
    faces: Vec<OwnedBuffer>,
    /// Texels along an edge, rays along the edge of a texel.
    pub(super) size: u32,
    pub(super) split: u32,
    radius: f32,
}

/// Bytes of the depth images of a face.
fn bytes(size: u32, split: u32) -> u64 {
    u64::from(size * split).pow(2) * u64::from(FIV_PARALLEL_SIDE * FIV_PARALLEL_SIDE) * 2
}

/// Whether some surfaces are blended. Each ray decides anew whether a blended surface blocks light, so depth images
/// cannot represent them.
fn blended(occluder: &Occluder) -> bool {
    occluder.scene.materials.iter().any(|m| m.alpha == AlphaMode::Blend)
}

impl Plan {
    /// Names the vectors that rays compute although `masks` is parallel, in words. `None` if there are none.
    pub fn by_rays(&self, occluders: &[Occluder]) -> Option<String> {
        if self.masks != Masks::Parallel {
            return None;
        }
        if bytes(self.size, self.split) > MOST_BYTES {
            return Some("rays compute all masks, because depth images need fiv.size · fiv.split up to 44".into());
        }
        let names: Vec<_> = occluders.iter().filter(|o| blended(o)).map(|o| format!("`{}`", o.name)).collect();
        let mut parts = Vec::new();
        if !names.is_empty() {
            parts.push(format!("occluders with blended surfaces ({})", names.join(", ")));
        }
        if self.turns > 1 {
            parts.push("all rotation samples but the first".into());
        }
        if self.surface {
            parts.push("samples on surfaces".into());
        }
        (!parts.is_empty()).then(|| format!("rays compute the masks of: {}", parts.join("; ")))
    }
}

impl Parallel {
    /// Renders the depth images. `None` if they would be too large or if surfaces are blended.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub(super) fn new(
        gpu: &Gpu,
        occluder: &Occluder,
        (resident, rays): (&mut Resident, &mut Rays),
        (size, split): (u32, u32),
    ) -> Result<Option<Self>> {
        let (side, bytes) = (size * split, bytes(size, split));
        if blended(occluder) || bytes > MOST_BYTES.min(gpu.caps().limits.storage_range) {
            return Ok(None);
        }
        let radius = reach(occluder.radius);
        let pose = Pose::rest(&occluder.scene);
        let mut runner = Runner::new(gpu);
        let mut faces = Vec::new();
        for face in 0..6 {
            let depths = OwnedBuffer::new(gpu, "fiv.parallel", BufferDesc::device(bytes))?;
            let mut graph = Graph::new("fiv pictures along directions");
            let handles = resident.frame_in(&mut graph, &occluder.scene, &pose);
            let traced = rays.frame(&mut graph, &handles);
            let target = graph.import_buffer(&depths);
            let each = MOST_RAYS / (FIV_PARALLEL_SIDE * FIV_PARALLEL_SIDE);
            for first in (0..side * side).step_by(each as usize) {
                let count = each.min(side * side - first);
                let push = fiv::parallel::Push { face, first, side, radius };
                let args = crate::rays::traced!(fiv::parallel::Args { depths: target, push }, traced);
                graph.compute(args, [FIV_PARALLEL_SIDE / 2, FIV_PARALLEL_SIDE, count]);
            }
            runner.run(graph)?;
            faces.push(depths);
        }
        Ok(Some(Self { faces, size, split, radius }))
    }

    /// Number of chunks of directions, each with its own sums.
    pub(super) fn chunks(&self) -> u32 {
        6 * self.of_face()
    }

    fn of_face(&self) -> u32 {
        (self.size * self.split).pow(2).div_ceil(EACH)
    }

    /// Declares the sums of all chunks for `count` points.
    pub(super) fn declare(
        &self,
        graph: &mut Graph,
        (texels, points, partials): (Buffer, Buffer, Buffer),
        (first, count): (u32, u32),
    ) {
        for (face, depths) in (0..).zip(&self.faces) {
            let push = fiv::parallel_cover::Push {
                first,
                count,
                face,
                size: self.size,
                split: self.split,
                each: EACH,
                chunk: face * self.of_face(),
                chunks: self.chunks(),
                radius: self.radius,
            };
            let depths = graph.import_buffer(depths);
            let args = fiv::parallel_cover::Args { texels, points, partials, depths, push };
            graph.compute(args, [count, self.of_face(), 1]);
        }
    }

    /// Whether the depth images belong to the texels of this light.
    pub(super) fn fits(&self, light: &Light, split: u32) -> bool {
        (self.size, self.split) == (light.size, split)
    }
}
