//! The suns of a bake on its device, and the passes that add their light.

use glam::Vec3;

use super::{Plan, Transport, masks};
use crate::{
    Result,
    gpu::{DeviceKind, Gpu, OwnedBuffer},
    graph::{Buffer, Graph, Items, Uniform},
    rays::{RayHandles, traced},
    resident,
    shaders::{consts, daylight::sun_visibility, types},
};

/// The items of the passes that add the light of the sun, for some receivers, times and paths of each receiver.
pub(super) fn sun_items([receivers, times, paths]: [u32; 3], bounces: u64) -> Items {
    // To read a bit takes a fraction of a ray's time.
    Items::new(paths).rays(u64::from(receivers) * u64::from(times)).turns(bounces)
}

/// Words with a bit for each time.
pub(super) fn words(times: usize) -> u32 {
    (times as u32).div_ceil(consts::DAY_TIMES)
}

/// The suns of all times; one more, so that the buffer is never empty.
pub(super) fn suns_of(gpu: &Gpu, plan: &Plan) -> Result<OwnedBuffer> {
    let entry = |sun: [f32; 3]| match plan.calendar.point {
        Some(point) => types::DaySun {
            toward: point.position(sun),
            intensity: point.distance * point.distance,
            ..types::DaySun::default()
        },
        None => {
            let (right, up) = Vec3::from(sun).any_orthonormal_pair();
            types::DaySun { toward: sun, intensity: 0.0, right: right.into(), up: up.into() }
        }
    };
    let suns: Vec<_> = plan.times.iter().map(|time| time.sun).chain([[0.0, 1.0, 0.0]]).map(entry).collect();
    OwnedBuffer::with_contents(gpu, "daylight.suns", bytemuck::cast_slice(&suns))
}

/// How the invocations of a pass share the rays to the sun. The light does not depend on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Share {
    /// Paths, or points of masks, of an invocation.
    pub places: u32,
    /// Whether an invocation has all times of its places. Otherwise it has those of one word.
    whole: bool,
}

impl Share {
    /// CPU drivers run few invocations together. Each has several places, so that all end at about the same time, and the triangle that hides the sun is
    /// kept through the whole day. GPUs run many invocations: each has one word of one place. Drivers that end long loops get the share of GPUs.
    pub fn of(gpu: &Gpu) -> Result<Self> {
        let whole = gpu.caps().kind == DeviceKind::Cpu && gpu.loop_limit()?.is_none();
        Ok(Self { places: if whole { 4 } else { 1 }, whole })
    }

    /// Rows of groups that share the words of the times.
    pub fn rows(self, words: u32) -> u32 {
        if self.whole { 1 } else { words.max(1) }
    }
}

/// The items of the passes that trace rays to the sun from `places`: the times. `bounces`: vertices that a path, or 1 that a point of a mask, has at most.
pub(super) fn times_of(times: u32, places: u64, bounces: u64, most_turns: u64) -> Items {
    // About half of the vertices are there, a third of these want a ray at a time, and the triangle that hid the sun before saves two thirds of the rays. To
    // find out whether a ray is wanted takes a fraction of its time. Points of masks are all there, and half of them face the sun.
    let rays = (places * bounces).div_ceil(8);
    // The loop around the rays begins every few turns, and a ray may wait for others until then.
    Items::new(times).rays(rays).turns(bounces * (most_turns + most_turns / u64::from(consts::VISIBILITY_TURNS) + 16))
}

/// The paths of a batch in a graph.
#[derive(Clone, Copy, Debug)]
pub(super) struct Paths {
    pub settings: Uniform<types::DaySettings>,
    pub vertices: Buffer,
    pub counts: Buffer,
    pub receivers: u32,
    /// Paths of each receiver.
    pub samples: u32,
    /// Vertices of a path at most.
    pub bounces: u64,
}

impl Paths {
    pub fn count(self) -> u32 {
        self.receivers * self.samples
    }
}

impl Transport {
    /// Bits that say at which times the sun is seen: from the vertices of the paths by shadow rays, or from the points of the masks that the paths
    /// request.
    pub(super) fn visibility(
        &self,
        graph: &mut Graph,
        paths: Paths,
        (suns, times): (Buffer, u32),
        (handles, rays): (&resident::Handles, RayHandles),
        masks: masks::Handles,
    ) -> Buffer {
        let most_turns = self.rays.most_turns();
        if masks.wanted() {
            self.masks.compute(graph, paths, (suns, times), (handles, rays), masks, most_turns);
            return masks.bits;
        }
        let Paths { settings, vertices, counts, bounces, .. } = paths;
        let words = words(times as usize);
        let bytes = 4 * u64::from(paths.count()) * u64::from(consts::DAY_VERTICES) * u64::from(words);
        let bits = graph.buffer("daylight.visibility", bytes);
        graph.fill(bits, 0);
        let push = sun_visibility::Push { first: 0, count: times };
        let args = traced!(sun_visibility::Args { settings, suns, vertices, counts, bits, push }, rays, handles);
        let items = times_of(times, paths.count().into(), bounces, most_turns);
        graph.compute_over(args, [paths.count().div_ceil(self.share.places), self.share.rows(words)], items);
        bits
    }
}
