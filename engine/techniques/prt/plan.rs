//! The plan of a bake: scene, samples and clusters.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{Baking, cap::Cap, samples};
use crate::{
    Error, Result,
    bake::{Digest, Part},
    scene::{AlphaMode, Scene},
    shaders::types::PrtPoint,
};

/// Samples of a bake at most.
pub const MOST_SAMPLES: usize = 1 << 20;

/// Vectors of direct light of all clusters at most: scatterings are solved by a square matrix of this size.
pub const MOST_VECTORS: usize = 8192;

/// The plan of a bake.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Name of the scene.
    pub scene: String,
    /// The parts of the scene on which the bake depends.
    pub parts: Vec<Part>,
    pub settings: Baking,
    /// Points from which particles start, metres.
    pub starts: Vec<[f32; 3]>,
    /// Least distance of two samples on a plane, metres.
    pub radius: f32,
    /// Distance in which nothing is, metres.
    pub far: f32,
    /// Samples of each cluster.
    pub clusters: Vec<u32>,
    /// Of all samples.
    pub samples: Digest,
    /// Share of the scattered particles that left the scene.
    pub escaped: f64,
}

impl Plan {
    /// Number of samples.
    pub fn count(&self) -> usize {
        self.clusters.iter().map(|count| *count as usize).sum()
    }

    /// The samples of a cluster.
    pub fn range(&self, cluster: usize) -> std::ops::Range<usize> {
        let first: usize = self.clusters[..cluster].iter().map(|count| *count as usize).sum();
        first..first + self.clusters[cluster] as usize
    }

    /// The first vector of a cluster in the list of the vectors of direct light of all clusters; also that of the end.
    pub fn first_vector(&self, cluster: usize) -> usize {
        self.clusters[..cluster].iter().map(|count| self.vectors_of(*count)).sum()
    }

    /// Number of vectors of direct light of a cluster. A cluster of few samples needs few.
    pub fn vectors(&self, cluster: usize) -> usize {
        self.vectors_of(self.clusters[cluster])
    }

    fn vectors_of(&self, samples: u32) -> usize {
        // With a mean, its transfer is one more.
        self.settings.light.min(samples) as usize + usize::from(self.settings.centred)
    }

    /// Number of vectors of direct light of all clusters.
    pub fn all_vectors(&self) -> usize {
        self.first_vector(self.clusters.len())
    }

    /// The directions of a cluster.
    pub fn cap(&self, samples: &[PrtPoint], cluster: usize) -> Cap {
        Cap::around(samples[self.range(cluster)].iter().map(samples::side), self.settings.directions)
    }

    /// # Errors
    /// `Input`, naming the impossible value.
    pub fn validate(&self) -> Result<()> {
        self.settings.validate().map_err(|error| error.of_kind(crate::ErrorKind::Input))?;
        let wrong = |what: &str| Err(Error::input(what));
        if self.clusters.is_empty() || self.clusters.contains(&0) {
            return wrong("has no clusters, or one without samples");
        }
        if self.clusters.iter().map(|count| u64::from(*count)).sum::<u64>() > MOST_SAMPLES as u64 {
            return wrong("has too many samples");
        }
        if self.all_vectors() > MOST_VECTORS {
            return wrong("has too many vectors of light");
        }
        if !(self.radius > 0.0 && self.radius.is_finite() && self.far > 0.0 && self.far.is_finite()) {
            return wrong("has distances that are not above 0");
        }
        Ok(())
    }

    /// Says in which part `scene` differs from the scene of the bake; `None`: in none.
    pub fn difference(&self, scene: &Scene) -> Option<String> {
        Part::difference(&self.parts, &parts(scene))
    }
}

/// Digests of the parts of a scene on which the transport of light depends: all but colours and lights, which may change at run time.
pub fn parts(scene: &Scene) -> Vec<Part> {
    let mut geometry = Vec::new();
    for primitive in scene.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        let mut floats = |values: &[f32]| geometry.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        primitive.positions.iter().for_each(|v| floats(&v.to_array()));
        primitive.normals.iter().for_each(|v| floats(&v.to_array()));
        geometry.extend(primitive.indices.iter().flat_map(|index| index.to_le_bytes()));
        geometry.extend(primitive.material.to_le_bytes());
    }
    // Cameras and lights have nodes, too, and a command may add some.
    let pose = crate::scene::Pose::rest(scene);
    let placed = scene.nodes.iter().zip(&pose.world).filter(|(node, _)| node.mesh.is_some());
    let placed = placed.map(|(node, world)| format!("{world:?} {:?} {:?}\n", node.mesh, node.weights));
    let mut texels = Vec::new();
    let mut coverage = String::new();
    for material in &scene.materials {
        coverage += &format!("{:?} {} {}", material.alpha, material.double_sided, material.unlit);
        if material.alpha != AlphaMode::Opaque {
            coverage += &format!(" {} {:?}", material.base_color.w, material.base_color_texture);
            let texture = material.base_color_texture.as_ref().map(|of| of.texture as usize);
            let texture = texture.and_then(|texture| scene.textures.get(texture));
            texels.extend(texture.into_iter().flat_map(|texture| texture.rgba.iter().map(|rgba| rgba[3])));
        }
        coverage.push('\n');
    }
    vec![
        Part::of("geometry", &geometry, format!("{} meshes", scene.meshes.len())),
        Part::of("nodes", placed.collect::<String>().as_bytes(), format!("{} nodes", scene.nodes.len())),
        Part::of("coverage", &[coverage.into_bytes(), texels].concat(), format!("{} materials", scene.materials.len())),
    ]
}

/// The places from which particles start.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Starts {
    /// World space, metres. Those of rooms that particles from lights and cameras do not reach come last.
    pub points: Vec<Vec3>,
    /// Number of such rooms, 8 at most.
    pub rooms: usize,
    /// No light and no camera is inside the scene, so the first point is the middle of the scene. It may be inside a solid body.
    pub guessed: bool,
}

/// Points inside a scene from which particles may start: its lights and cameras, and if none is inside, its middle. No point: the scene has no surface.
pub fn starts(scene: &Scene) -> Starts {
    let pose = crate::scene::Pose::rest(scene);
    let [low, high] = samples::bounds(&samples::Triangles::new(scene).list);
    let inside = |at: &Vec3| at.cmpgt(low).all() && at.cmplt(high).all();
    let of = |here: &dyn Fn(&crate::scene::Node) -> bool| -> Vec<Vec3> {
        let nodes = scene.nodes.iter().zip(&pose.world).filter(|(node, _)| here(node));
        nodes.map(|(_, world)| world.transform_point3(Vec3::ZERO)).filter(inside).collect()
    };
    let local = |light: u32| {
        let light = scene.lights.get(light as usize);
        light.is_some_and(|light| light.kind != crate::scene::LightKind::Directional)
    };
    let mut points = of(&|node| node.light.is_some_and(local));
    points.extend(of(&|node| node.camera.is_some()));
    let guessed = points.is_empty() && low.x <= high.x;
    if guessed {
        points.push(0.5 * (low + high));
    }
    Starts { points, rooms: 0, guessed }
}
