//! What the keys and the mouse do, laid over the window.

use super::map::KEYS;
use eframe::egui::{self, Key, Modifiers, RichText, Ui};

/// Keys of the window; those of the map are its own.
const WINDOW: [(&str, &str); 6] = [
    ("F1", "show or hide this"),
    ("Space", "play, pause"),
    ("Right, left", "go to the next step, to the one before"),
    ("Home, end", "go to the beginning, to the end"),
    ("Ctrl+O", "open a recording"),
    ("Ctrl+K", "connect to a shoe"),
];

/// What a plot does.
const PLOT: [(&str, &str); 5] = [
    ("Left button", "move it; the time no longer goes on by itself"),
    ("Wheel", "change the range of values"),
    ("Ctrl and wheel", "change how much time is seen"),
    ("Double click", "show all values again"),
    ("Click", "go to that moment of a recording"),
];

/// Shows it while it is `open`.
pub fn show(ui: &Ui, open: &mut bool) {
    if !*open {
        return;
    }
    let modal = egui::Modal::new("help".into()).show(ui.ctx(), |ui| {
        ui.set_max_width(620.0);
        ui.heading("Keys and mouse");
        egui::ScrollArea::vertical().max_height(ui.ctx().content_rect().height() * 0.7).show(ui, |ui| {
            let parts: [(&str, &[(&str, &str)]); 3] = [("Window", &WINDOW), ("Map", KEYS), ("Plots", &PLOT)];
            for (title, keys) in parts {
                ui.add_space(8.0);
                ui.label(RichText::new(title).strong());
                egui::Grid::new(title).num_columns(2).spacing([16.0, 4.0]).show(ui, |ui| {
                    for (key, what) in keys {
                        ui.label(RichText::new(*key).monospace());
                        ui.add(egui::Label::new(*what).wrap());
                        ui.end_row();
                    }
                });
            }
        });
        ui.add_space(8.0);
        ui.button("Close").clicked()
    });
    if modal.inner || modal.should_close() {
        *open = false;
    }
}

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// This help.
    Help,
    /// To play, or to pause.
    Play,
    /// The next step.
    Ahead,
    /// The step before.
    Back,
    /// The beginning.
    Home,
    /// The end.
    End,
    /// The dialog for recordings.
    Open,
    /// The dialog for shoes.
    Connect,
}

/// Keys that were pressed, unless somebody writes.
pub fn pressed(ui: &Ui) -> Vec<Asked> {
    const NONE: Modifiers = Modifiers::NONE;
    const CTRL: Modifiers = Modifiers::COMMAND;
    let keys = [
        (NONE, Key::F1, Asked::Help),
        (NONE, Key::Space, Asked::Play),
        (NONE, Key::ArrowRight, Asked::Ahead),
        (NONE, Key::ArrowLeft, Asked::Back),
        (NONE, Key::Home, Asked::Home),
        (NONE, Key::End, Asked::End),
        (CTRL, Key::O, Asked::Open),
        (CTRL, Key::K, Asked::Connect),
    ];
    // A button that has the focus is pressed by the same keys.
    if ui.ctx().egui_wants_keyboard_input() || ui.ctx().memory(|memory| memory.focused().is_some()) {
        return Vec::new();
    }
    let pressed =
        |(modifiers, key, _): &(Modifiers, Key, Asked)| ui.input_mut(|input| input.consume_key(*modifiers, *key));
    keys.into_iter().filter(pressed).map(|(.., asked)| asked).collect()
}
