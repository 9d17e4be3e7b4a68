//! Files of precomputed transfer: `.prt`.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | `lucprt\r\n` |
//! | 4 | version, 4 |
//! | 4 | bytes of the header |
//! | … | header: JSON, the [`Plan`] and the bytes of each part |
//! | … | the samples, 68 bytes each: position, instance, normal of the side, triangle, shading normal, material, barycentrics, gap, area, free share of the hemisphere |
//! | … | for each cluster: distances, basis, transfer with its links and the first rays; lists begin with their lengths |
//! | 32 | BLAKE3 digest of all bytes before |
//!
//! Numbers are little-endian. Lists have 16-bit floats, but for the sizes of vectors, the rows of receivers, the numbers of links and those of the samples that rays
//! meet.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{
    Plan,
    cap::Cap,
    coded::Writer,
    transfer::{Basis, Transfer},
    units,
    visibility::Visibility,
};
use crate::{
    Error, Result,
    bake::{Digest, Store, UnitId, container::Container},
    image,
    shaders::types::PrtPoint,
};

const FILE: Container =
    Container { magic: *b"lucprt\r\n", version: 4, name: "a file of precomputed transfer", command: "prt bake" };
/// Largest size of a file that is read, bytes.
const MOST_BYTES: u64 = 8 << 30;

/// A whole bake.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    pub plan: Plan,
    /// Cluster after cluster.
    pub samples: Vec<PrtPoint>,
    /// One for each cluster.
    pub visibility: Vec<Visibility>,
    pub bases: Vec<Basis>,
    pub transfers: Vec<Transfer>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    plan: Plan,
    /// Bytes of the distances, the basis and the transfer of each cluster.
    parts: Vec<[u64; 3]>,
}

/// The sizes and the errors of a bake.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    pub samples: usize,
    pub clusters: usize,
    /// Area of all samples, m².
    pub area: f64,
    /// Least distance of two samples on a plane, metres.
    pub radius: f32,
    /// Bytes of the samples.
    pub sample_bytes: u64,
    /// Bytes of the mean distances and coefficients, which the paper counts.
    pub visibility_bytes: u64,
    /// Bytes of the vectors of the distances.
    pub visibility_vectors_bytes: u64,
    /// Bytes of the bases for direct light.
    pub basis_bytes: u64,
    /// Bytes of the transfer.
    pub transfer_bytes: u64,
    /// Bytes of the links.
    pub link_bytes: u64,
    /// Bytes of the samples that the first rays meet, for directional coefficients.
    pub directional_bytes: u64,
    /// Links of a sample, mean.
    pub links: f64,
    /// Share of the light that links carry, if all samples have the same radiosity.
    pub linked: f64,
    /// Share of the transfer's coefficients that are not 0.
    pub kept: f64,
    /// Root mean square of the error of a distance, metres.
    pub distance_error: f64,
    /// Share of transferred light that receivers leave out, root mean square over clusters.
    pub left: f64,
    /// Share of rays that met a surface without samples.
    pub lost: f64,
    /// Share of scattered particles that left the scene.
    pub escaped: f64,
}

impl Stored {
    /// Joins the units of a job that are all there, also on a machine that does not know the scene.
    ///
    /// # Errors
    /// As [`Self::join`].
    pub fn of_parts(store: &Store) -> Result<Self> {
        of_kind(store)?;
        let payload = store.open_unit(UnitId { stage: units::SAMPLES, index: 0 })?;
        payload.verify()?;
        let samples = payload.bytes()?;
        if samples.len() % size_of::<PrtPoint>() != 0 {
            return Err(Error::input("has a part of a sample at its end").in_file(store.folder()).at("samples"));
        }
        Self::join(store, bytemuck::pod_collect_to_vec(&samples))
    }

    /// Joins the units of a job that are all there.
    ///
    /// # Errors
    /// `Input`, naming the file, if the folder is of another kind of job, or if a unit is missing or damaged; `OutOfMemory`.
    pub fn join(store: &Store, samples: Vec<PrtPoint>) -> Result<Self> {
        let job = store.job();
        let wrong = |what: String| Error::input(what).in_file(store.folder());
        of_kind(store)?;
        let plan: Plan = serde_json::from_value(job.about.clone())
            .map_err(|error| wrong("has a plan that cannot be read".into()).caused_by(error))?;
        check(&plan, &samples).map_err(|error| error.in_file(store.folder()))?;
        let open = |stage: u32, index: usize| {
            let payload = store.open_unit(UnitId { stage, index: index as u32 })?;
            payload.verify()?;
            payload.bytes()
        };
        let mut out = Self { plan, samples, visibility: Vec::new(), bases: Vec::new(), transfers: Vec::new() };
        for cluster in 0..out.plan.clusters.len() {
            let parts = [units::VISIBILITY, units::BASIS, units::TRANSFER].map(|stage| open(stage, cluster));
            let [visibility, basis, transfer] = parts;
            out.push(cluster, [&visibility?, &basis?, &transfer?])
                .map_err(|error| error.in_file(store.folder()).at(format!("cluster {cluster}")))?;
        }
        Ok(out)
    }

    /// Adds the parts of a cluster.
    fn push(&mut self, cluster: usize, [visibility, basis, transfer]: [&[u8]; 3]) -> Result<()> {
        let directions = self.cap(cluster).directions();
        self.visibility.push(units::visibility(visibility, &self.plan, directions, cluster)?);
        self.bases.push(units::basis(basis, &self.plan, cluster)?);
        self.transfers.push(units::transfer(transfer, &self.plan, cluster)?);
        Ok(())
    }

    /// The directions of a cluster.
    pub fn cap(&self, cluster: usize) -> Cap {
        self.plan.cap(&self.samples, cluster)
    }

    /// The bytes of a file. Equal bakes give equal bytes.
    ///
    /// # Errors
    /// `Runtime` if the header cannot be written.
    pub fn encode(&self) -> Result<Vec<u8>> {
        let written = |write: &dyn Fn(&mut Writer)| {
            let mut out = Writer::default();
            write(&mut out);
            out.0
        };
        let parts: Vec<[Vec<u8>; 3]> = (0..self.plan.clusters.len())
            .map(|c| {
                [
                    written(&|out| self.visibility[c].write(out)),
                    written(&|out| self.bases[c].write(out)),
                    written(&|out| self.transfers[c].write(out)),
                ]
            })
            .collect();
        let lengths = parts.iter().map(|parts| [0, 1, 2].map(|i| parts[i].len() as u64)).collect();
        let body = [bytemuck::cast_slice(&self.samples), &parts.concat().concat()].concat();
        FILE.encode(&Header { plan: self.plan.clone(), parts: lengths }, &body)
    }

    /// Reads a file, and gives the digest at its end.
    ///
    /// # Errors
    /// `Input`, naming the file and the fault.
    pub fn read(path: &Path) -> Result<(Self, Digest)> {
        let bytes = image::read_file_checked(path, MOST_BYTES)?;
        let stored = Self::decode(&bytes).map_err(|error| error.in_file(path))?;
        Ok((stored, Container::digest(&bytes)))
    }

    /// # Errors
    /// `Input`, naming the fault.
    pub fn decode(bytes: &[u8]) -> Result<Self> {
        let damaged = |what: String| FILE.damaged(what);
        let of_samples = |plan: &Plan| (plan.count() * size_of::<PrtPoint>()) as u64;
        let (header, body) = FILE.decode(bytes, |Header { plan, parts }: &Header| {
            plan.validate().map_err(|error| damaged(format!("has an impossible plan: {error}")))?;
            if parts.len() != plan.clusters.len() {
                let what = format!("has parts of {} clusters; its plan has {}", parts.len(), plan.clusters.len());
                return Err(damaged(what));
            }
            let mut lengths = parts.iter().flatten();
            Ok(lengths.try_fold(of_samples(plan), |sum, length| sum.checked_add(*length)))
        })?;
        let Header { plan, parts } = header;
        let (samples, mut rest) = body.split_at(of_samples(&plan) as usize);
        let samples: Vec<PrtPoint> = bytemuck::pod_collect_to_vec(samples);
        check(&plan, &samples).map_err(|error| damaged(error.to_string()))?;
        let mut out = Self { plan, samples, visibility: Vec::new(), bases: Vec::new(), transfers: Vec::new() };
        for (cluster, lengths) in parts.iter().enumerate() {
            let mut next = |length: u64| {
                let (taken, after) = rest.split_at(length as usize);
                rest = after;
                taken
            };
            let of_cluster = lengths.map(&mut next);
            out.push(cluster, of_cluster).map_err(|error| error.at(format!("cluster {cluster}")))?;
        }
        Ok(out)
    }

    /// The sizes and the errors of the bake.
    pub fn summary(&self) -> Summary {
        let mean = |value: &dyn Fn(usize) -> f64| {
            let all = (0..self.plan.clusters.len()).map(|c| value(c) * f64::from(self.plan.clusters[c]));
            all.sum::<f64>() / self.samples.len().max(1) as f64
        };
        let sum = |value: &dyn Fn(usize) -> u64| (0..self.plan.clusters.len()).map(value).sum::<u64>();
        Summary {
            samples: self.samples.len(),
            clusters: self.plan.clusters.len(),
            area: self.samples.iter().map(|sample| f64::from(sample.area)).sum(),
            radius: self.plan.radius,
            sample_bytes: (self.samples.len() * size_of::<PrtPoint>()) as u64,
            visibility_bytes: sum(&|c| self.visibility[c].bytes()[0]),
            visibility_vectors_bytes: sum(&|c| self.visibility[c].bytes()[1]),
            basis_bytes: sum(&|c| 2 * self.bases[c].values.len() as u64 + 4 * self.bases[c].sizes.len() as u64),
            transfer_bytes: sum(&|c| self.transfers[c].bytes()),
            link_bytes: sum(&|c| self.transfers[c].links.bytes()),
            directional_bytes: sum(&|c| 4 * self.transfers[c].met.len() as u64),
            links: sum(&|c| self.transfers[c].links.senders.len() as u64) as f64 / self.samples.len().max(1) as f64,
            linked: sum(&|c| self.transfers[c].links.rays.iter().map(|rays| u64::from(*rays)).sum()) as f64
                / (self.samples.len().max(1) as f64 * f64::from(self.plan.settings.rays)),
            kept: mean(&|c| self.transfers[c].kept()),
            distance_error: mean(&|c| f64::from(self.visibility[c].error).powi(2)).sqrt(),
            left: mean(&|c| f64::from(self.transfers[c].left).powi(2)).sqrt(),
            lost: mean(&|c| f64::from(self.transfers[c].lost)),
            escaped: self.plan.escaped,
        }
    }
}

/// Checks that a folder is that of a bake.
fn of_kind(store: &Store) -> Result<()> {
    match store.job().key().kind() {
        units::KIND => Ok(()),
        kind => {
            Err(Error::input(format!("is a job of kind `{kind}`, not of `{}`", units::KIND)).in_file(store.folder()))
        }
    }
}

/// Checks that samples are those of a plan, and that their numbers are usable.
fn check(plan: &Plan, samples: &[PrtPoint]) -> Result<()> {
    plan.validate()?;
    if Digest::of(bytemuck::cast_slice(samples)) != plan.samples || samples.len() != plan.count() {
        return Err(Error::input("its samples are not those of its plan"));
    }
    let finite = |s: &PrtPoint| {
        let all = [s.position, s.side, s.normal].concat();
        all.iter().chain([&s.gap, &s.area, &s.open]).all(|value| value.is_finite()) && s.area >= 0.0 && s.open > 0.0
    };
    if samples.iter().all(finite) { Ok(()) } else { Err(Error::input("a sample has numbers that are not finite")) }
}
