//! Bakes as jobs of [`crate::bake`]. Each cluster is a unit of each stage: the distances around its samples, the samples that they see, the light of
//! the examples, the basis of that light, and the light that all bases send to the cluster.

use std::{sync::Arc, time::Instant};

use half::f16;

use super::{
    Bakery, Plan, Sampled,
    coded::{Reader, Writer},
    transfer::{Basis, INDIRECT, Senders, Transfer, areas, gathered},
    visibility::Visibility,
};
use crate::{
    Error, ErrorKind, Result,
    bake::{Job, Key, Needed, Stage, UnitId, Which},
};

/// The name of such jobs.
pub const KIND: &str = "prt";
/// Increased whenever the computation changes.
const VERSION: u32 = 4;

/// Numbers of the stages. All machines put the same samples on the surfaces; the one unit of the last stage keeps them for the file.
pub const VISIBILITY: u32 = 0;
pub const GATHER: u32 = 1;
pub const DIRECT: u32 = 2;
pub const BASIS: u32 = 3;
pub const TRANSFER: u32 = 4;
pub const SAMPLES: u32 = 5;
/// Names of the stages.
const STAGES: [&str; 6] = ["visibility", "gather", "direct", "basis", "transfer", "samples"];

/// The job of a plan on a device. Its key contains the whole plan.
///
/// # Errors
/// `Runtime` if the plan cannot be text.
pub fn job(plan: &Plan, samples: &[crate::shaders::types::PrtPoint], device: &str) -> Result<Job> {
    let text = |error| Error::new(ErrorKind::Runtime, "the plan of the bake cannot be text").caused_by(error);
    let about = serde_json::to_value(plan).map_err(text)?;
    let key = Key::new(KIND, VERSION).text("device", device).plan(&plan.parts, &about);
    let settings = &plan.settings;
    let costs = |each: &dyn Fn(usize) -> u64| -> Vec<u64> {
        (0..plan.clusters.len()).map(|c| (u64::from(plan.clusters[c]) * each(c)).max(1)).collect()
    };
    let name = |stage: u32| STAGES[stage as usize];
    let directions = |cluster: usize| plan.cap(samples, cluster).directions() as u64;
    let stages = vec![
        // Principal components take as long as the rays.
        Stage::new(name(VISIBILITY), costs(&|cluster| 2 * directions(cluster))),
        // Rays with a search for a sample.
        Stage::new(name(GATHER), costs(&|_| 2 * u64::from(settings.rays))),
        Stage::new(name(DIRECT), costs(&|_| u64::from(settings.examples) / 2)),
        Stage::new(name(BASIS), costs(&|_| u64::from(settings.examples)))
            .needs(GATHER, Which::Same)
            .needs(DIRECT, Which::All),
        Stage::new(name(TRANSFER), costs(&|_| u64::from(settings.rays)))
            .needs(GATHER, Which::Same)
            .needs(BASIS, Which::All),
        Stage::new(name(SAMPLES), vec![plan.count().max(1) as u64]),
    ];
    Ok(Job::new(key, stages)?.about(about))
}

/// Computes units.
#[derive(Debug)]
pub struct Work {
    bakery: Bakery,
    sampled: Sampled,
    /// Light of the first examples at all samples.
    first: Option<Arc<Vec<f32>>>,
    senders: Option<Arc<Senders>>,
    /// Time of each stage, seconds.
    spent: [f64; STAGES.len()],
}

impl Work {
    /// Moves the samples to the device.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn new(mut bakery: Bakery, sampled: Sampled) -> Result<Self> {
        bakery.upload(&sampled.plan, &sampled.samples)?;
        Ok(Self { bakery, sampled, first: None, senders: None, spent: [0.0; STAGES.len()] })
    }

    /// The stages, and the time that their units have taken so far, seconds.
    pub fn seconds(&self) -> impl Iterator<Item = (&'static str, f64)> {
        STAGES.into_iter().zip(self.spent)
    }

    /// The bytes of a unit.
    ///
    /// # Errors
    /// `Input` if a unit that is needed is damaged; `OutOfMemory`, `DeviceLost`, `Interrupted`.
    pub fn unit(&mut self, unit: UnitId, needed: &Needed<'_>) -> Result<Vec<u8>> {
        let begun = Instant::now();
        let bytes = self.bytes(unit, needed);
        if let Some(spent) = self.spent.get_mut(unit.stage as usize) {
            *spent += begun.elapsed().as_secs_f64();
        }
        bytes
    }

    fn bytes(&mut self, unit: UnitId, needed: &Needed<'_>) -> Result<Vec<u8>> {
        let cluster = unit.index as usize;
        let plan = &self.sampled.plan;
        let samples = &self.sampled.samples;
        match unit.stage {
            VISIBILITY => {
                let cap = plan.cap(samples, cluster);
                let depths = self.bakery.depths(plan, cluster, &cap)?;
                let mut out = Writer::default();
                Visibility::compress(&depths, &cap, plan.settings.visibility, plan.far)?.write(&mut out);
                Ok(out.0)
            }
            GATHER => Ok(bytemuck::cast_slice(&self.bakery.gather(plan, cluster)?).to_vec()),
            DIRECT => {
                let lit = self.bakery.lit(plan, cluster, &self.sampled.examples, 2.0 * plan.radius)?;
                // The bits of f32 would need twice the space; examples need no more than 11 bits. In units in which a light at the other end of the
                // room gives 1, so that rooms of all sizes have numbers that 16 bits hold.
                let scale = scale(&self.sampled.plan);
                let lit: Vec<f16> =
                    lit.into_iter().map(|e| f16::from_f32((e * scale).min(f16::MAX.to_f32()))).collect();
                Ok(lit.iter().flat_map(|value| value.to_le_bytes()).collect())
            }
            SAMPLES => Ok(bytemuck::cast_slice(samples).to_vec()),
            BASIS => {
                let seen = words(&needed.open(UnitId { stage: GATHER, index: unit.index })?.bytes()?);
                let few = self.sampled.examples.len().min(INDIRECT);
                let indirect = match plan.settings.centred {
                    true => Vec::new(),
                    false => gathered(&seen, plan.settings.rays as usize, &self.first_lights(needed)?, few),
                };
                let plan = &self.sampled.plan;
                let direct = halves(&needed.open(UnitId { stage: DIRECT, index: unit.index })?.bytes()?);
                let areas = areas(plan, &self.sampled.samples, cluster);
                let vectors = plan.vectors(cluster) - usize::from(plan.settings.centred);
                let light = (direct.as_slice(), indirect.as_slice(), scale(plan));
                let basis = Basis::new(&areas, light, vectors, plan.settings.centred)?;
                let mut out = Writer::default();
                basis.write(&mut out);
                Ok(out.0)
            }
            _ => {
                let seen = words(&needed.open(UnitId { stage: GATHER, index: unit.index })?.bytes()?);
                let senders = self.senders(needed)?;
                let transfer = senders.transfer(&self.sampled.plan, &self.sampled.samples, cluster, &seen)?;
                let mut out = Writer::default();
                transfer.write(&mut out);
                Ok(out.0)
            }
        }
    }

    /// The light of the first examples at all samples.
    fn first_lights(&mut self, needed: &Needed<'_>) -> Result<Arc<Vec<f32>>> {
        if let Some(first) = &self.first {
            return Ok(first.clone());
        }
        let lights = self.sampled.examples.len();
        let few = lights.min(INDIRECT);
        let mut all = Vec::new();
        for index in 0..self.sampled.plan.clusters.len() as u32 {
            let lit = halves(&needed.open(UnitId { stage: DIRECT, index })?.bytes()?);
            all.extend(lit.chunks_exact(lights.max(1)).flat_map(|row| row[..few].iter().copied()));
        }
        let first = Arc::new(all);
        self.first = Some(first.clone());
        Ok(first)
    }

    fn senders(&mut self, needed: &Needed<'_>) -> Result<Arc<Senders>> {
        if let Some(senders) = &self.senders {
            return Ok(senders.clone());
        }
        let plan = &self.sampled.plan;
        let mut bases = Vec::new();
        for index in 0..plan.clusters.len() {
            let bytes = needed.open(UnitId { stage: BASIS, index: index as u32 })?.bytes()?;
            bases.push(basis(&bytes, plan, index)?);
        }
        let senders = Arc::new(Senders::new(plan, &self.sampled.samples, &bases));
        self.senders = Some(senders.clone());
        Ok(senders)
    }

    /// The samples of the bake.
    pub fn sampled(&self) -> &Sampled {
        &self.sampled
    }
}

/// Factor on the light of examples.
fn scale(plan: &Plan) -> f32 {
    plan.far * plan.far
}

fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

fn halves(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(2).map(|b| f16::from_le_bytes([b[0], b[1]]).to_f32()).collect()
}

/// Reads the distances of a cluster.
pub(super) fn visibility(bytes: &[u8], plan: &Plan, directions: usize, cluster: usize) -> Result<Visibility> {
    let mut reader = Reader(bytes);
    let out = Visibility::read(&mut reader, plan.clusters[cluster] as usize, directions)?;
    reader.end()?;
    Ok(out)
}

/// Reads the basis of a cluster.
pub(super) fn basis(bytes: &[u8], plan: &Plan, cluster: usize) -> Result<Basis> {
    let mut reader = Reader(bytes);
    let out = Basis::read(&mut reader, plan.clusters[cluster] as usize, plan.vectors(cluster))?;
    reader.end()?;
    Ok(out)
}

/// Reads the transfer to a cluster.
pub(super) fn transfer(bytes: &[u8], plan: &Plan, cluster: usize) -> Result<Transfer> {
    let mut reader = Reader(bytes);
    let samples = plan.clusters[cluster] as usize;
    let counts = [plan.all_vectors(), plan.count(), plan.settings.kept_rays()];
    let out = Transfer::read(&mut reader, samples, counts, plan.settings.receivers > 0)?;
    reader.end()?;
    Ok(out)
}
