//! The bars above and below the picture: how A and B are shown, how far they are from each other, what their threads do, and the pixel under the mouse.

use std::collections::VecDeque;

use egui::{Context, RichText, Ui};

use super::{
    app::{Compare, Viewer},
    keys,
    session::Doing,
    side::Side,
    wanted::Shown,
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
        let Some(shown) = shown.filter(|shown| shown.number != self.last && shown.fresh) else { return };
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

/// The bars above and below the picture.
pub fn show(viewer: &mut Viewer, context: &Context) {
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
    let now = [0, 1].map(|side: usize| viewer.sides[side].shown().map_or(0, |shown| shown.number));
    let text = format!("relMSE {:.2e}  FLIP {:.4}  energy {:.3}", answer.rel_mse, answer.flip, answer.energy);
    let text = RichText::new(text).monospace();
    // Numbers are grey while new ones are computed.
    ui.label(if answer.of == now { text } else { text.weak() }).on_hover_text(
        "A against reference B: relative mean squared error, FLIP, and the sum of all pixels of A divided by that of B",
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
        // It stays until the files are mended; the picture is that of the last good ones.
        if let Some(mistake) = viewer.followed.as_ref().and_then(|followed| followed.mistake.as_ref()) {
            ui.colored_label(ui.visuals().error_fg_color, mistake.replace('\n', " "));
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
            format!("{name}: {size}, {:.0} of {} paths per pixel", shown.samples, side.samples)
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

/// The passes of A with their times.
pub fn passes(viewer: &Viewer, ui: &mut Ui) {
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
