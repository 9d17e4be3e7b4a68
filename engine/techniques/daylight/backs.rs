//! Backs of two-sided surfaces. Many programs write every material with two sides, the surfaces of closed solids as well. Backs inside of
//! solids get no light and nobody sees them; backs that light reaches have another light than their fronts, and so texels of their own in a lightmap.

use super::{
    Adaptive, Baking, Calendar, Group, Kind, Plan, Sources, Transport, Weather,
    atlas::connected,
    digest,
    lightmap::{Corners, placed},
};
use crate::{
    Result,
    gpu::Gpu,
    scene::{Pose, Primitive, Scene},
    shaders::types,
};

/// Paths from each point.
const PATHS: u32 = 16;
/// Points of the part of a mesh that hangs together, at least: a part that is lit by a hundredth of its paths is then found in nearly all cases.
const LEAST_POINTS: usize = 32;
/// Points of such a part at most.
const MOST_POINTS: usize = 4096;
/// Points of a batch.
const BATCH: usize = 4096;

/// The backs of the triangles of a scene.
#[derive(Debug)]
pub struct Backs {
    /// For each triangle of each instance: whether its back needs texels. Empty: no back does.
    pub lit: Vec<bool>,
    /// What found it out.
    transport: Option<Transport>,
}

/// Points on the backs of a part of a mesh.
struct Part {
    /// Numbers of its triangles among those of all instances.
    triangles: Vec<u32>,
    points: Vec<types::Hit>,
}

impl Backs {
    /// No back needs texels.
    pub const fn none() -> Self {
        Self { lit: Vec::new(), transport: None }
    }

    /// Finds the backs that light of the sky or of lamps reaches, by paths from points on them. Parts of a mesh that hang together are lit or dark as a
    /// whole. Where no light of the sky comes in at all, none of the sun does.
    ///
    /// # Errors
    /// As [`Transport::new`] and [`Transport::tile`].
    pub fn lit(gpu: &Gpu, scene: &Scene, lamps: &[Group], settings: &Baking) -> Result<Self> {
        let two_sided = |primitive: &Primitive| {
            let material = scene.materials.get(primitive.material as usize);
            material.is_some_and(|material| material.double_sided && !material.unlit)
        };
        if !settings.backs || !placed(scene).any(|(.., primitive)| two_sided(primitive)) {
            return Ok(Self::none());
        }
        let parts = parts(scene, settings.density, two_sided);
        let plan = plan(scene, lamps, settings);
        let mut transport = Transport::new(gpu, scene, &plan, Sources::Lightmap(Box::default()))?;
        let points: Vec<(usize, types::Hit)> =
            parts.iter().enumerate().flat_map(|(part, of)| of.points.iter().map(move |point| (part, *point))).collect();
        let mut is_lit = vec![false; parts.len()];
        let mut first = 0;
        for batch in points.chunks(BATCH) {
            let hits: Vec<types::Hit> = batch.iter().map(|(_, hit)| *hit).collect();
            let (light, _) = transport.gather(&plan, first, &hits)?;
            first += hits.len() as u32;
            for (number, (part, _)) in batch.iter().enumerate() {
                is_lit[*part] |= !light.is_dark(number, hits.len());
            }
        }
        let mut lit = vec![false; placed(scene).map(|(.., primitive)| primitive.indices.len() / 3).sum()];
        for part in parts.iter().zip(is_lit).filter_map(|(part, is_lit)| is_lit.then_some(part)) {
            part.triangles.iter().for_each(|triangle| lit[*triangle as usize] = true);
        }
        if !lit.contains(&true) {
            lit.clear();
        }
        Ok(Self { lit, transport: Some(transport) })
    }

    /// What gathers the light of a plan with the same lamps: the transport of the search, if there was one, else a new one.
    ///
    /// # Errors
    /// As [`Transport::new`].
    pub fn transport(self, gpu: &Gpu, scene: &Scene, plan: &Plan, sources: Sources) -> Result<Transport> {
        let Some(searched) = self.transport else { return Transport::new(gpu, scene, plan, sources) };
        let mut transport = Transport { sources, ..searched };
        transport.follow(plan)?;
        Ok(transport)
    }
}

/// The plan of the search: light of the sky and of lamps by few paths.
fn plan(scene: &Scene, lamps: &[Group], settings: &Baking) -> Plan {
    let corners = digest(&Corners::default());
    let settings = Baking { samples: PATHS, sun_masks: 0.0, adaptive: Adaptive::Off, ..settings.clone() };
    Plan {
        scene: scene.name.clone(),
        parts: Vec::new(),
        receivers: Kind::Lightmap { charts: 0, covered: 0, backs: 0, corners },
        extent: [1, 1],
        probes: None,
        calendar: Calendar::default(),
        steps: 0,
        times: Vec::new(),
        weather: Weather::default(),
        lamps: lamps.to_vec(),
        settings,
    }
}

/// The parts of all instances of two-sided meshes. `density`: points along a metre.
fn parts(scene: &Scene, density: f32, two_sided: impl Fn(&Primitive) -> bool) -> Vec<Part> {
    let pose = Pose::rest(scene);
    let mut out = Vec::new();
    let mut first = 0;
    for (instance, (node, _, _, primitive)) in placed(scene).enumerate() {
        let triangles: Vec<[u32; 3]> = primitive.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        if two_sided(primitive) {
            let part_of = connected(&primitive.positions, &triangles);
            let count = part_of.iter().max().map_or(0, |last| *last as usize + 1);
            let mut of_parts = vec![Vec::new(); count];
            (0..).zip(&part_of).for_each(|(triangle, part)| of_parts[*part as usize].push(triangle));
            let world = pose.world[node];
            let area = |triangle: u32| {
                let [a, b, c] = triangles[triangle as usize]
                    .map(|vertex| world.transform_point3(primitive.positions[vertex as usize]));
                0.5 * (b - a).cross(c - a).length()
            };
            out.extend(of_parts.into_iter().map(|numbers| {
                let places = spread(&numbers.iter().map(|number| area(*number)).collect::<Vec<_>>(), density);
                let hit = |(triangle, barycentrics): (usize, [f32; 2])| types::Hit {
                    t: -1.0,
                    barycentrics,
                    instance: instance as u32,
                    triangle: numbers[triangle],
                };
                let points = places.into_iter().map(hit).collect();
                Part { triangles: numbers.iter().map(|number| first + number).collect(), points }
            }));
        }
        first += triangles.len() as u32;
    }
    out
}

/// Points that lie evenly over triangles with these areas: the number of each one's triangle, and its weights of corner 1 and of corner 2.
fn spread(areas: &[f32], density: f32) -> Vec<(usize, [f32; 2])> {
    // The sequence of the plastic number, which fills a square evenly (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences").
    const STEP: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];
    let all: f64 = areas.iter().map(|area| f64::from(*area)).sum();
    if !(all > 0.0 && all.is_finite()) {
        return Vec::new();
    }
    let count = ((all * f64::from(density).powi(2)) as usize).clamp(LEAST_POINTS, MOST_POINTS);
    let mut triangle = 0;
    let mut before = 0.0;
    (0..count)
        .map(|point| {
            let at = (point as f64 + 0.5) / count as f64 * all;
            while triangle + 1 < areas.len() && before + f64::from(areas[triangle]) < at {
                before += f64::from(areas[triangle]);
                triangle += 1;
            }
            let [u, v] = STEP.map(|step| ((point as f64 + 0.5) * step).fract() as f32);
            // The half of the square beyond the diagonal is turned onto the other half.
            (triangle, if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_spread_by_area() {
        let areas = [3.0, 0.0, 1.0];
        let points = spread(&areas, 100.0);
        assert_eq!(points.len(), MOST_POINTS);
        let on = |triangle: usize| points.iter().filter(|point| point.0 == triangle).count();
        assert!(on(0).abs_diff(MOST_POINTS / 4 * 3) <= 1 && on(1) == 0, "{} {} {}", on(0), on(1), on(2));
        let middle = points.iter().fold([0.0; 2], |sum, (_, [u, v])| [sum[0] + u, sum[1] + v]);
        assert!(middle.into_iter().all(|sum| (sum / MOST_POINTS as f32 - 1.0 / 3.0).abs() < 0.01), "{middle:?}");
        assert!(points.iter().all(|(_, [u, v])| *u >= 0.0 && *v >= 0.0 && u + v <= 1.0));
        assert_eq!(spread(&areas, 0.1).len(), LEAST_POINTS);
        assert!(spread(&[0.0, 0.0], 8.0).is_empty() && spread(&[], 8.0).is_empty());
        assert!(spread(&[f32::INFINITY], 8.0).is_empty());
    }
}
