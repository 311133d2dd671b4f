//! The buttons above, and the bar below with which one goes through a recording.

use super::engine::{Beside, Command, Kind, Snapshot};
use eframe::egui::containers::menu::{MenuButton, MenuConfig};
use eframe::egui::{self, Button, ComboBox, PopupCloseBehavior, ProgressBar, RichText, Slider, Ui};

/// How fast a recording can be played; the last is as fast as it can be computed.
const SPEEDS: [f64; 8] = [0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 20.0, f64::INFINITY];

/// What the window itself is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// Choose a recording.
    Open,
    /// Choose a shoe.
    Connect,
    /// Write the picture of the window.
    Picture,
    /// Write the track.
    Track,
    /// Begin or end to record.
    Record,
    /// Show or hide the list of views.
    Selector,
    /// Light or dark.
    Look,
    /// What keys there are.
    Help,
}

/// The buttons above.
pub fn show(ui: &mut Ui, snapshot: &Snapshot, commands: &mut Vec<Command>) -> Vec<Asked> {
    let mut asked = Vec::new();
    let open = matches!(snapshot.kind, Kind::Replay | Kind::Live);
    let live = snapshot.kind == Kind::Live;
    ui.horizontal_wrapped(|ui| {
        own(ui, &mut asked, true, "View list", "Shows or hides the list of views", Asked::Selector);
        ui.separator();
        own(ui, &mut asked, true, "Open…", "Plays a recording (Ctrl+O)", Asked::Open);
        own(ui, &mut asked, true, "Connect…", "Connects to a shoe (Ctrl+K)", Asked::Connect);
        let recording = snapshot.link.as_ref().is_some_and(|link| link.recording.is_some());
        let word = if recording { "Stop recording" } else { "Start recording" };
        own(ui, &mut asked, live, word, "Writes what the shoe says into a file", Asked::Record);
        ui.separator();
        for (word, told, command) in [
            ("RESET", "Begins anew: the tracker, and who follows", Command::Reset),
            ("INIT", "Waits for a rest, to find how the sensor lies", Command::Init),
            ("TRACK", "Follows the foot from the next stance, without waiting for a rest", Command::Track),
        ] {
            if ui.add_enabled(open, Button::new(RichText::new(word).strong())).on_hover_text(told).clicked() {
                commands.push(command);
            }
        }
        ui.separator();
        others(ui, snapshot, commands);
        ui.separator();
        own(ui, &mut asked, open, "Export track", "Writes the path into a file", Asked::Track);
        own(ui, &mut asked, true, "Export picture", "Writes a picture of the window", Asked::Picture);
        ui.separator();
        own(ui, &mut asked, true, "◑", "Light or dark", Asked::Look);
        own(ui, &mut asked, true, "?", "Keys and mouse (F1)", Asked::Help);
        ui.separator();
        ui.label(RichText::new(&snapshot.name).weak());
    });
    asked
}

/// Which other methods follow too.
fn others(ui: &mut Ui, snapshot: &Snapshot, commands: &mut Vec<Command>) {
    let possible = |which: &Beside| if which.on_graph() { snapshot.whereabouts.is_some() } else { snapshot.positions };
    ui.add_enabled_ui(Beside::ALL.iter().any(possible), |ui| {
        let menu = MenuButton::new("Methods")
            .config(MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside));
        let (button, _) = menu.ui(ui, |ui| {
            for which in Beside::ALL {
                let mut on = snapshot.others.iter().any(|(running, _)| *running == which);
                ui.add_enabled_ui(possible(&which), |ui| {
                    if ui.checkbox(&mut on, which.word()).on_hover_text(which.told()).changed() {
                        commands.push(Command::Beside(which, on));
                    }
                });
            }
        });
        button.on_hover_text("Follows by other methods too, to compare");
    });
}

fn own(ui: &mut Ui, asked: &mut Vec<Asked>, enabled: bool, word: &str, told: &str, what: Asked) {
    if ui.add_enabled(enabled, Button::new(word)).on_hover_text(told).clicked() {
        asked.push(what);
    }
}

/// The bar below. `told` is what was said last.
pub fn bar(ui: &mut Ui, snapshot: &Snapshot, told: &str, commands: &mut Vec<Command>) {
    if snapshot.kind == Kind::Replay {
        ui.horizontal(|ui| replay(ui, snapshot, commands));
    }
    let words = match (&snapshot.fault, snapshot.kind) {
        (Some(fault), _) => RichText::new(format!("⚠ {fault}")).color(ui.visuals().warn_fg_color),
        (None, Kind::Opening) => RichText::new(format!("reading {}", snapshot.name)),
        (None, _) => RichText::new(told),
    };
    ui.add(egui::Label::new(words).truncate());
}

fn replay(ui: &mut Ui, snapshot: &Snapshot, commands: &mut Vec<Command>) {
    let button = |ui: &mut Ui, word: &str, told: &str| {
        let response = ui.button(word).on_hover_text(told);
        // A symbol says nothing to who cannot see it.
        response.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::Button, true, told));
        response.clicked()
    };
    if button(ui, "⏮", "To the step before") {
        commands.push(Command::StepBack);
    }
    let (word, told) = if snapshot.pace.playing { ("⏸", "Pause") } else { ("▶", "Play") };
    if button(ui, word, told) {
        commands.push(Command::Play(!snapshot.pace.playing));
    }
    if button(ui, "⏭", "To the next step") {
        commands.push(Command::StepAhead);
    }
    let word = |speed: f64| if speed.is_finite() { format!("{speed} ×") } else { "fastest".to_owned() };
    ComboBox::from_id_salt("speed").width(70.0).selected_text(word(snapshot.pace.speed)).show_ui(ui, |ui| {
        for speed in SPEEDS {
            if ui.selectable_label(speed == snapshot.pace.speed, word(speed)).clicked() {
                commands.push(Command::Speed(speed));
            }
        }
    });
    let [first, last] = snapshot.span;
    ui.label(RichText::new(format!("{} / {}", clock(snapshot.time - first), clock(last - first))).monospace());
    if let Some(share) = snapshot.computing {
        ui.add(ProgressBar::new(share).desired_width(120.0).text("computing"));
    }
    let mut time = snapshot.time;
    ui.spacing_mut().slider_width = (ui.available_width() - 16.0).max(60.0);
    let slider = Slider::new(&mut time, first..=last.max(first + 1e-3)).show_value(false).trailing_fill(true);
    let response = ui.add(slider);
    response.widget_info(|| egui::WidgetInfo::slider(true, time, "Time"));
    if response.changed() {
        commands.push(Command::Jump(time));
    }
}

/// Minutes and seconds.
fn clock(seconds: f64) -> String {
    let tenths = (seconds.max(0.0) * 10.0).round() as u64;
    format!("{}:{:02}.{}", tenths / 600, tenths / 10 % 60, tenths % 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_minutes_and_seconds() {
        assert_eq!([0.0, 59.96, 61.24, -1.0].map(clock), ["0:00.0", "1:00.0", "1:01.2", "0:00.0"]);
    }
}
