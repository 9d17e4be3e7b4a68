//! The picture in the window: both sides, lamps, and the mouse.

use egui::{Color32, Context, CursorIcon, Pos2, Rect, Sense, Stroke, TextureHandle, TextureOptions, Ui};
use glam::{Vec2, Vec3};
use lucerna::scene::View;

use super::{
    app::{Compare, Held, Viewer},
    fly,
    measured::MapOf,
    painted,
    side::image_of,
};
use crate::{
    args::Size,
    lamps::{self, Put},
};

/// Radius in which a lamp is picked, points.
const PICK: f32 = 12.0;
const WHOLE: Rect = Rect { min: Pos2::ZERO, max: Pos2 { x: 1.0, y: 1.0 } };

/// The middle of the window.
pub fn area(viewer: &mut Viewer, context: &Context) {
    let frame = egui::Frame::NONE.fill(Color32::from_gray(18));
    egui::CentralPanel::default().frame(frame).show(context, |ui| {
        let scale = context.pixels_per_point();
        let space = ui.max_rect();
        // Whole pixels of the screen, so that a pixel of the picture is one of the screen.
        let min = (space.min.to_vec2() * scale).ceil();
        let max = (space.max.to_vec2() * scale).floor();
        let size = Size { width: (max.x - min.x).max(0.0) as u32, height: (max.y - min.y).max(0.0) as u32 };
        if size != viewer.size {
            viewer.size = size;
            viewer.moves();
        }
        let rect = Rect::from_min_max((min / scale).to_pos2(), (max / scale).to_pos2());
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        if viewer.stage.is_none() {
            empty(viewer, ui, rect);
            return;
        }
        paint(viewer, ui, rect, scale);
        let view = seen(viewer);
        rings(viewer, ui, rect, view.as_ref());
        mouse(viewer, ui, &response, rect, scale, view.as_ref());
    });
}

fn empty(viewer: &Viewer, ui: &Ui, rect: Rect) {
    let text = if viewer.is_reading() {
        "Reading the scene"
    } else if viewer.trouble.is_some() {
        "The scene could not be opened; the line below says why"
    } else {
        "Drop a scene here: .gltf, .glb or .obj"
    };
    ui.painter().text(
        rect.center(),
        egui::Align2::CENTER_CENTER,
        text,
        egui::FontId::proportional(20.0),
        Color32::from_gray(170),
    );
}

/// The view of the whole picture.
fn seen(viewer: &Viewer) -> Option<View> {
    let (pose, placed) = (viewer.pose.as_ref()?, viewer.placed()?);
    let size = viewer.size_of_side();
    (size.width > 0 && size.height > 0).then(|| placed.view(pose, size))
}

/// Paints what the sides have.
fn paint(viewer: &mut Viewer, ui: &Ui, rect: Rect, scale: f32) {
    let ev = viewer.ev();
    let context = ui.ctx().clone();
    let [a, b] = &mut viewer.sides;
    let (a, b) = (a.texture(&context), b.texture(&context));
    let fit = |texture: &(TextureHandle, bool), space: Rect| -> Rect {
        let size = texture.0.size_vec2() / scale;
        // A picture of the size of the space lies pixel on pixel; others are fitted into it.
        let near = (size - space.size()).abs();
        if texture.1 && near.x < 1.5 && near.y < 1.5 {
            return Rect::from_min_size(space.min, size);
        }
        let factor = (space.width() / size.x).min(space.height() / size.y);
        let fitted = size * factor;
        let offset = ((space.size() - fitted) * 0.5 * scale).floor() / scale;
        Rect::from_min_size(space.min + offset, fitted)
    };
    let image = |texture: &(TextureHandle, bool), space: Rect, clip: Rect| {
        ui.painter().with_clip_rect(clip.intersect(ui.clip_rect())).image(
            texture.0.id(),
            fit(texture, space),
            WHOLE,
            Color32::WHITE,
        );
    };
    if viewer.flipped {
        b.iter().for_each(|b| image(b, rect, rect));
        tag(ui, rect, "B");
        return;
    }
    match viewer.compare {
        Compare::One => a.iter().for_each(|a| image(a, rect, rect)),
        Compare::Split => {
            let x = ((rect.left() + rect.width() * viewer.divider) * scale).round() / scale;
            let (left, right) = (rect.with_max_x(x), rect.with_min_x(x));
            a.iter().for_each(|a| image(a, rect, left));
            b.iter().for_each(|b| image(b, rect, right));
            ui.painter().vline(x, rect.y_range(), Stroke::new(1.5, Color32::WHITE));
            tag(ui, left, "A");
            tag(ui, right, "B");
        }
        Compare::Beside => {
            let half = (viewer.size_of_side().width as f32) / scale;
            let (left, right) = (rect.with_max_x(rect.left() + half), rect.with_min_x(rect.left() + half));
            a.iter().for_each(|a| image(a, left, left));
            b.iter().for_each(|b| image(b, right, right));
            tag(ui, left, "A");
            tag(ui, right, "B");
        }
        Compare::Difference => {
            if let (Some(a), Some(b)) = (viewer.sides[0].shown(), viewer.sides[1].shown())
                && a.size == b.size
            {
                let key = ([a.number, b.number], ev.to_bits(), "difference");
                let texture = kept(&context, key, || image_of(a.size, &painted::difference(&a.pixels, &b.pixels)));
                image(&(texture, true), rect, rect);
                tag(ui, rect, "2 |A − B|");
            } else {
                tag(ui, rect, "A and B have different sizes, or one side has no picture yet");
            }
        }
        Compare::Map(of) => {
            let name = if of == MapOf::Flip {
                "FLIP of A against reference B"
            } else {
                "relative error of A against reference B"
            };
            if let (Some(answer), _) = viewer.answer()
                && let Some((found, [width, height], codes)) = &answer.map
                && *found == of
            {
                let size = Size { width: *width, height: *height };
                let texture = kept(&context, (answer.of, ev.to_bits(), name), || image_of(size, codes));
                image(&(texture, true), rect, rect);
                tag(ui, rect, name);
            } else {
                tag(ui, rect, "no map yet: A and B have different sizes, or one side has no picture");
            }
        }
    }
}

/// What a texture of both sides is made of.
type MadeOf = ([u64; 2], u64, &'static str);

/// The texture of both sides, made anew where it is of something else.
fn kept(context: &Context, of: MadeOf, image: impl FnOnce() -> egui::ColorImage) -> TextureHandle {
    let id = egui::Id::new("texture of both sides");
    let before = context.data(|data| data.get_temp::<(MadeOf, TextureHandle)>(id));
    if let Some((made_of, texture)) = before
        && made_of == of
    {
        return texture;
    }
    let texture = context.load_texture("both sides", image(), TextureOptions::NEAREST);
    context.data_mut(|data| data.insert_temp(id, (of, texture.clone())));
    texture
}

fn tag(ui: &Ui, space: Rect, text: &str) {
    let at = space.left_top() + egui::vec2(8.0, 6.0);
    let font = egui::FontId::proportional(14.0);
    ui.painter().text(at + egui::vec2(1.0, 1.0), egui::Align2::LEFT_TOP, text, font.clone(), Color32::BLACK);
    ui.painter().text(at, egui::Align2::LEFT_TOP, text, font, Color32::WHITE);
}

/// Where the pixels of a view are on the screen.
fn on_screen(rect: Rect, at: Vec2) -> Pos2 {
    rect.min + egui::vec2(at.x * rect.width(), at.y * rect.height())
}

/// The space of side A.
fn space_of_a(viewer: &Viewer, rect: Rect) -> Rect {
    match viewer.compare {
        Compare::Beside => rect.with_max_x(rect.left() + rect.width() * 0.5),
        _ => rect,
    }
}

/// Lamps that can be moved: node, and place on the screen.
fn placed_lamps(viewer: &Viewer, rect: Rect, view: Option<&View>) -> Vec<(usize, Pos2)> {
    let (Some(stage), Some(pose), Some(view)) = (&viewer.stage, &viewer.pose, view) else { return Vec::new() };
    let space = space_of_a(viewer, rect);
    let lamp = |node: usize| {
        let at = fly::project(view, pose.world[node].w_axis.truncate())?;
        let inside = (-0.1..1.1).contains(&at.x) && (-0.1..1.1).contains(&at.y);
        inside.then(|| (node, on_screen(space, at)))
    };
    // Suns have no place, and no option moves a lamp that an animation moves.
    let moves = |node: &usize| !lamps::is_sun(&stage.scene, *node) && !lamps::is_animated(&stage.scene, *node);
    lamps::nodes(&stage.scene).into_iter().filter(moves).filter_map(lamp).collect()
}

fn rings(viewer: &Viewer, ui: &Ui, rect: Rect, view: Option<&View>) {
    let pointer = ui.input(|input| input.pointer.hover_pos());
    for (node, at) in placed_lamps(viewer, rect, view) {
        let chosen = viewer.held == Some(Held::Lamp(node)) || viewer.pointed_lamp == Some(node);
        let near = chosen || pointer.is_some_and(|pointer| pointer.distance(at) < PICK);
        // Only near the mouse, or for a row of the panel: marks all over the picture would hide it.
        if near {
            let painter = ui.painter().with_clip_rect(rect);
            painter.circle_stroke(at, PICK - 3.0, Stroke::new(2.0, Color32::from_rgb(255, 210, 90)));
            painter.circle_stroke(at, PICK - 1.0, Stroke::new(1.0, Color32::BLACK));
        }
    }
}

/// What the mouse does.
fn mouse(viewer: &mut Viewer, ui: &Ui, response: &egui::Response, rect: Rect, scale: f32, view: Option<&View>) {
    let (pointer, modifiers) = ui.input(|input| (input.pointer.hover_pos(), input.modifiers));
    let space = space_of_a(viewer, rect);
    viewer.pixel = pointer.filter(|at| space.contains(*at) && response.contains_pointer()).map(|at| {
        let offset = (at - space.min) * scale;
        [offset.x as u32, offset.y as u32]
    });
    let height = space.height().max(1.0);
    let drag = response.drag_delta() / height;
    let drag = Vec2::new(drag.x, drag.y);
    let line = rect.left() + rect.width() * viewer.divider;
    let on_line = |at: Pos2| viewer.compare == Compare::Split && (at.x - line).abs() < 6.0;
    if pointer.is_some_and(on_line) && response.contains_pointer() {
        ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    if response.drag_started_by(egui::PointerButton::Primary)
        && let Some(start) = ui.input(|input| input.pointer.press_origin())
    {
        let lamps = placed_lamps(viewer, rect, view);
        let nearest = lamps
            .iter()
            .filter(|(_, at)| at.distance(start) < PICK)
            .min_by(|a, b| a.1.distance(start).total_cmp(&b.1.distance(start)));
        let lamp = nearest.map(|(node, _)| Held::Lamp(*node));
        viewer.held = lamp.or_else(|| on_line(start).then_some(Held::Line));
    }
    if response.drag_stopped() {
        viewer.held = None;
    }
    if response.dragged() && drag != Vec2::ZERO {
        let button = |button| response.dragged_by(button);
        match (viewer.held, pointer, view) {
            (Some(Held::Line), Some(at), _) => {
                viewer.divider = ((at.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
                return;
            }
            (Some(Held::Lamp(node)), Some(at), Some(view)) => return drag_lamp(viewer, node, at, space, view),
            _ => (),
        }
        let (middle, alt, shift) = (button(egui::PointerButton::Middle), modifiers.alt, modifiers.shift);
        if let Some(fly) = viewer.flying() {
            if shift {
                fly.pan(drag);
            } else if middle || alt {
                fly.orbit(drag);
            } else {
                fly.turn(drag);
            }
            viewer.moves();
        }
    }
    if response.double_clicked() {
        focus(viewer, view);
    }
    if response.contains_pointer() {
        wheel(viewer, ui, modifiers.ctrl || modifiers.command);
    }
}

/// Moves a lamp in the plane through it that is parallel to the picture.
fn drag_lamp(viewer: &mut Viewer, node: usize, at: Pos2, space: Rect, view: &View) {
    let Some(world) = viewer.pose.as_ref().and_then(|pose| pose.world.get(node)) else { return };
    let depth = -view.view_from_world.transform_point3(world.w_axis.truncate()).z;
    let share = (at - space.min) / space.size();
    let place: Vec3 = fly::unproject(view, Vec2::new(share.x, share.y), depth);
    if place.is_finite() {
        viewer.moved.insert(node, Put::At(place));
        viewer.moves();
    }
}

/// Turns to the surface under the mouse.
fn focus(viewer: &mut Viewer, view: Option<&View>) {
    let (Some([x, y]), Some(view)) = (viewer.pixel, view) else { return };
    let Some(depth) = viewer.depth_at([x, y]) else { return };
    let [width, height] = view.extent;
    let at = Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
    let point = fly::unproject(view, at, depth);
    if let Some(fly) = viewer.flying() {
        fly.focus(point);
        viewer.moves();
    }
}

fn wheel(viewer: &mut Viewer, ui: &Ui, speed: bool) {
    let (scroll, zoom) = ui.input(|input| (input.smooth_scroll_delta.y, input.zoom_delta()));
    // With Ctrl the wheel comes as a zoom.
    let steps = if speed { zoom.ln() * 5.0 } else { scroll / 50.0 };
    if steps == 0.0 {
        return;
    }
    if let Some(fly) = viewer.flying() {
        if speed {
            fly.speed = (fly.speed * 1.25f32.powf(steps)).clamp(0.01, 1000.0);
        } else {
            fly.dolly(steps);
        }
        viewer.moves();
    }
}
