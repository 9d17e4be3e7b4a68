//! Fields of the panel for texts and times of day.

use egui::{Key, Slider, SliderClamping, TextEdit, Ui};

/// Width of a text field, points.
const WIDTH: f32 = 110.0;
/// The last minute of a day that a slider reaches.
const LAST_MINUTE: f64 = 1439.0;

/// A text that changes when a person has finished it, with Enter or by going to another field: a half of a word or of a date is an error. Escape
/// takes back what was written. `name` is unique beside the other fields. `None`: it is as before.
pub fn text(ui: &mut Ui, name: &str, before: &str) -> Option<String> {
    let id = id_of(ui, name);
    let draft = ui.data(|data| data.get_temp::<String>(id));
    let mut now = draft.unwrap_or_else(|| before.to_owned());
    let field = ui.add(TextEdit::singleline(&mut now).id(id).desired_width(WIDTH));
    if field.has_focus() {
        ui.data_mut(|data| data.insert_temp(id, now));
        return None;
    }
    ui.data_mut(|data| data.remove::<String>(id));
    let finished = field.lost_focus() && !ui.input(|input| input.key_pressed(Key::Escape));
    (finished && now != before).then_some(now)
}

fn id_of(ui: &Ui, name: &str) -> egui::Id {
    ui.make_persistent_id(("text", name))
}

/// A time of day as a slider with a field that a person may write in. `None`: it is as before.
pub fn clock(ui: &mut Ui, name: &str, before: &str) -> Option<String> {
    // A slider has no place for what is no time.
    let Some(minutes) = minutes(before) else { return text(ui, name, before) };
    let mut now = minutes;
    ui.spacing_mut().slider_width = 90.0;
    let slider = Slider::new(&mut now, 0.0..=LAST_MINUTE).step_by(1.0).smart_aim(false);
    // A time with seconds, which the program was started with, stays as it is until the slider moves.
    let slider = slider.clamping(SliderClamping::Edits).update_while_editing(false);
    ui.add(slider.custom_formatter(|minutes, _| label(minutes)).custom_parser(self::minutes));
    (now != minutes).then(|| label(now))
}

/// The minutes since midnight of `07:40` or `07:40:30`.
fn minutes(text: &str) -> Option<f64> {
    let mut parts = text.trim().split(':').map(|part| {
        let digits = (1..=2).contains(&part.len()) && part.bytes().all(|byte| byte.is_ascii_digit());
        digits.then(|| part.parse::<u32>().ok()).flatten()
    });
    let (hours, minutes) = (parts.next()??, parts.next()??);
    let seconds = parts.next().unwrap_or(Some(0))?;
    let good = hours < 24 && minutes < 60 && seconds < 60 && parts.next().is_none();
    good.then(|| f64::from(hours * 3600 + minutes * 60 + seconds) / 60.0)
}

fn label(minutes: f64) -> String {
    let seconds = (minutes * 60.0).round().clamp(0.0, 86399.0) as u32;
    let short = format!("{:02}:{:02}", seconds / 3600, seconds / 60 % 60);
    if seconds.is_multiple_of(60) { short } else { format!("{short}:{:02}", seconds % 60) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{CentralPanel, Context, Event, Modifiers, RawInput};

    #[test]
    fn times_are_read_and_written() {
        for text in ["00:00", "07:40", "07:40:30", "23:59", "23:59:59"] {
            assert_eq!(minutes(text).map(label).as_deref(), Some(text));
        }
        assert_eq!(minutes(" 7:40"), Some(460.0));
        for wrong in ["", "7", "24:00", "12:60", "12:00:60", "12:00:00:00", "12:", "-1:00", "1e1:00", "noon"] {
            assert_eq!(minutes(wrong), None, "{wrong}");
        }
    }

    /// What a field says after each of the frames with these events. The field has the keyboard.
    fn typed(frames: &[Vec<Event>]) -> Vec<Option<String>> {
        let context = Context::default();
        let focus = |context: &Context, events: Vec<Event>, take: bool| {
            let mut found = None;
            let input = RawInput { events, ..RawInput::default() };
            let _ = context.run(input, |context| {
                CentralPanel::default().show(context, |ui| {
                    if take {
                        let id = id_of(ui, "word");
                        ui.memory_mut(|memory| memory.request_focus(id));
                    }
                    found = text(ui, "word", "dusk");
                });
            });
            found
        };
        focus(&context, Vec::new(), true);
        frames.iter().map(|events| focus(&context, events.clone(), false)).collect()
    }

    fn key(key: Key) -> Event {
        Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers: Modifiers::NONE }
    }

    #[test]
    fn a_text_counts_when_it_is_finished() {
        let letters = |text: &str| vec![Event::Text(text.into())];
        let found = typed(&[letters("!"), letters("?"), vec![key(Key::Enter)], Vec::new()]);
        assert_eq!(found, [None, None, Some("dusk!?".to_owned()), None]);
        let found = typed(&[letters("!"), vec![key(Key::Escape)], Vec::new()]);
        assert_eq!(found, [None, None, None]);
        let found = typed(&[vec![key(Key::Enter)], Vec::new()]);
        assert_eq!(found, [None, None]);
    }

    #[test]
    fn a_time_stays_until_someone_moves_it() {
        let context = Context::default();
        for time in ["07:40", "07:40:30", "23:59:59", "noon"] {
            for _ in 0..3 {
                let mut found = None;
                let _ = context.run(RawInput::default(), |context| {
                    CentralPanel::default().show(context, |ui| found = clock(ui, "time", time));
                });
                assert_eq!(found, None, "{time}");
            }
        }
    }
}
