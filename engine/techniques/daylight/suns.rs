//! The suns of a bake on its device, and the passes that add their light.

use glam::Vec3;

use super::{Plan, Transport, masks::Handles as Masks};
use crate::{
    Result,
    gpu::{DeviceKind, Gpu, OwnedBuffer},
    graph::{Buffer, Graph, Items, Uniform},
    rays::{RayHandles, traced},
    resident,
    shaders::{consts, daylight::sun_sights, types},
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
            squared: point.distance * point.distance,
            ..types::DaySun::default()
        },
        None => {
            let (right, up) = Vec3::from(sun).any_orthonormal_pair();
            types::DaySun { toward: sun, squared: 0.0, right: right.into(), up: up.into() }
        }
    };
    let suns: Vec<_> = plan.times.iter().map(|time| time.sun).chain([[0.0, 1.0, 0.0]]).map(entry).collect();
    OwnedBuffer::with_contents(gpu, "daylight.suns", bytemuck::cast_slice(&suns))
}

/// How invocations share the rays to the sun. The light does not depend on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sights {
    /// Paths, or points of masks, of an invocation.
    pub places: u32,
    /// Whether an invocation has all times of its places.
    whole: bool,
}

impl Sights {
    /// CPU drivers run few invocations together: each has several places, so that all end at about the same time, and the triangle that hides the sun is
    /// kept through the whole day. GPUs run many: each has one word of one place. So have drivers that end long loops.
    pub fn of(gpu: &Gpu) -> Result<Self> {
        let cpu = gpu.caps().kind == DeviceKind::Cpu;
        Ok(Self { places: if cpu && gpu.loop_limit()?.is_none() { 4 } else { 1 }, whole: cpu })
    }

    /// Rows of groups that share the words of the times.
    pub fn rows(self, words: u32) -> u32 {
        if self.whole { 1 } else { words.max(1) }
    }
}

/// The paths of a batch in a graph.
#[derive(Clone, Copy, Debug)]
pub(super) struct Paths {
    pub settings: Uniform<types::DaySettings>,
    pub vertices: Buffer,
    pub counts: Buffer,
    /// Receivers, and paths of each of them.
    pub number: [u32; 2],
    /// Vertices of a path at most.
    pub bounces: u64,
}

impl Transport {
    /// Bits that say at which times the sun is seen: from the vertices of the paths by a shadow ray from each, or by the masks that the paths
    /// request.
    pub(super) fn sights(
        &self,
        graph: &mut Graph,
        (paths, suns, times): (Paths, Buffer, u32),
        (handles, rays): (&resident::Handles, RayHandles),
        masks: Masks,
    ) -> Buffer {
        let Paths { settings, vertices, counts, number: [receivers, now], bounces } = paths;
        let most_turns = self.rays.most_turns();
        if masks.wanted() {
            let all = u64::from(receivers) * u64::from(now);
            let most = ([all, bounces], most_turns);
            self.masks.compute(graph, (settings, suns, times), (handles, rays), masks, (most, self.sights.places));
            return masks.bits;
        }
        let words = words(times as usize);
        let paths = receivers * now;
        let bytes = 4 * u64::from(paths) * u64::from(consts::DAY_VERTICES) * u64::from(words);
        let bits = graph.buffer("daylight.sights", bytes);
        graph.fill(bits, 0);
        let push = sun_sights::Push { first: 0, count: times };
        let args = traced!(sun_sights::Args { settings, suns, vertices, counts, bits, push }, rays, handles);
        // About half of all vertices are there, a quarter of them send a ray at a time, and the triangle that hid the sun before saves half of the rays.
        let items = Items::new(times).rays(u64::from(paths) * bounces.div_ceil(16));
        let turns = u64::from(self.sights.places) * bounces * (most_turns + 4);
        graph.compute_over(args, [paths.div_ceil(self.sights.places), self.sights.rows(words)], items.turns(turns));
        bits
    }
}
