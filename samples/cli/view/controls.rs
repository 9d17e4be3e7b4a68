//! The bars and the panel beside the picture.

use std::collections::VecDeque;

use egui::{Context, RichText, Ui};
use glam::{Mat4, Vec3};
use lucerna::{
    scene::Pose,
    techniques::{self, tonemap::Operator},
};

use super::{
    app::{Compare, Viewer},
    cameras, keys, painted, panel,
    session::Doing,
    side::Side,
    wanted::{Shown, Shows, TRUTH},
};
use crate::{
    lamps::{self, Put},
    screen,
    stage::Stage,
};

/// Pictures whose times are kept.
const KEPT: usize = 64;

/// Times of the last pictures of side A.
#[derive(Debug, Default)]
pub struct Times {
    last: u64,
    at: VecDeque<std::time::Instant>,
    pub milliseconds: VecDeque<f64>,
}

impl Times {
    /// Notes a picture, if it is a new one.
    pub fn pictures(&mut self, shown: Option<&Shown>) {
        let Some(shown) = shown.filter(|shown| shown.number != self.last) else { return };
        self.last = shown.number;
        self.at.push_back(shown.at);
        self.milliseconds.push_back(shown.milliseconds);
        while self.at.len() > KEPT {
            self.at.pop_front();
            self.milliseconds.pop_front();
        }
    }

    /// Pictures a second in the last second; 0 if there were fewer than two.
    pub fn rate(&self) -> f64 {
        let recent: Vec<_> = self.at.iter().filter(|at| at.elapsed().as_secs_f64() < 1.0).collect();
        match (recent.first(), recent.last()) {
            (Some(first), Some(last)) if recent.len() > 1 => {
                (recent.len() - 1) as f64 / last.duration_since(**first).as_secs_f64().max(1e-3)
            }
            _ => 0.0,
        }
    }
}

/// The middle of a scene's objects, metres.
pub fn middle(stage: &Stage) -> Vec3 {
    let pose = Pose::playing(&stage.scene, 0.0);
    let places = stage.scene.nodes.iter().zip(&pose.world).filter(|(node, _)| node.mesh.is_some());
    let (sum, count) =
        places.fold((Vec3::ZERO, 0.0), |(sum, count), (_, world)| (sum + world.w_axis.truncate(), count + 1.0));
    if count > 0.0 { sum / count } else { Vec3::ZERO }
}

/// Length of the longest animation, seconds.
pub fn duration(stage: &Stage) -> f64 {
    stage.scene.animations.iter().map(|animation| f64::from(animation.duration())).fold(0.0, f64::max)
}

/// The bars above and below the picture.
pub fn bars(viewer: &mut Viewer, context: &Context) {
    egui::TopBottomPanel::top("top").show(context, |ui| {
        ui.horizontal(|ui| {
            ui.strong("lucerna");
            let name = viewer.stage.as_ref().map_or("no scene", |stage| stage.scene.name.as_str());
            ui.label(name);
            ui.separator();
            egui::ComboBox::from_id_salt("compare")
                .selected_text(name_of(viewer.compare))
                .width(130.0)
                .show_ui(ui, |ui| {
                    for (compare, name) in Compare::ALL {
                        ui.selectable_value(&mut viewer.compare, compare, name);
                    }
                })
                .response
                .on_hover_text("How A and B are shown (C)");
            if viewer.shows_both() {
                numbers(viewer, ui);
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui.button("?").on_hover_text("Keys and mouse (F1)").clicked() {
                    viewer.help = !viewer.help;
                }
                if ui
                    .button("PNG")
                    .on_hover_text(
                        "Write the picture of A as a .png file, by the command that `Copy as command` gives (P)",
                    )
                    .clicked()
                {
                    keys::screenshot(viewer, "png");
                }
                if ui
                    .button("EXR")
                    .on_hover_text("Write the light and all layers of A as an .exr file (Shift P)")
                    .clicked()
                {
                    keys::screenshot(viewer, "exr");
                }
                if ui
                    .button("Copy as command")
                    .on_hover_text("The command line that makes the picture of A (Ctrl C)")
                    .clicked()
                {
                    keys::copy(viewer, ui.ctx());
                }
            });
        });
    });
    egui::TopBottomPanel::bottom("bottom").show(context, |ui| status(viewer, ui));
}

fn name_of(compare: Compare) -> &'static str {
    Compare::ALL.iter().find(|(one, _)| *one == compare).map_or("", |(_, name)| name)
}

/// How far A is from B.
fn numbers(viewer: &Viewer, ui: &mut Ui) {
    let (answer, failed) = viewer.answer();
    if let Some(failed) = failed {
        ui.colored_label(ui.visuals().warn_fg_color, failed);
        return;
    }
    let Some(answer) = answer else { return };
    let now = [0, 1].map(|side: usize| viewer.sides[side].light().map_or(0, |(_, number, _)| number));
    let text = format!("relMSE {:.2e}  FLIP {:.4}  energy {:.3}", answer.rel_mse, answer.flip, answer.energy);
    let text = RichText::new(text).monospace();
    // Numbers of pictures that are no longer shown are grey.
    ui.label(if answer.of == now { text } else { text.weak() }).on_hover_text(
        "A beside B, the reference: relative mean squared error, FLIP of what the screen shows, sum of the light",
    );
    if let Some(noise) = viewer.sides[1].shown().and_then(|shown| shown.noise) {
        ui.monospace(format!("noise of B {noise:.1e}"))
            .on_hover_text("Estimated relative mean squared error of B alone: a relMSE near it says nothing about A");
    }
}

fn status(viewer: &mut Viewer, ui: &mut Ui) {
    ui.horizontal(|ui| {
        if let Some(trouble) = viewer.trouble.clone() {
            ui.colored_label(ui.visuals().error_fg_color, trouble.replace('\n', " "));
            if ui.small_button("✖").clicked() {
                viewer.trouble = None;
            }
            return;
        }
        for (number, side) in viewer.sides.iter().enumerate() {
            if number == 1 && !viewer.shows_both() {
                continue;
            }
            state(side, ["A", "B"][number], ui);
            ui.separator();
        }
        let rate = viewer.times().rate();
        if rate > 0.0 {
            ui.label(format!("{rate:.0} pictures/s"));
        }
        if viewer.is_reading() {
            ui.spinner();
            ui.label("reading the scene");
        } else if let Some((message, _)) = &viewer.message {
            ui.label(message);
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| inspector(viewer, ui));
    });
}

/// What a side does.
fn state(side: &Side, name: &str, ui: &mut Ui) {
    if let Some(file) = &side.file {
        ui.label(format!("{name}: {}", file.path.display()));
        return;
    }
    let Some(session) = side.session() else {
        ui.weak(format!("{name}: no picture yet"));
        return;
    };
    let (doing, failed) = session.status();
    if let Some(failed) = failed {
        ui.colored_label(ui.visuals().error_fg_color, format!("{name}: {failed}").replace('\n', " "));
        return;
    }
    let shown = side.shown();
    let size = shown.as_ref().map(|shown| format!("{} × {}", shown.size.width, shown.size.height)).unwrap_or_default();
    let text = match (&doing, shown.as_deref()) {
        (Doing::Preparing(what, None), _) => format!("{name}: preparing {what}"),
        (Doing::Preparing(what, Some((done, all))), _) => format!("{name}: preparing {what}, {done} of {all}"),
        (_, Some(shown)) if shown.samples > 0.0 => {
            format!("{name}: {size}, {:.0} of {} paths a pixel", shown.samples, side.samples)
        }
        (_, Some(shown)) => format!("{name}: {size}, {:.0} ms", shown.milliseconds),
        (_, None) => format!("{name}: the first picture"),
    };
    ui.label(text).on_hover_text(session.device());
    match doing {
        Doing::Rendering(share) if share > 0.0 => {
            ui.add(egui::ProgressBar::new(share as f32).desired_width(60.0));
        }
        Doing::Nothing => (),
        _ => {
            ui.spinner();
        }
    }
}

/// The values of the pixel under the mouse.
fn inspector(viewer: &Viewer, ui: &mut Ui) {
    let (Some([x, y]), Some(shown)) = (viewer.pixel, viewer.sides[0].shown()) else { return };
    if !shown.whole || x >= shown.size.width || y >= shown.size.height {
        return;
    }
    let at = (y * shown.size.width + x) as usize;
    let mut text = format!("{x}, {y}");
    for layer in &shown.layers.layers {
        let channels = layer.channels.len();
        let Some(values) = layer.data.get(at * channels..(at + 1) * channels) else { continue };
        let name = if layer.name.is_empty() { "light" } else { &layer.name };
        if !["", "albedo", "normal", "depth"].contains(&layer.name.as_str()) {
            continue;
        }
        let numbers: Vec<String> = values.iter().map(|value| format!("{value:.3}")).collect();
        text += &format!("   {name} {}", numbers.join(" "));
    }
    ui.monospace(text);
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
            passes(viewer, ui);
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
            stage.scene.cameras.iter().enumerate().map(|(i, camera)| super::fly::name_of(camera, i)).collect();
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

/// The lamps of the scene: places and directions.
fn lamps(viewer: &mut Viewer, ui: &mut Ui) {
    let Some(stage) = viewer.stage.clone() else { return };
    let nodes = lamps::nodes(&stage.scene);
    if nodes.is_empty() {
        return;
    }
    let title = format!("Lamps ({})", nodes.len());
    egui::CollapsingHeader::new(title).id_salt("lamps").default_open(nodes.len() < 4).show(ui, |ui| {
        let Ok((pose, _)) = stage.at(viewer.seconds, viewer.size_of_side()) else { return };
        for node in nodes {
            let world = viewer.moved.get(&node).map_or(pose.world[node], |put| put.world(pose.world[node]));
            ui.horizontal(|ui| {
                ui.add(egui::Label::new(lamps::name(&stage.scene, node)).truncate());
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    let back = egui::Button::new("⟲").small().frame(false);
                    let back = ui.add_visible(viewer.moved.contains_key(&node), back);
                    if back.on_hover_text("Back to its place").clicked() {
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
        let defaults = side.defaults();
        let mut tree = (*side.settings).clone();
        if panel::show(ui, descriptions, &mut tree, &defaults) {
            side.settings = std::sync::Arc::new(tree);
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
            ui.label("Paths a pixel");
            ui.add(egui::DragValue::new(&mut side.samples).speed(8.0).range(1..=1_048_576));
        } else {
            ui.label("Pictures of a still");
            ui.add(egui::DragValue::new(&mut side.pictures).speed(0.1).range(1..=1024))
                .on_hover_text("Anti-aliasing at rest: --aa");
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

/// The passes of A with their times.
fn passes(viewer: &Viewer, ui: &mut Ui) {
    let Some(shown) = viewer.sides[0].shown().filter(|shown| !shown.passes.is_empty()) else { return };
    let all: f64 = shown.passes.iter().map(|pass| pass.milliseconds).sum();
    egui::CollapsingHeader::new(format!("Passes of A: {all:.1} ms")).id_salt("passes").default_open(false).show(
        ui,
        |ui| {
            history(viewer, ui);
            for pass in shown.passes.iter() {
                let share = if all > 0.0 { (pass.milliseconds / all) as f32 } else { 0.0 };
                ui.horizontal(|ui| {
                    let (rect, _) = ui.allocate_exact_size(egui::vec2(60.0, 10.0), egui::Sense::hover());
                    let filled = egui::Rect::from_min_size(rect.min, egui::vec2(rect.width() * share, rect.height()));
                    ui.painter().rect_filled(rect, 1.0, ui.visuals().extreme_bg_color);
                    ui.painter().rect_filled(filled, 1.0, ui.visuals().selection.bg_fill);
                    ui.monospace(format!("{:7.2} ms", pass.milliseconds));
                    ui.add(egui::Label::new(RichText::new(&pass.name).small()).truncate()).on_hover_text(&pass.name);
                });
            }
        },
    );
}

/// The times of the last pictures as bars.
fn history(viewer: &Viewer, ui: &mut Ui) {
    let times = &viewer.times().milliseconds;
    let most = times.iter().copied().fold(1e-3, f64::max);
    let (rect, response) = ui.allocate_exact_size(egui::vec2(ui.available_width(), 36.0), egui::Sense::hover());
    ui.painter().rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    let width = rect.width() / KEPT as f32;
    for (index, time) in times.iter().enumerate() {
        let height = rect.height() * (time / most) as f32;
        let x = rect.left() + width * index as f32;
        let bar =
            egui::Rect::from_min_max(egui::pos2(x, rect.bottom() - height), egui::pos2(x + width * 0.8, rect.bottom()));
        ui.painter().rect_filled(bar, 0.0, ui.visuals().selection.bg_fill);
    }
    response.on_hover_text(format!("Times of the last {} pictures, at most {most:.0} ms", times.len()));
}

/// What the user must know of the scene and of the picture.
fn notes(viewer: &Viewer, ui: &mut Ui) {
    let Some(stage) = &viewer.stage else { return };
    let of_scene = stage.notes().iter().map(|note| format!("{}: {}", note.place, note.text));
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
