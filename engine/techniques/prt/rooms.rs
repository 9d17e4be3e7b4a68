//! Rooms that particles from lights and cameras do not reach. Two rooms without a connection both need samples, but all lights may be in one of them.

use glam::Vec3;

use super::{
    Bakery, Baking, Starts,
    samples::{self, Triangles},
    sampling::MOST_PARTICLES,
};
use crate::{Error, Result, Stop, shaders::types::PrtPoint};

/// Further rooms at most.
const MOST_ROOMS: usize = 8;
/// Points on surfaces that no particle has met, at each of which a room is looked for.
const CANDIDATES: usize = 256;
/// Share of the particles that are still in the scene when their hits begin to count. Light leaves any other place too fast for a room.
const CLOSED: f64 = 0.25;
/// Share of the hits that are on fronts of triangles that next to no other particle has met. The inside of furniture has backs.
const NEW: f64 = 0.75;
/// Least mean distance between two hits of a particle, as a share of that in the known rooms: cabinets and boxes are hollow, too.
const LEAST: f64 = 0.25;

impl Bakery {
    /// Points from which particles start: [`plan::starts`](super::starts), and a point of each room that particles from there do not reach.
    ///
    /// # Errors
    /// `Input` if the scene has no surface; `OutOfMemory`, `DeviceLost`, `Interrupted`.
    pub fn starts(&mut self, baking: &Baking, stop: &Stop) -> Result<Starts> {
        let mut starts = super::starts(&self.scene);
        if starts.points.is_empty() {
            return Err(Error::input("the scene has no surface that light reaches"));
        }
        starts.rooms = self.rooms(baking, &mut starts.points, stop)?;
        Ok(starts)
    }

    /// Adds a point of each room that particles from `starts` do not reach, and returns the number of such rooms, 8 at most. Particles start at
    /// random points of the surfaces that were not reached. A place is a room if few of these particles leave the scene, if they meet fronts of
    /// triangles, and if the place is not much smaller than the known rooms: the inside of furniture is none.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`, `Interrupted`.
    pub fn rooms(&mut self, baking: &Baking, starts: &mut Vec<Vec3>, stop: &Stop) -> Result<usize> {
        let mut triangles = Triangles::new(&self.scene);
        let bounds = samples::bounds(&triangles.list);
        let off = 1e-4 * (bounds[1] - bounds[0]).length();
        if !(off > 0.0 && off.is_finite()) || starts.is_empty() {
            return Ok(0);
        }
        let mut fresh = starts.clone();
        let mut least = None;
        for room in 0..MOST_ROOMS {
            stop.check()?;
            let hits = self.particles((baking.seed, &fresh), 0..MOST_PARTICLES, 0.0)?.hits;
            hits.iter().flatten().for_each(|hit| triangles.count(hit));
            let least = *least.get_or_insert(LEAST * free_path(hits.iter()));
            let usual = triangles.usual();
            let places: Vec<Vec3> =
                triangles.unseen(CANDIDATES, usual).iter().map(|[at, normal]| *at + off * *normal).collect();
            if places.is_empty() {
                return Ok(room);
            }
            let found = self.particles((baking.seed, &places), 0..MOST_PARTICLES, 0.0)?.hits;
            // Particle after particle starts at the next place.
            let of = |place: usize| found.iter().skip(place).step_by(places.len());
            // The middle between two hits of one particle is in the free space.
            let pair = |place: usize| of(place).flat_map(|hits| hits.windows(2)).next();
            let is_room = |place: &usize| is_room(of(*place), &triangles, usual) && free_path(of(*place)) >= least;
            let rooms = (0..places.len()).filter(is_room);
            let Some(pair) = rooms.filter_map(pair).next() else { return Ok(room) };
            let start = 0.5 * (samples::position(&pair[0]) + samples::position(&pair[1]));
            starts.push(start);
            fresh = vec![start];
        }
        Ok(MOST_ROOMS)
    }
}

/// Mean distance between two hits of a particle, metres; 0 without such hits.
fn free_path<'a>(particles: impl Iterator<Item = &'a Vec<PrtPoint>>) -> f64 {
    let (mut sum, mut count) = (0.0, 0u32);
    for pair in particles.flat_map(|hits| hits.windows(2)) {
        sum += f64::from(samples::position(&pair[0]).distance(samples::position(&pair[1])));
        count += 1;
    }
    sum / f64::from(count.max(1))
}

/// Whether the particles of a place, each with its hits, are in a room that is not known.
fn is_room<'a>(particles: impl Iterator<Item = &'a Vec<PrtPoint>>, triangles: &Triangles, usual: f64) -> bool {
    let (mut all, mut inside, mut hits, mut new) = (0u32, 0u32, 0u32, 0u32);
    for of in particles {
        all += 1;
        inside += u32::from(!of.is_empty());
        hits += of.len() as u32;
        new += of.iter().filter(|hit| triangles.is_new(hit, usual)).count() as u32;
    }
    hits > 0 && f64::from(inside) >= CLOSED * f64::from(all) && f64::from(new) >= NEW * f64::from(hits)
}
