//! A bake on a device, and the passes from the lights of a frame to the irradiance of the samples.

use glam::Vec3;
use half::f16;

use super::{
    Plan, Settings, Stored, bakery,
    grid::Grid,
    samples,
    solve::{self, Solved},
};
use crate::{
    Error, Result,
    gpu::{Gpu, OwnedBuffer},
    graph::{Buffer, Graph, Runner},
    passes::shadow::ShadowMaps,
    resident::Resident,
    scene::{Pose, Scene},
    shaders::{
        consts,
        prt::{albedo, directions, lit, lit_by_maps, mix, project, radiosity, receive, restore, scatter},
        types::{PrtCap, PrtPoint, PrtReceiver, PrtSample, PrtVector},
    },
};

/// A bake on a device.
#[derive(Debug)]
pub struct OnDevice {
    pub samples: OwnedBuffer,
    /// The cluster of each sample.
    pub clusters: OwnedBuffer,
    pub grid: Grid,
    pub starts: OwnedBuffer,
    pub order: OwnedBuffer,
    pub count: u32,
    caps: OwnedBuffer,
    rows: OwnedBuffer,
    albedos: OwnedBuffer,
    vectors: Vec<PrtVector>,
    weights: OwnedBuffer,
    /// All scatterings, for red, green and blue.
    matrices: OwnedBuffer,
    receivers: OwnedBuffer,
    words: OwnedBuffer,
    /// Values of the vectors of light at each sample, senders of links and their shares; empty without links.
    functions: OwnedBuffer,
    senders: OwnedBuffer,
    shares: OwnedBuffer,
    /// The samples that the first rays of each sample meet, the number of these rays, and the seed of their directions; `None`: the bake has none.
    met: Option<(OwnedBuffer, u32, u32)>,
    /// Scatterings whose light links carry; `None`: there are no links.
    linked: Option<u32>,
    /// Rows of the receivers' vectors; `None`: samples have their parts of the vectors of light.
    mixed: Option<(OwnedBuffer, u32)>,
    /// Numbers that a frame multiplies: for each sample and light point; for each sample; between bases.
    pub products: [u64; 3],
    /// Rays whose light a frame adds up for directional coefficients.
    pub directions: u64,
}

/// Light at the samples.
#[derive(Clone, Copy, Debug)]
pub struct Lit {
    /// Irradiance before any scattering, W/m².
    pub direct: Buffer,
    /// Irradiance after at least one scattering, W/m².
    pub irradiances: Buffer,
    /// Share of each light that a sample sees.
    pub visible: Buffer,
}

/// Two halves in a word; an odd number of them is filled up with 0.
fn packed(halves: impl IntoIterator<Item = f16>) -> Vec<u32> {
    let halves: Vec<u32> = halves.into_iter().map(|half| u32::from(half.to_bits())).collect();
    halves.chunks(2).map(|pair| pair[0] | pair.get(1).copied().unwrap_or(0) << 16).collect()
}

impl OnDevice {
    /// Uploads a bake, with [`scattering`] by the materials of a scene.
    ///
    /// # Errors
    /// As [`scattering`] and [`Self::with`].
    pub fn new(gpu: &Gpu, scene: &Scene, stored: &Stored, settings: &Settings) -> Result<Self> {
        let (albedos, solved) = scattering(gpu, scene, stored, settings)?;
        Self::with(gpu, stored, &albedos, &solved)
    }

    /// Uploads a bake with the albedos of its samples and all scatterings.
    ///
    /// # Errors
    /// `Input` if the device's buffers are too small; `OutOfMemory`, `DeviceLost`.
    pub fn with(gpu: &Gpu, stored: &Stored, albedos: &[[f32; 3]], solved: &Solved) -> Result<Self> {
        let plan = &stored.plan;
        let all = plan.all_vectors();
        let (mut clusters, mut caps, mut rows) = (Vec::new(), Vec::new(), Vec::new());
        let (mut vectors, mut weights) = (Vec::new(), Vec::new());
        let (mut receivers, mut words, mut mixed) = (Vec::new(), Vec::new(), Vec::<f32>::new());
        let mut of_mixed = 0u32;
        let (mut functions, mut senders, mut shares) = (Vec::new(), Vec::new(), Vec::new());
        let links = stored.transfers.iter().any(|of| !of.links.senders.is_empty());
        let mut products = [0u64; 3];
        for cluster in 0..plan.clusters.len() {
            let (range, count) = (plan.range(cluster), plan.clusters[cluster]);
            clusters.extend(std::iter::repeat_n(cluster as u32, count as usize));
            // Rows of directions: the mean and the vectors. Rows of samples: 1 and the coefficients.
            let (visibility, cap) = (&stored.visibility[cluster], stored.cap(cluster));
            let of_row = visibility.vectors as usize;
            let first_row = rows.len() as u32;
            for (direction, mean) in visibility.mean.iter().enumerate() {
                let vectors = &visibility.basis[direction * of_row..][..of_row];
                rows.extend(packed(std::iter::once(*mean).chain(vectors.iter().copied())));
            }
            let first_sample_row = rows.len() as u32;
            for sample in 0..count as usize {
                let coefficients = &visibility.coefficients[sample * of_row..][..of_row];
                rows.extend(packed(std::iter::once(f16::ONE).chain(coefficients.iter().copied())));
            }
            caps.push(PrtCap {
                first_row,
                first_sample_row,
                words: (of_row as u32 + 2) / 2,
                ..bakery::device_cap(&cap, [range.start as u32, count])
            });
            let (basis, transfer) = (&stored.bases[cluster], &stored.transfers[cluster]);
            let first_weight = weights.len() as u32;
            let samples = &stored.samples[range.clone()];
            samples.iter().enumerate().for_each(|(number, s)| weights.extend(basis.weights(number, s.area)));
            for number in 0..basis.vectors {
                vectors.push(PrtVector {
                    first_sample: range.start as u32,
                    samples: count,
                    first_weight,
                    stride: basis.vectors,
                    number,
                    is_mean: u32::from(basis.centred && number + 1 == basis.vectors),
                    ..PrtVector::default()
                });
            }
            let stride = transfer.stride(all);
            let first_mixed = if plan.settings.receivers > 0 { of_mixed } else { 0 };
            for (number, sample) in samples.iter().enumerate() {
                let (first_link, first_function) = (senders.len() as u32, functions.len() as u32);
                for (sender, share) in transfer.links.of(number, plan.settings.rays) {
                    senders.push(sender as u32);
                    shares.push(share);
                }
                receivers.push(PrtReceiver {
                    first_word: words.len() as u32,
                    first_mixed,
                    count: stride as u32,
                    first_link,
                    links: senders.len() as u32 - first_link,
                    first_function,
                    first_vector: plan.first_vector(cluster) as u32,
                    vectors: basis.vectors,
                });
                words.extend(packed(transfer.values[number * stride..][..stride].iter().copied()));
                if links {
                    functions.extend(basis.functions(number, sample.area));
                }
            }
            mixed.extend(&transfer.rows);
            of_mixed += transfer.rank;
            products[0] += 4 * u64::from(visibility.vectors + 1) * u64::from(count);
            products[1] += u64::from(count) * (stride as u64 + u64::from(basis.vectors));
        }
        let rounds = u64::from(solved.linked.max(1));
        if links {
            let again = (rounds - 1) * products[1];
            products[1] += again + rounds * senders.len() as u64 + functions.len() as u64;
        }
        let most = gpu.caps().limits.storage_range;
        let largest =
            4 * [words.len(), rows.len(), weights.len(), mixed.len(), all * all * 3, functions.len(), senders.len()]
                .into_iter()
                .max()
                .unwrap_or(0) as u64;
        if largest > most {
            let what =
                format!("has {largest} bytes of one kind of vectors or links, and the device's buffers hold {most}");
            let error = Error::input(what);
            return Err(
                error.help(
                    "Bake with fewer vectors (room.light, room.visibility), with room.receivers above 0, or with fewer links (a larger room.links)",
                )
            );
        }
        products[2] = 3 * (all * all) as u64 + rounds * mixed.len() as u64;
        let kept = plan.settings.kept_rays() as u64;
        let directions = kept * stored.samples.len() as u64;
        if 4 * directions > most || kept > 0 && 12 * u64::from(consts::PRT_LOBES) * stored.samples.len() as u64 > most {
            let what = format!("keeps {directions} rays, too many for the device's buffers of {most} bytes");
            return Err(Error::input(what).help("Bake with fewer samples, or keep fewer rays (room.directional)"));
        }
        let grid = Grid::new(&stored.samples, plan.radius);
        let buffer = |name, bytes: &[u8]| {
            let filled = if bytes.is_empty() { &[0; 16][..] } else { bytes };
            OwnedBuffer::with_contents(gpu, name, filled)
        };
        let samples: Vec<PrtSample> = stored.samples.iter().map(|of| samples::for_pictures(of, plan.radius)).collect();
        let samples = buffer("prt.samples", bytemuck::cast_slice(&samples))?;
        let Solved { inverse, shift, fixed, linked } = solved;
        for ((vector, shift), fixed) in vectors.iter_mut().zip(shift).zip(fixed) {
            (vector.shift, vector.fixed_value) = (*shift, *fixed);
        }
        Ok(Self {
            samples,
            clusters: buffer("prt.clusters", bytemuck::cast_slice(&clusters))?,
            starts: buffer("prt.cells", bytemuck::cast_slice(&grid.starts))?,
            order: buffer("prt.order", bytemuck::cast_slice(&grid.order))?,
            grid,
            count: stored.samples.len() as u32,
            caps: buffer("prt.caps", bytemuck::cast_slice(&caps))?,
            rows: buffer("prt.rows", bytemuck::cast_slice(&rows))?,
            albedos: buffer("prt.albedos", bytemuck::cast_slice(albedos))?,
            vectors,
            weights: buffer("prt.weights", bytemuck::cast_slice(&weights))?,
            matrices: buffer("prt.matrices", bytemuck::cast_slice(&inverse.concat()))?,
            receivers: buffer("prt.receivers", bytemuck::cast_slice(&receivers))?,
            words: buffer("prt.words", bytemuck::cast_slice(&words))?,
            functions: buffer("prt.functions", bytemuck::cast_slice(&functions))?,
            senders: buffer("prt.senders", bytemuck::cast_slice(&senders))?,
            shares: buffer("prt.shares", bytemuck::cast_slice(&shares))?,
            met: match kept {
                0 => None,
                kept => {
                    let met: Vec<u32> = stored.transfers.iter().flat_map(|transfer| &transfer.met).copied().collect();
                    let met = buffer("prt.met", bytemuck::cast_slice(&met))?;
                    Some((met, kept as u32, plan.settings.seed))
                }
            },
            directions,
            linked: links.then_some(*linked),
            mixed: match plan.settings.receivers {
                0 => None,
                _ => Some((buffer("prt.mixed-rows", bytemuck::cast_slice(&mixed))?, of_mixed)),
            },
            products,
        })
    }

    /// The light of a frame's lights at the samples. `lights`: the lights of the frame, and their number; `maps`: their shadow maps, in the place of the stored
    /// distances.
    pub fn light(
        &self,
        graph: &mut Graph,
        plan: &Plan,
        (lights, light_count): (Buffer, u32),
        maps: Option<&ShadowMaps>,
        settings: &Settings,
    ) -> Lit {
        let count = self.count;
        let direct = graph.buffer("prt.direct", 12 * u64::from(count));
        let visible = graph.buffer("prt.visible", 4 * u64::from(count) * u64::from(light_count.max(1)));
        match maps {
            None => self.by_distances(graph, plan, (lights, light_count), (direct, visible), settings),
            Some(maps) => {
                let args = lit_by_maps::Args {
                    samples: graph.import_buffer(&self.samples),
                    lights,
                    shadows: maps.shadows,
                    shadow_maps: maps.maps,
                    direct,
                    visible,
                    push: lit_by_maps::Push { count, strength: settings.strength },
                };
                graph.compute(args, count);
            }
        }
        self.scattered(graph, direct, visible)
    }

    /// Direct light by the stored distances.
    fn by_distances(
        &self,
        graph: &mut Graph,
        plan: &Plan,
        (lights, light_count): (Buffer, u32),
        (direct, visible): (Buffer, Buffer),
        settings: &Settings,
    ) {
        let count = self.count;
        let samples = graph.import_buffer(&self.samples);
        let offsets = points_of_lights(settings);
        let args = lit::Args {
            samples,
            clusters: graph.import_buffer(&self.clusters),
            caps: graph.import_buffer(&self.caps),
            rows: graph.import_buffer(&self.rows),
            offsets: graph.buffer_from("prt.offsets", &offsets),
            lights,
            direct,
            visible,
            push: lit::Push {
                count,
                points: offsets.len() as u32,
                bias: settings.bias,
                bias_distance: settings.bias_distance * plan.radius,
                strength: settings.strength,
                far_of_room: plan.far,
            },
        };
        graph.compute(args, count).rays(u64::from(count) * offsets.len() as u64 * u64::from(light_count));
    }

    /// The transferred light of this direct light.
    fn scattered(&self, graph: &mut Graph, direct: Buffer, visible: Buffer) -> Lit {
        let mut radiosities = self.radiosity(graph, direct, None);
        let projected = self.project(graph, radiosities);
        let all = self.vectors();
        let scattered = graph.buffer("prt.scattered", 12 * u64::from(all));
        let args = scatter::Args {
            matrices: graph.import_buffer(&self.matrices),
            before: projected,
            after: scattered,
            push: scatter::Push { count: all },
        };
        graph.compute(args, all);
        let linked = self.linked.unwrap_or(0);
        if linked == 0 {
            return Lit { direct, irradiances: self.sent(graph, scattered), visible };
        }
        // The first scattering through links has the direct light itself; the light of all further ones is that of the vectors.
        radiosities = self.restore(graph, scattered, Some((radiosities, projected)));
        let mut irradiances = self.receive(graph, scattered, radiosities);
        for _ in 1..linked {
            radiosities = self.radiosity(graph, direct, Some(irradiances));
            let projected = self.project(graph, radiosities);
            irradiances = self.receive(graph, projected, radiosities);
        }
        Lit { direct, irradiances, visible }
    }

    /// Directional coefficients of the transferred light of the samples, [`consts::PRT_LOBES`] of each, W/(m² sr); `None`: the bake has none.
    pub fn directions(&self, graph: &mut Graph, lit: &Lit, settings: &Settings) -> Option<Buffer> {
        let (met, rays, seed) = self.met.as_ref()?;
        let terms = graph.buffer("prt.directions", 12 * u64::from(consts::PRT_LOBES) * u64::from(self.count));
        let args = directions::Args {
            met: graph.import_buffer(met),
            // The light before the last scattering: its sum over the rays is the light that arrives.
            radiosities: self.radiosity(graph, lit.direct, settings.bounces.then_some(lit.irradiances)),
            terms,
            push: directions::Push { count: self.count, rays: *rays, seed: *seed },
        };
        graph.compute(args, self.count);
        Some(terms)
    }

    /// Irradiance of the samples by light that has these coefficients of all vectors, and nothing beside them.
    pub fn sent(&self, graph: &mut Graph, coefficients: Buffer) -> Buffer {
        // Without links no radiosity is read.
        let radiosities = match self.linked {
            Some(_) => self.restore(graph, coefficients, None),
            None => coefficients,
        };
        self.receive(graph, coefficients, radiosities)
    }

    /// Radiosity of the samples by this direct and indirect irradiance.
    fn radiosity(&self, graph: &mut Graph, direct: Buffer, indirect: Option<Buffer>) -> Buffer {
        let radiosities = graph.buffer("prt.radiosities", 12 * u64::from(self.count));
        let args = radiosity::Args {
            albedos: graph.import_buffer(&self.albedos),
            direct,
            indirect: indirect.unwrap_or(direct),
            radiosities,
            push: radiosity::Push { count: self.count, indirectly: indirect.is_some().into() },
        };
        graph.compute(args, self.count);
        radiosities
    }

    /// The coefficients of this radiosity.
    fn project(&self, graph: &mut Graph, radiosities: Buffer) -> Buffer {
        let all = self.vectors();
        let coefficients = graph.buffer("prt.projected", 12 * u64::from(all));
        let args = project::Args {
            vectors: graph.buffer_from("prt.vectors", &self.vectors),
            weights: graph.import_buffer(&self.weights),
            radiosities,
            coefficients,
            push: project::Push { count: all },
        };
        graph.compute(args, all);
        coefficients
    }

    /// Radiosity of the samples that has these coefficients. `exact`: radiosity that is known, and its coefficients; only the rest of the coefficients
    /// is then restored.
    fn restore(&self, graph: &mut Graph, coefficients: Buffer, exact: Option<(Buffer, Buffer)>) -> Buffer {
        let restored = graph.buffer("prt.restored", 12 * u64::from(self.count));
        let (radiosities, known) = exact.unwrap_or((coefficients, coefficients));
        let args = restore::Args {
            receivers: graph.import_buffer(&self.receivers),
            functions: graph.import_buffer(&self.functions),
            coefficients,
            known,
            radiosities,
            restored,
            push: restore::Push { count: self.count, exactly: exact.is_some().into() },
        };
        graph.compute(args, self.count);
        restored
    }

    /// Irradiance of the samples by light with these coefficients of all vectors, and by the radiosity of linked samples.
    fn receive(&self, graph: &mut Graph, coefficients: Buffer, radiosities: Buffer) -> Buffer {
        let mixed = match &self.mixed {
            None => coefficients,
            Some((rows, count)) => {
                let mixed = graph.buffer("prt.mixed", 12 * u64::from(*count).max(1));
                let vectors = self.vectors.len() as u32;
                let args = mix::Args {
                    rows: graph.import_buffer(rows),
                    coefficients,
                    mixed,
                    push: mix::Push { count: *count, vectors },
                };
                graph.compute(args, *count);
                mixed
            }
        };
        let irradiances = graph.buffer("prt.irradiances", 12 * u64::from(self.count));
        let args = receive::Args {
            receivers: graph.import_buffer(&self.receivers),
            words: graph.import_buffer(&self.words),
            mixed,
            senders: graph.import_buffer(&self.senders),
            shares: graph.import_buffer(&self.shares),
            radiosities,
            irradiances,
            push: receive::Push { count: self.count },
        };
        graph.compute(args, self.count);
        irradiances
    }

    /// Number of vectors of light.
    pub fn vectors(&self) -> u32 {
        self.vectors.len() as u32
    }
}

/// The points of a light around its place, metres: evenly on a sphere (a spiral of the golden angle).
pub fn points_of_lights(settings: &Settings) -> Vec<[f32; 3]> {
    let count = if settings.radius > 0.0 { settings.points } else { 1 };
    (0..count)
        .map(|i| {
            if count == 1 {
                return [0.0; 3];
            }
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / count as f32;
            let around = i as f32 * std::f32::consts::PI * (3.0 - 5f32.sqrt());
            let across = (1.0 - y * y).sqrt();
            (settings.radius * Vec3::new(across * around.cos(), y, across * around.sin())).to_array()
        })
        .collect()
}

/// The albedos of the samples by the materials of a scene, and all scatterings with them. With `gloss`, all reflected energy counts, not that of the
/// diffuse base alone. `gloss`, `bounces`, `mean` and `linked` of the settings count.
///
/// # Errors
/// As [`solve::solve`]; `OutOfMemory`, `DeviceLost`; `Runtime` if the scene is larger than the device's limits.
pub fn scattering(gpu: &Gpu, scene: &Scene, stored: &Stored, settings: &Settings) -> Result<(Vec<[f32; 3]>, Solved)> {
    let albedos = albedos(gpu, scene, &stored.samples, settings.gloss)?;
    let solved = solve::solve(stored, &albedos, settings)?;
    Ok((albedos, solved))
}

/// The albedos of samples by the materials of a scene.
fn albedos(gpu: &Gpu, scene: &Scene, samples: &[PrtPoint], gloss: bool) -> Result<Vec<[f32; 3]>> {
    let count = samples.len() as u32;
    let scene = Scene { environment: None, ..scene.clone() };
    let mut resident = Resident::for_rays(gpu, &scene)?;
    let mut graph = Graph::new("prt.albedo");
    let handles = resident.frame_in(&mut graph, &scene, &Pose::rest(&scene));
    let albedos = graph.buffer("prt.albedos", 12 * u64::from(count));
    let args = albedo::Args {
        materials: handles.materials,
        scene_textures: handles.textures,
        surface_instances: handles.instances,
        surface_indices: handles.indices,
        surface_positions: handles.positions,
        surface_normals: handles.normals,
        surface_tangents: handles.tangents,
        surface_uvs: handles.uvs,
        surface_colors: handles.colors,
        samples: graph.buffer_from("prt.samples", samples),
        albedos,
        push: albedo::Push { count },
        spec: albedo::Spec { gloss: gloss.into() },
    };
    graph.compute(args, count);
    let read = graph.read_buffer(albedos);
    Ok(Runner::new(gpu).run(&graph)?.buffer(read))
}
