//! Precomputed transfer behind the interface of all techniques.

use super::{
    Baked, Direct, PictureSettings, Settings, Stored, eyes,
    left_out::{idle_maps, left_out},
    on_device::OnDevice,
    pixels::{Drawing, Shown},
    spread::Spreader,
};
use crate::{
    Error, Result,
    graph::Graph,
    passes::shadow,
    settings::{Described, Description, idle_notes},
    shaders::{consts, types},
    technique::{self, Making, Moment, Picture, Technique},
};

/// The light, or the part of the bake, that the picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    #[default]
    Total,
    Direct,
    Indirect,
    Irradiance,
    Shadow,
    Samples,
    Clusters,
    Transfer,
}

impl technique::Mode for Mode {
    const ALL: &'static [Self] = &[
        Self::Total,
        Self::Direct,
        Self::Indirect,
        Self::Irradiance,
        Self::Shadow,
        Self::Samples,
        Self::Clusters,
        Self::Transfer,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Total => "total",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Irradiance => "irradiance",
            Self::Shadow => "shadow",
            Self::Samples => "samples",
            Self::Clusters => "clusters",
            Self::Transfer => "transfer",
        }
    }

    fn doc(self) -> &'static str {
        match self {
            Self::Total => "All light",
            Self::Direct => "Direct light only",
            Self::Indirect => "Transferred light only: all light after at least one scattering",
            Self::Irradiance => "Irradiance of the transferred light, without the surfaces' colours",
            Self::Shadow => "Share of the first light that the samples see",
            Self::Samples => "The nearest sample of each point in a colour of its own, samples as black dots",
            Self::Clusters => "Clusters in colours of their own (figure 1), samples as darker dots",
            Self::Transfer => "Light that the vector prt.vector sends: red above 0, blue below (figure 3)",
        }
    }

    fn is_radiance(self) -> bool {
        !matches!(self, Self::Shadow | Self::Samples | Self::Clusters)
    }
}

/// Precomputed transfer, prepared for a scene.
#[derive(Debug)]
pub struct Prt {
    baked: Baked,
    light: OnDevice,
    spreader: Spreader,
    /// The device can draw several views in one pass.
    multiview: bool,
}

impl Prt {
    /// The bake.
    pub fn stored(&self) -> &Stored {
        &self.baked.stored
    }
}

impl Technique for Prt {
    const NAME: &'static str = "prt";
    const ABOUT: &'static str = "indirect light of lights that move, from a bake of the room; layers direct, indirect, irradiance, shadow, albedo, normal, depth";
    const UNITS: &'static str = "clusters";

    type Settings = PictureSettings;
    type Mode = Mode;
    type Baked = Baked;

    fn description() -> &'static Description {
        Settings::description()
    }

    fn prepared_by(settings: &PictureSettings) -> PictureSettings {
        let Settings { gloss, bounces, mean, linked, spread, .. } = settings.prt;
        let prt = Settings { gloss, bounces, mean, linked, spread, ..Settings::default() };
        PictureSettings { prt, ..PictureSettings::default() }
    }

    fn ready(making: Making<'_, Baked>, settings: &PictureSettings) -> Result<Self> {
        let Making { gpu, scene, baked, .. } = making;
        let Some(baked) = baked else {
            let error = Error::usage("there is no baked room").at("prt");
            return Err(error.help("Bake it with `prt bake SCENE -o FILE.prt`, and name the file with --bake"));
        };
        baked.expect_scene(scene)?;
        let light = OnDevice::new(gpu, scene, &baked.stored, &settings.prt).map_err(|error| baked.blamed(error))?;
        let spreader = Spreader::new(gpu, scene, &baked.stored, settings.prt.spread)?;
        Ok(Self { baked: baked.clone(), light, spreader, multiview: gpu.caps().multiview })
    }

    fn frame(&mut self, graph: &mut Graph, moment: &Moment<'_, Mode>, settings: &PictureSettings) -> Result<Picture> {
        technique::Settings::validate(settings)?;
        let of_prt = &settings.prt;
        let (handles, view) = (moment.handles, &moment.view);
        let mode = moment.shot.mode;
        let lights = &handles.moment.lights;
        let count = lights.len() as u32;
        // Pictures of single samples have no light.
        let of_light = !matches!(mode, Mode::Samples | Mode::Clusters | Mode::Transfer);
        let local = |light: &types::Light| light.kind != consts::LIGHT_DIRECTIONAL;
        let needed = lights.iter().filter(|light| local(light)).map(shadow::local_maps).sum();
        let of_prt = &of_prt.decided((settings.shadow.kind != shadow::Kind::Off).then_some(needed));
        let by_maps = of_light && of_prt.direct == Direct::Maps;
        let maps = by_maps.then(|| shadow::draw_of(graph, handles, view, &settings.shadow, local));
        let plan = &self.baked.stored.plan;
        let mut lit = self.light.light(graph, plan, (handles.lights, count), maps.as_ref(), of_prt);
        if mode == Mode::Transfer {
            let all = self.light.vectors();
            if of_prt.vector >= all {
                let what = format!("{}, the bake has the vectors 0 to {}", of_prt.vector, all - 1);
                return Err(Error::usage(what).at("prt.vector"));
            }
            let mut one = vec![[0.0f32; 3]; all as usize];
            one[of_prt.vector as usize] = [of_prt.strength; 3];
            let one = graph.buffer_from("prt.vector", &one);
            lit.irradiances = self.light.sent(graph, one);
        }
        let of_maps = maps.as_ref().map_or(&[][..], |maps| &maps.notes);
        let idle = if by_maps { idle_notes("shadow", &settings.shadow) } else { idle_maps(&settings.shadow) };
        let notes = [moment.notes, of_maps, &left_out(moment.scene), &idle_notes("prt", of_prt), &idle].concat();
        // Where shadow maps take the place of the visibility, and where there is no light, the first lights are enough for the layer.
        let visible = if of_light && !by_maps { count } else { count.min(consts::PRT_SPREAD_LIGHTS) };
        let spread = self.spreader.light(graph, handles, (&self.light, &lit), visible, of_prt);
        // The indirect light is a layer of all pictures of light.
        let directed = of_light && of_prt.gloss && of_prt.directional;
        let directions = if directed { self.light.directions(graph, &lit, of_prt) } else { None };
        let maps = maps.as_ref();
        let drawing = Drawing { light: &self.light, lit: &lit, directions, spread, handles, settings, mode, maps };
        let shown = if of_prt.eyes > 0.0 {
            let [left, right] = [-0.5, 0.5].map(|side| view.beside(side * of_prt.eyes));
            let eyes = drawing.draw_eyes(graph, [&left, &right], self.multiview && of_prt.multiview);
            eyes::side_by_side(graph, eyes, mode, moment.shot.layers)
        } else {
            drawing.draw(graph, view)
        };
        let points = if of_prt.radius > 0.0 { of_prt.points } else { 1 };
        let [of_points, of_samples, of_bases] = self.light.products;
        let Shown { gbuffer, images, counted } = shown;
        let mut picture = Picture::new(images.of(mode))
            .color("direct", images.direct)
            .color("indirect", images.indirect)
            .color("irradiance", images.irradiance)
            .color("shadow", images.shadow)
            .number(
                "visibility_products",
                if maps.is_none() { (of_points * u64::from(points * count)) as f64 } else { 0.0 },
            )
            .number("transfer_products", of_samples as f64)
            .number("basis_products", of_bases as f64)
            .number("directions", if directions.is_some() { self.light.directions as f64 } else { 0.0 });
        if let Some((name, number)) = counted {
            picture = picture.number(name, f64::from(number));
        }
        Ok(picture.showing(gbuffer).noting(notes))
    }
}
