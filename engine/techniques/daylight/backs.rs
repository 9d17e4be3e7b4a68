//! Backs of two-sided surfaces. Many programs write every material with two sides, the surfaces of closed solids as well. Backs inside of
//! solids get no light and nobody sees them; backs that light reaches have another light than their fronts, and so texels of their own in a lightmap.

use super::{
    Adaptive, Baking, Calendar, Group, Kind, Plan, Sources, Transport, Weather, atlas::connected, corners::Corners,
    digest, lightmap::placed,
};
use crate::{
    Error, Result,
    gpu::Gpu,
    scene::{Pose, Primitive, Scene},
    shaders::types,
};

/// Paths from each point: of the first round, and of the second one for components that are dark though their points see other surfaces.
const PATHS: [u32; 2] = [16, 256];
/// Points of a connected component, at least; fewer if there are many components.
const LEAST_POINTS: usize = 32;
const FEWEST_POINTS: usize = 4;
/// Points of a component at most.
const MOST_POINTS: usize = 4096;
/// Points of all components that have the least number, about.
const ALL_LEAST: usize = 1 << 20;
/// Points of a batch.
const BATCH: usize = 1024;

/// The backs of the triangles of a scene.
#[derive(Debug)]
pub struct Backs {
    /// For each triangle of each instance: whether its back needs texels. `None`: backs show the light of the fronts.
    pub lit: Option<Vec<bool>>,
    /// The transport of the search.
    transport: Option<Transport>,
}

/// A connected component of an instance.
struct Component {
    /// The number of the instance's first triangle among those of all instances.
    first: u32,
    instance: u32,
    /// The component in the components of the mesh.
    shape: usize,
    number: u32,
    state: State,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    /// No path found light, and nearly all met the back of a surface first: the inside of a solid.
    Enclosed,
    /// No path found light.
    Dark,
    Lit,
}

/// The connected components of a mesh.
struct Shape {
    /// The triangles of all components, component after component.
    triangles: Vec<u32>,
    /// Where each component begins, and the number of all triangles.
    starts: Vec<usize>,
}

impl Shape {
    fn new(primitive: &Primitive) -> Self {
        let triangles: Vec<[u32; 3]> = primitive.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        let component_of = connected(&primitive.positions, &triangles);
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        order.sort_by_key(|triangle| component_of[*triangle as usize]);
        let ends = order.windows(2).enumerate();
        let ends = ends.filter(|(_, pair)| component_of[pair[0] as usize] != component_of[pair[1] as usize]);
        let starts = [0].into_iter().chain(ends.map(|(at, _)| at + 1)).chain([order.len()]).collect();
        Self { triangles: order, starts }
    }

    /// The triangles of a component.
    fn of(&self, number: u32) -> &[u32] {
        &self.triangles[self.starts[number as usize]..self.starts[number as usize + 1]]
    }

    fn count(&self) -> u32 {
        if self.triangles.is_empty() { 0 } else { self.starts.len() as u32 - 1 }
    }
}

impl Backs {
    /// Backs show the light of the fronts.
    pub const fn none() -> Self {
        Self { lit: None, transport: None }
    }

    /// Whether a lightmap of a scene needs a search for lit backs.
    pub fn are_wanted(scene: &Scene, settings: &Baking) -> bool {
        settings.backs && placed(scene).any(|(.., primitive)| is_two_sided(scene, primitive))
    }

    /// Finds the backs that light of the sky or of lamps reaches, by paths from points on them. A connected component of a primitive is lit or dark as a
    /// whole. Where no light of the sky comes in at all, none of the sun does.
    ///
    /// # Errors
    /// As [`Transport::new`] and [`Transport::tile`]; `Input` for a triangle without vertices.
    pub fn lit(gpu: &Gpu, scene: &Scene, lamps: &[Group], settings: &Baking) -> Result<Self> {
        if !Self::are_wanted(scene, settings) {
            return Ok(Self::none());
        }
        let mut search = Search::new(scene, settings.density)?;
        let mut transport =
            Transport::new(gpu, scene, &plan(scene, lamps, settings, PATHS[0]), Sources::Lightmap(Box::default()))?;
        for paths in PATHS {
            search.round(&mut transport, &plan(scene, lamps, settings, paths))?;
        }
        Ok(Self { lit: Some(search.lit()), transport: Some(transport) })
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

fn is_two_sided(scene: &Scene, primitive: &Primitive) -> bool {
    let material = scene.materials.get(primitive.material as usize);
    material.is_some_and(|material| material.double_sided && !material.unlit)
}

/// The plan of a round: light of the sky and of lamps by few paths.
fn plan(scene: &Scene, lamps: &[Group], settings: &Baking, samples: u32) -> Plan {
    let corners = digest(&Corners::default());
    let settings = Baking { samples, sun_masks: 0.0, adaptive: Adaptive::Off, ..settings.clone() };
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

/// The search for lit backs.
struct Search<'s> {
    pose: Pose,
    density: f32,
    shapes: Vec<Shape>,
    components: Vec<Component>,
    /// Node and primitive of each instance.
    instances: Vec<(usize, &'s Primitive)>,
    /// Number of triangles of all instances.
    triangles: usize,
}

impl<'s> Search<'s> {
    fn new(scene: &'s Scene, density: f32) -> Result<Self> {
        let mut known: Vec<(usize, usize)> = Vec::new();
        let (mut shapes, mut components, mut instances) = (Vec::new(), Vec::new(), Vec::new());
        let mut triangles = 0;
        for (instance, (node, mesh, slot, primitive)) in placed(scene).enumerate() {
            if let Some(index) = primitive.indices.iter().find(|index| **index as usize >= primitive.positions.len()) {
                let what = format!("mesh {mesh} has a triangle with vertex {index}, of {}", primitive.positions.len());
                return Err(Error::input(what).help("Repair the list of triangles"));
            }
            if is_two_sided(scene, primitive) {
                let shape = known.iter().position(|one| *one == (mesh, slot)).unwrap_or_else(|| {
                    known.push((mesh, slot));
                    shapes.push(Shape::new(primitive));
                    shapes.len() - 1
                });
                components.extend((0..shapes[shape].count()).map(|number| Component {
                    first: triangles as u32,
                    instance: instance as u32,
                    shape,
                    number,
                    state: State::Dark,
                }));
            }
            instances.push((node, primitive));
            triangles += primitive.indices.len() / 3;
        }
        Ok(Self { pose: Pose::rest(scene), density, shapes, components, instances, triangles })
    }

    /// Traces paths from points on all components that are dark.
    fn round(&mut self, transport: &mut Transport, plan: &Plan) -> Result<()> {
        let least = (ALL_LEAST / self.components.len().max(1)).clamp(FEWEST_POINTS, LEAST_POINTS);
        let mut batch: Vec<(usize, types::Hit)> = Vec::new();
        let mut first = 0;
        for number in 0..self.components.len() {
            if self.components[number].state == State::Dark {
                let points = self.points(number, least);
                // A point that sees another surface, or light, changes this.
                self.components[number].state = State::Enclosed;
                batch.extend(points.into_iter().map(|hit| (number, hit)));
            }
            let is_last = number + 1 == self.components.len();
            while batch.len() >= BATCH || (is_last && !batch.is_empty()) {
                let part: Vec<(usize, types::Hit)> = batch.drain(..batch.len().min(BATCH)).collect();
                let hits: Vec<types::Hit> = part.iter().map(|(_, hit)| *hit).collect();
                let (light, shut) = transport.gather(plan, first, &hits)?;
                first += hits.len() as u32;
                for (point, (number, _)) in part.into_iter().enumerate() {
                    let component = &mut self.components[number];
                    if !light.is_dark(point, hits.len()) {
                        component.state = State::Lit;
                    } else if component.state == State::Enclosed && !shut[point].is_buried(plan.settings.samples, true)
                    {
                        component.state = State::Dark;
                    }
                }
            }
        }
        Ok(())
    }

    /// Points on the back of a component.
    fn points(&self, number: usize, least: usize) -> Vec<types::Hit> {
        let Component { instance, shape, number, .. } = self.components[number];
        let (node, primitive) = self.instances[instance as usize];
        let world = self.pose.world[node];
        let triangles = self.shapes[shape].of(number);
        let area = |triangle: &u32| {
            let indices = &primitive.indices[3 * *triangle as usize..][..3];
            let at = |corner: usize| world.transform_point3(primitive.positions[indices[corner] as usize]);
            0.5 * (at(1) - at(0)).cross(at(2) - at(0)).length()
        };
        let areas: Vec<f32> = triangles.iter().map(area).collect();
        let hit = |(at, barycentrics): (usize, [f32; 2])| types::Hit {
            t: -1.0,
            barycentrics,
            instance,
            triangle: triangles[at],
        };
        spread(&areas, self.density, least).into_iter().map(hit).collect()
    }

    /// For each triangle of each instance: whether its component is lit.
    fn lit(&self) -> Vec<bool> {
        let mut lit = vec![false; self.triangles];
        for component in self.components.iter().filter(|component| component.state == State::Lit) {
            for triangle in self.shapes[component.shape].of(component.number) {
                lit[(component.first + triangle) as usize] = true;
            }
        }
        lit
    }
}

/// Points that lie evenly over triangles with these areas: the number of each one's triangle, and its weights of corner 1 and of corner 2. `density`:
/// points along a metre.
fn spread(areas: &[f32], density: f32, least: usize) -> Vec<(usize, [f32; 2])> {
    // The sequence of the plastic number, which fills a square evenly (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences").
    const STEP: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];
    let all: f64 = areas.iter().map(|area| f64::from(*area)).sum();
    if !(all > 0.0 && all.is_finite()) {
        return Vec::new();
    }
    let count = ((all * f64::from(density).powi(2)) as usize).clamp(least, MOST_POINTS);
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
        let points = spread(&areas, 100.0, 4);
        assert_eq!(points.len(), MOST_POINTS);
        let on = |triangle: usize| points.iter().filter(|point| point.0 == triangle).count();
        assert!(on(0).abs_diff(MOST_POINTS / 4 * 3) <= 1 && on(1) == 0, "{} {} {}", on(0), on(1), on(2));
        let middle = points.iter().fold([0.0; 2], |sum, (_, [u, v])| [sum[0] + u, sum[1] + v]);
        assert!(middle.into_iter().all(|sum| (sum / MOST_POINTS as f32 - 1.0 / 3.0).abs() < 0.01), "{middle:?}");
        assert!(points.iter().all(|(_, [u, v])| *u >= 0.0 && *v >= 0.0 && u + v <= 1.0));
        assert_eq!(spread(&areas, 0.1, 32).len(), 32);
        assert!(spread(&[0.0, 0.0], 8.0, 4).is_empty() && spread(&[], 8.0, 4).is_empty());
        assert!(spread(&[f32::INFINITY], 8.0, 4).is_empty());
    }
}
