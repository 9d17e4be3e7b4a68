//! A picture that would be black gets a light and is made again, and the user is told.
//!
//! The first frame of a run decides. Lights are added in the same way as by options of the command line, so that the record of the picture names them and
//! `lucerna rerun` makes the same picture.

use lucerna::{
    image::Layers,
    scene::{Note, NoteKind, Pose, View, bvh::Bvh},
};

use crate::{
    args::RenderArgs,
    default_light::{DefaultLight, SUN},
    exposure,
    lights::Point,
    sight::Sight,
    stage::Stage,
};

/// Brightness from which a pixel can be told from black on a screen, linear.
const VISIBLE: f32 = 0.02;
/// Highest exposure at which a picture is judged, EV. At higher ones light that leaks through shadow maps would count.
const MOST_EV: f32 = 10.0;
/// The same for pictures under the sun that the program adds, whose strength is known.
const MOST_EV_OF_SUN: f32 = 5.0;
/// A picture is black if it shows less than this share of its surfaces.
const SHOWN: f32 = 0.1;
/// A picture with this share of visible pixels is not black, however much of it shows surfaces.
const PLENTY: f32 = 0.25;

/// A picture that would be black.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dark {
    /// A lamp beside the camera, which lights what the picture shows.
    lamp: Option<Point>,
    /// A sun and a sky, or a lamp in the room, are there already.
    default_light: bool,
}

/// Whether a picture would be black: hardly any of the surfaces that it shows can be told from black. Pictures without surfaces are not, because no light
/// changes them.
pub fn dark(picture: &Layers, stage: &Stage, pose: &Pose, view: &View) -> Option<Dark> {
    let shown = shown(picture, if stage.default_light { MOST_EV_OF_SUN } else { MOST_EV });
    if shown >= PLENTY {
        return None;
    }
    let bvh = Bvh::build(&stage.scene, pose);
    let sight = Sight::of(&stage.scene, &bvh, view);
    let is_dark = sight.coverage() > 0.0 && shown < SHOWN * sight.coverage();
    is_dark.then(|| Dark { lamp: sight.lamp(SUN), default_light: stage.default_light })
}

/// Share of the pixels that can be told from black, with the exposure that suits the picture, but at most `most` EV.
fn shown(picture: &Layers, most: f32) -> f32 {
    let Some(pixels) = picture.main().and_then(|layer| layer.rgb_pixels()) else { return 1.0 };
    let least = VISIBLE / (exposure::fitting(picture) as f32).min(most).exp2();
    let visible = pixels.iter().filter(|[r, g, b]| r.max(*g).max(*b) >= least).count();
    visible as f32 / pixels.len().max(1) as f32
}

/// A light that is added to a picture that would be black.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Added {
    /// As [`DefaultLight::Always`].
    Default,
    Lamp(Point),
    /// None: no light makes the picture brighter.
    None,
}

/// The tries of a run to make a picture that is not black.
#[derive(Debug)]
pub struct Tries {
    args: RenderArgs,
    /// A black picture is made again.
    watched: bool,
    /// Lamps light the pictures of the technique.
    lamps: bool,
    /// The light of the present try.
    added: Option<Added>,
}

impl Tries {
    /// `all_light`: the picture shows all light. Pictures of a part of the light may be black.
    pub fn new(args: &RenderArgs, all_light: bool, lamps: bool) -> Self {
        let light = args.stage.default_light == DefaultLight::Auto;
        let plain = args.view.is_none() && args.dump.is_none() && !args.list_passes;
        Self { args: args.clone(), watched: all_light && light && plain, lamps, added: None }
    }

    /// The options of the present try.
    pub fn args(&self) -> RenderArgs {
        let mut args = self.args.clone();
        match self.added {
            Some(Added::Default) => args.stage.default_light = DefaultLight::Always,
            Some(Added::Lamp(lamp)) => args.stage.light.push(lamp),
            Some(Added::None) | None => {}
        }
        args
    }

    /// Whether a black picture of the present try is made again.
    pub fn watched(&self) -> bool {
        self.watched && self.added != Some(Added::None)
    }

    /// What the user is told about the light of the present try.
    pub fn note(&self) -> Option<Note> {
        let text = match self.added? {
            Added::Default => {
                "the picture would be black and was made again with default lights (--default-light always; never leaves it black)".into()
            }
            Added::Lamp(lamp) => format!(
                "the picture would be black and was made again with a lamp beside the camera (--light {lamp}; --default-light never leaves it black)"
            ),
            Added::None => "the picture is black with a sun, a sky and a lamp beside the camera, too: none was added".into(),
        };
        Some(Note { kind: NoteKind::Approximated, place: "lights".into(), text })
    }

    /// Goes on to the next light after a black picture.
    pub fn next(&mut self, dark: Dark) {
        let lamp = dark.lamp.filter(|_| self.lamps).map_or(Added::None, Added::Lamp);
        self.added = Some(match self.added {
            None if !dark.default_light => Added::Default,
            None | Some(Added::Default) => lamp,
            Some(Added::Lamp(_) | Added::None) => Added::None,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_bright_pixels_are_no_picture() {
        let of = |lit: usize, value: f32| {
            let mut data = vec![0.0; 300];
            data[..3 * lit].fill(value);
            shown(&Layers::rgb(100, 1, data), MOST_EV)
        };
        assert_eq!((of(0, 1.0), of(3, 1.0), of(100, 0.5)), (0.0, 0.03, 1.0));
        // The exposure is chosen by what is lit, however weak it is.
        assert_eq!((of(40, 1e-4), of(40, 1e6), of(100, 1e-6)), (0.4, 0.4, 0.0));
        assert_eq!(shown(&Layers::new(1, 1), MOST_EV), 1.0);
    }
}
