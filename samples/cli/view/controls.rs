//! The panel beside the picture: exposure, camera, lamps, and the settings of both sides.

use std::time::Instant;

use egui::{Context, RichText, Ui};
use glam::{Mat4, Vec3};
use lucerna::{
    scene::Pose,
    techniques::{self, tonemap::Operator},
};

use super::{
    app::Viewer,
    bars, cameras, painted, panel,
    side::Side,
    wanted::{Shows, TRUTH},
};
use crate::{
    lamps::{self, Put},
    placed, scene_bounds, screen,
    stage::{Stage, StageArgs},
};
/// The middle of a scene's surfaces, metres; the origin without surfaces.
pub fn middle(stage: &Stage) -> Vec3 {
    let around = scene_bounds::in_pose(&stage.scene, &Pose::playing(&stage.scene, 0.0));
    around.map_or(Vec3::ZERO, |around| 0.5 * (around.min + around.max))
}

/// Length of the longest animation, seconds.
pub fn duration(stage: &Stage) -> f64 {
    stage.scene.animations.iter().map(|animation| f64::from(animation.duration())).fold(0.0, f64::max)
}

/// The panel on the right.
pub fn panel(viewer: &mut Viewer, context: &Context) {
    egui::SidePanel::right("settings").default_width(310.0).width_range(240.0..=560.0).show(context, |ui| {
        egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            picture(viewer, ui);
            camera(viewer, ui);
            lamps(viewer, ui);
            let both = viewer.shows_both();
            for number in 0..=usize::from(both) {
                ui.separator();
                side(viewer, number, ui);
            }
            bars::passes(viewer, ui);
            notes(viewer, ui);
        });
    });
}

fn picture(viewer: &mut Viewer, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.label("Exposure");
        let mut ev = viewer.ev();
        if ui.add(egui::DragValue::new(&mut ev).speed(0.05).range(-64.0..=64.0).suffix(" EV")).changed() {
            viewer.exposure = Some(ev);
        }
        let auto = ui.add_enabled(viewer.exposure.is_some(), egui::Button::new("auto"));
        if auto.on_hover_text("The exposure that suits the picture").clicked() {
            viewer.exposure = None;
        }
        ui.checkbox(&mut viewer.false_colour, "false colour").on_hover_text({
            let [low, high] = painted::false_colour_range();
            format!("Luminance with the exposure from {low:.0e} (dark) to {high} (bright), by its logarithm (X)")
        });
    });
    ui.horizontal(|ui| {
        ui.label("Curve");
        let now = viewer.curve.unwrap_or(Operator::Linear);
        egui::ComboBox::from_id_salt("curve").selected_text(now.name()).show_ui(ui, |ui| {
            for curve in screen::CURVES {
                if ui.selectable_label(curve == now, curve.name()).clicked() {
                    viewer.curve = Some(curve).filter(|curve| *curve != Operator::Linear);
                }
            }
        });
    });
}

fn camera(viewer: &mut Viewer, ui: &mut Ui) {
    let Some(stage) = viewer.stage.clone() else { return };
    egui::CollapsingHeader::new("Camera and time").default_open(true).show(ui, |ui| {
        let names: Vec<String> =
            stage.scene.cameras.iter().enumerate().map(|(i, camera)| placed::name_of(camera, i)).collect();
        let now = match (&viewer.fly, &viewer.named_camera) {
            (Some(_), _) => "free".to_owned(),
            (None, Some((placed, _))) => placed.name.clone(),
            (None, None) => names.get(viewer.camera).cloned().unwrap_or_default(),
        };
        ui.horizontal(|ui| {
            egui::ComboBox::from_id_salt("camera").selected_text(now).show_ui(ui, |ui| {
                for (index, name) in names.iter().enumerate() {
                    let chosen = viewer.fly.is_none() && viewer.named_camera.is_none() && viewer.camera == index;
                    if ui.selectable_label(chosen, name).clicked() {
                        viewer.cameras.land();
                        (viewer.camera, viewer.fly, viewer.named_camera) = (index, None, None);
                    }
                }
            });
            if ui.button("Keep").on_hover_text("Keep this camera in the list below (K)").clicked() {
                cameras::keep(viewer);
            }
            if ui.button("Copy").on_hover_text("The camera as --camera has it").clicked()
                && let Some(fly) = viewer.as_flying()
            {
                ui.ctx().copy_text(fly.numbers());
            }
            if let Some(fly) = &mut viewer.fly {
                ui.add(egui::DragValue::new(&mut fly.speed).speed(0.02).range(0.01..=1000.0).suffix(" m/s"))
                    .on_hover_text("Speed of flying (Ctrl wheel)");
            }
        });
        cameras::rows(viewer, ui);
        environment(viewer, &stage, ui);
        let end = duration(&stage);
        if end > 0.0 {
            ui.horizontal(|ui| {
                if ui
                    .button(if viewer.playing { "⏸" } else { "▶" })
                    .on_hover_text("Play the animation (Enter)")
                    .clicked()
                {
                    viewer.playing = !viewer.playing;
                }
                if ui
                    .add(
                        egui::Slider::new(&mut viewer.seconds, 0.0..=end)
                            .clamping(egui::SliderClamping::Edits)
                            .suffix(" s"),
                    )
                    .changed()
                {
                    viewer.moves();
                }
            });
        }
    });
}

/// Turns the environment. The scene is read again when the mouse lets go, because techniques prepare for an environment.
fn environment(viewer: &mut Viewer, stage: &Stage, ui: &mut Ui) {
    if !stage.turns {
        return;
    }
    ui.horizontal(|ui| {
        ui.label("Environment");
        let mut turn = viewer.turn.unwrap_or_else(|| viewer.args.turn.unwrap_or(0.0));
        let slider =
            ui.add(egui::Slider::new(&mut turn, -180.0..=180.0).suffix("°").clamping(egui::SliderClamping::Edits));
        let slider = slider.on_hover_text("Turn the environment (--turn)");
        if slider.changed() {
            viewer.turn = Some(turn);
        }
        if !slider.dragged()
            && let Some(turn) = viewer.turn.take()
        {
            let args = StageArgs { turn: Some(turn), ..viewer.newest_args() };
            viewer.read(args);
        }
    });
}

/// The lamps of the scene: places and directions.
fn lamps(viewer: &mut Viewer, ui: &mut Ui) {
    let Some(stage) = viewer.stage.clone() else { return };
    // No option moves a lamp that an animation moves.
    let mut nodes = lamps::nodes(&stage.scene);
    nodes.retain(|node| !lamps::is_animated(&stage.scene, *node));
    if nodes.is_empty() {
        return;
    }
    let title = format!("Lamps ({})", nodes.len());
    egui::CollapsingHeader::new(title).id_salt("lamps").default_open(nodes.len() < 4).show(ui, |ui| {
        let Some(pose) = viewer.pose.clone() else { return };
        for node in nodes {
            let world = pose.world[node];
            let row = ui.horizontal(|ui| {
                ui.add(egui::Label::new(lamps::name(&stage.scene, node)).truncate());
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    let back = egui::Button::new("⟲").small().frame(false);
                    let back = ui.add_visible(viewer.moved.contains_key(&node), back);
                    if back.on_hover_text("Reset the position").clicked() {
                        viewer.moved.remove(&node);
                        viewer.moves();
                        return;
                    }
                    let moved = if lamps::is_sun(&stage.scene, node) {
                        sun(ui, viewer.moved.get(&node).copied(), world)
                    } else {
                        place(ui, world)
                    };
                    if let Some(moved) = moved {
                        viewer.moved.insert(node, moved);
                        viewer.moves();
                    }
                });
            });
            if row.response.contains_pointer() {
                viewer.pointed_lamp = Some(node);
            }
        }
    });
}

/// The place of a lamp. The new one, if it was changed.
fn place(ui: &mut Ui, world: Mat4) -> Option<Put> {
    let mut place = world.w_axis.truncate();
    let mut changed = false;
    for axis in (0..3).rev() {
        let field = ui.add(egui::DragValue::new(&mut place[axis]).speed(0.01).max_decimals(2));
        changed |= field.on_hover_text("Metres; the lamp can also be dragged in the picture").changed();
    }
    changed.then_some(Put::At(place))
}

/// The direction of a sun. The new one, if it was changed.
fn sun(ui: &mut Ui, put: Option<Put>, world: Mat4) -> Option<Put> {
    let [mut azimuth, mut elevation] = match put {
        Some(Put::Towards(angles)) => angles,
        _ => lamps::angles(world),
    };
    let field = egui::DragValue::new(&mut elevation).speed(0.3).max_decimals(1).range(-90.0..=90.0).suffix("° up");
    let mut changed = ui.add(field).changed();
    let field = ui.add(egui::DragValue::new(&mut azimuth).speed(0.5).max_decimals(1).suffix("°"));
    changed |= field.on_hover_text("Azimuth: 0 over +Z, 90 over +X").changed();
    changed.then_some(Put::Towards([azimuth, elevation]))
}

/// Technique and settings of a side.
fn side(viewer: &mut Viewer, number: usize, ui: &mut Ui) {
    let title = ["A", "B"][number];
    ui.push_id(title, |ui| {
        if let Some(file) = &viewer.sides[number].file {
            let path = file.path.display().to_string();
            ui.horizontal(|ui| {
                ui.strong(title);
                ui.label(path);
                if ui.button("Close").clicked() {
                    viewer.sides[number].file = None;
                }
            });
            return;
        }
        technique(viewer, number, ui);
        let Viewer { sides, descriptions, .. } = viewer;
        let side = &mut sides[number];
        let mut tree = (*side.settings).clone();
        if panel::show(ui, descriptions, &mut tree, &side.defaults) {
            side.settings = std::sync::Arc::new(tree);
            if ui.input(|input| input.pointer.any_down()) {
                side.last_change = Some(Instant::now());
            }
        }
    });
}

fn technique(viewer: &mut Viewer, number: usize, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.strong(["A", "B"][number]);
        let now = viewer.sides[number].technique;
        egui::ComboBox::from_id_salt("technique").selected_text(label(now)).show_ui(ui, |ui| {
            for &name in techniques::NAMES {
                let about = super::live::about(name).map(|about| about.about).unwrap_or_default();
                if ui.selectable_label(now == name, label(name)).on_hover_text(about).clicked() && now != name {
                    viewer.sides[number].start_with(name);
                    viewer.named = true;
                }
            }
        });
        let side = &mut viewer.sides[number];
        if side.about.modes.len() > 1 {
            egui::ComboBox::from_id_salt("mode").selected_text(&side.mode).show_ui(ui, |ui| {
                for mode in side.about.modes.clone() {
                    if ui.selectable_label(side.mode == mode.name, mode.name).on_hover_text(mode.doc).clicked() {
                        side.mode = mode.name.to_owned();
                    }
                }
            });
        }
    });
    let side = &mut viewer.sides[number];
    if side.about.baked {
        let text = side.bake.as_ref().map_or_else(
            || format!("Drop the file of `lucerna bake {}` here", side.technique),
            |file| file.display().to_string(),
        );
        ui.weak(text);
    }
    ui.horizontal(|ui| {
        if side.technique == TRUTH {
            ui.label("Paths per pixel");
            ui.add(egui::DragValue::new(&mut side.samples).speed(8.0).range(1..=1_048_576));
        } else {
            ui.label("Samples per pixel");
            ui.add(egui::DragValue::new(&mut side.pictures).speed(0.1).range(1..=1024))
                .on_hover_text("Anti-aliasing at rest: --aa");
            ui.add_enabled(side.pictures == 1, egui::Checkbox::new(&mut side.edges, "Edges"))
                .on_hover_text("Smooth edges of a single picture: --aa edges")
                .on_disabled_hover_text("The mean of several pictures has smooth edges");
        }
        if side.about.paper.is_some()
            && ui.button("Paper").on_hover_text("The settings of the paper (--paper)").clicked()
        {
            side.set_paper(true);
        }
        if ui.button("Defaults").clicked() {
            side.set_paper(false);
        }
    });
    shows(side, ui);
}

fn label(name: &str) -> &str {
    if name == TRUTH { "path tracer" } else { name }
}

/// What of the frame is shown: light, a layer, an image of the graph.
fn shows(side: &mut Side, ui: &mut Ui) {
    let Some(shown) = side.shown() else { return };
    let now = match &side.shows {
        Shows::Picture => "light".to_owned(),
        Shows::Layer(name) => format!("layer {name}"),
        Shows::Image(name) => format!("image {name}"),
    };
    ui.horizontal(|ui| {
        ui.label("Shows");
        egui::ComboBox::from_id_salt("shows").selected_text(now).width(180.0).height(420.0).show_ui(ui, |ui| {
            ui.selectable_value(&mut side.shows, Shows::Picture, "light");
            for layer in shown.layers.layers.iter().filter(|layer| !layer.name.is_empty()) {
                ui.selectable_value(&mut side.shows, Shows::Layer(layer.name.clone()), format!("layer {}", layer.name));
            }
            for image in shown.images.iter() {
                ui.selectable_value(&mut side.shows, Shows::Image(image.clone()), format!("image {image}"));
            }
        });
    });
}

/// What the user must know of the scene and of the picture.
fn notes(viewer: &Viewer, ui: &mut Ui) {
    let Some(stage) = &viewer.stage else { return };
    let of_scene = stage.notes().iter().map(ToString::to_string);
    let of_picture = viewer.sides[0].shown().map(|shown| shown.notes.clone()).unwrap_or_default();
    let all: Vec<String> = of_scene.chain(of_picture).collect();
    if all.is_empty() {
        return;
    }
    egui::CollapsingHeader::new(format!("Notes ({})", all.len())).id_salt("notes").default_open(false).show(ui, |ui| {
        for note in all {
            ui.label(RichText::new(note).small());
        }
    });
}
