//! Instant global illumination.

use lucerna::{
    Result,
    graph::Runner,
    scene::resident::Resident,
    techniques::igi::{Igi, PictureSettings, Visibility},
};
use serde_json::Value;

use super::{GATHERED, Job, Rendered, Warm, on_device, read};
use crate::{config, experiment::file::Changes, frame_output::FrameOutput, gbuffer_layers};

pub(super) fn settings(paper: bool, changes: &Changes) -> Result<Value> {
    let base = if paper { PictureSettings::paper() } else { PictureSettings::default() };
    let settings: PictureSettings = config::with(&base, changes)?;
    settings.validate()?;
    config::to_value(&settings)
}

/// The technique's data for a scene, for one choice of ray tracing.
struct Kept {
    resident: Resident,
    igi: Igi,
    runner: Runner,
}

pub(super) fn picture(warm: &mut Warm<'_>, job: &Job<'_>) -> Result<Option<Rendered>> {
    let settings: PictureSettings = read(job.settings)?;
    let (scene, pose) = (warm.scene, warm.pose);
    // Imperfect visibility and other choices of ray tracing need other acceleration structures.
    let name = if settings.igi.imperfect { "igi, imperfect" } else { "igi" };
    let name = match settings.igi.visibility {
        Visibility::Auto => name,
        _ => "igi, chosen rays",
    };
    if name == "igi, chosen rays" {
        // The data is not kept, because the next variant may choose another kind of ray tracing.
        warm.forget(name);
    }
    let Kept { resident, igi, runner } = warm.keep(name, |gpu, scene, _| {
        let resident = Resident::new(gpu, scene)?;
        let igi = Igi::new(gpu, scene, &resident, &settings.igi)?;
        Ok(Kept { resident, igi, runner: Runner::new(gpu) })
    })?;
    on_device(runner, job, "igi", |graph| {
        let handles = resident.frame_in(graph, scene, pose);
        let view = job.view.fit_far(&handles.bounds());
        let picture = igi.picture(graph, scene, pose, &handles, &view, &settings)?;
        let out = picture.outputs;
        let mut output = FrameOutput::new(out.total).color("direct", out.direct).color("indirect", out.indirect);
        if let Some(sharp) = out.sharp {
            output = output.color("specular", sharp);
        }
        if settings.igi.indirect && settings.igi.visibility != Visibility::Raster {
            output = output.sum(GATHERED, out.gathered, |pixel| pixel[3]);
        }
        Ok(gbuffer_layers::add(output, &picture.gbuffer, &view))
    })
}
