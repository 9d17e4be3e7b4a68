//! Rooms that particles from lights and cameras do not reach. Two rooms without a connection both need samples, but all lights may be in one of them.

use glam::Vec3;

use super::{
    Bakery, Baking,
    samples::{self, Triangles},
};
use crate::{Result, Stop, shaders::types::PrtPoint};

/// Further rooms at most.
const MOST_ROOMS: usize = 8;
/// Points on surfaces that no particle has met, at each of which a room is looked for.
const CANDIDATES: usize = 256;
/// Share of the particles that are still in the scene when their hits begin to count. Light leaves any other place too fast for a room.
const CLOSED: f64 = 0.25;
/// Share of the hits that are on fronts of triangles that no other particle has met. The inside of furniture has backs.
const NEW: f64 = 0.75;

impl Bakery {
    /// Adds a point of each room that particles from `starts` do not reach, and returns the number of such rooms, 8 at most. Particles start at
    /// random points of the surfaces that were not reached. A place is a room if few of these particles leave the scene and if they meet fronts of
    /// triangles: the inside of furniture is none.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`, `Interrupted`.
    pub fn rooms(&mut self, baking: &Baking, starts: &mut Vec<Vec3>, stop: &Stop) -> Result<usize> {
        let mut triangles = Triangles::new(self.scene());
        let bounds = samples::bounds(&triangles.list);
        let off = 1e-4 * (bounds[1] - bounds[0]).length();
        if !(off > 0.0 && off.is_finite()) || starts.is_empty() {
            return Ok(0);
        }
        let mut fresh = starts.clone();
        for room in 0..MOST_ROOMS {
            stop.check()?;
            self.particles(baking, &fresh, 0)?.hits.iter().flatten().for_each(|hit| triangles.count(hit));
            let places: Vec<Vec3> =
                triangles.unseen(CANDIDATES).iter().map(|[at, normal]| *at + off * *normal).collect();
            if places.is_empty() {
                return Ok(room);
            }
            let found = self.particles(baking, &places, 0)?.hits;
            // Particle after particle starts at the next place.
            let of = |place: usize| found.iter().skip(place).step_by(places.len());
            let Some(place) = (0..places.len()).find(|place| is_room(of(*place), &triangles)) else { return Ok(room) };
            // The middle between two hits of one particle is in the free space.
            let Some(pair) = of(place).flat_map(|hits| hits.windows(2)).next() else { return Ok(room) };
            let start = 0.5 * (samples::position(&pair[0]) + samples::position(&pair[1]));
            starts.push(start);
            fresh = vec![start];
        }
        Ok(MOST_ROOMS)
    }
}

/// Whether the particles of a place, each with its hits, are in a room that is not known.
fn is_room<'a>(particles: impl Iterator<Item = &'a Vec<PrtPoint>>, triangles: &Triangles) -> bool {
    let (mut all, mut inside, mut hits, mut new) = (0u32, 0u32, 0u32, 0u32);
    for of in particles {
        all += 1;
        inside += u32::from(!of.is_empty());
        hits += of.len() as u32;
        new += of.iter().filter(|hit| triangles.is_new(hit)).count() as u32;
    }
    hits > 0 && f64::from(inside) >= CLOSED * f64::from(all) && f64::from(new) >= NEW * f64::from(hits)
}
