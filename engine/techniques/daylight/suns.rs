//! The suns of a bake on its device, and the size of the passes that add their light.

use super::Plan;
use crate::{
    Result,
    gpu::{Gpu, OwnedBuffer},
    graph::Items,
};

/// The items of the passes that add the light of the sun, for some receivers, times and paths of each receiver.
pub(super) fn sun_items([receivers, times, paths]: [u32; 3], bounces: u64, mask_words: u32, most_turns: u64) -> Items {
    // About half of all vertices are there, and at most half of them face the sun and send their rays. To read a bit takes a fraction of a ray's time.
    let each = if mask_words == 0 { bounces.div_ceil(4) } else { 1 };
    let turns = if mask_words == 0 { bounces * most_turns } else { bounces };
    Items::new(paths).rays(u64::from(receivers) * u64::from(times) * each).turns(turns)
}

/// The suns of all times; one more, so that the buffer is never empty.
pub(super) fn suns_of(gpu: &Gpu, plan: &Plan) -> Result<OwnedBuffer> {
    // Place and squared distance of a sun that is a point, else direction and 0.
    let entry = |sun: [f32; 3]| match plan.calendar.point {
        Some(point) => {
            let [x, y, z] = point.position(sun);
            [x, y, z, point.distance * point.distance]
        }
        None => [sun[0], sun[1], sun[2], 0.0],
    };
    let suns: Vec<[f32; 4]> = plan.times.iter().map(|time| time.sun).chain([[0.0, 1.0, 0.0]]).map(entry).collect();
    OwnedBuffer::with_contents(gpu, "daylight.suns", bytemuck::cast_slice(&suns))
}
