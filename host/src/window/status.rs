//! What is known and what is wrong, in words and colour.

use super::engine::snapshot::{Link, Warning};
use super::engine::{Kind, Snapshot};
use crate::particle::State;
use eframe::egui::{self, Color32, RichText, Ui};
use sohle_shared::tracker;

/// Background of the word for a state: red, orange, green, in tones on which white is read well.
fn tone(state: State) -> Color32 {
    match state {
        State::Searching => Color32::from_rgb(0x3b, 0x5b, 0x92),
        State::SeveralPlaces => Color32::from_rgb(0x9a, 0x5b, 0x00),
        State::Located => Color32::from_rgb(0x1d, 0x72, 0x3c),
        State::Lost => Color32::from_rgb(0xa8, 0x24, 0x24),
    }
}

/// What the tracker does, in a word.
pub fn phase(phase: tracker::State) -> &'static str {
    match phase {
        tracker::State::Reset => "RESET",
        tracker::State::Init => "INIT: waits for a rest",
        tracker::State::Tracking => "TRACKING",
    }
}

/// Shows it.
pub fn show(ui: &mut Ui, snapshot: &Snapshot, latency: Option<Latency>) {
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        match &snapshot.whereabouts {
            Some(whereabouts) => {
                let word = format!(" {} ", whereabouts.state.word());
                let tone = tone(whereabouts.state);
                ui.label(RichText::new(word).heading().strong().color(Color32::WHITE).background_color(tone));
                let place = whereabouts.room.as_deref().filter(|room| !room.is_empty()).unwrap_or("no room");
                let located = whereabouts.state == State::Located;
                let place = if located { place } else { "-" };
                ui.add(egui::Label::new(RichText::new(place).size(30.0).strong()).wrap());
                let floor = whereabouts.floor.as_deref().filter(|_| located).unwrap_or("-");
                ui.label(RichText::new(floor).size(20.0));
                if let Some(cluster) = &whereabouts.place {
                    let [x, y] = [cluster.position.x, cluster.position.y];
                    let share = 100.0 * cluster.probability;
                    rows(
                        ui,
                        "place",
                        &[
                            ("likeliest place", format!("{x:.2}, {y:.2} m")),
                            ("probability", format!("{share:.0} %")),
                            ("sigma", format!("{:.2} m", cluster.sigma_m())),
                            ("particles", whereabouts.particles.to_string()),
                            ("effective", format!("{:.0}", whereabouts.effective)),
                        ],
                    );
                }
            }
            None if snapshot.kind == Kind::Nothing => {
                ui.label(RichText::new("nothing is open").heading());
                ui.label("Open a recording, or connect to a shoe.");
            }
            None => {
                ui.label(RichText::new("steps alone").heading());
                ui.label("Without a building, the place is where the steps lead from the start.");
            }
        }
        if snapshot.kind != Kind::Nothing {
            ui.separator();
            let foot = if snapshot.stance { "stands" } else { "swings" };
            rows(
                ui,
                "tracker",
                &[
                    ("tracker", phase(snapshot.phase).into()),
                    ("foot", foot.into()),
                    ("steps", snapshot.steps.to_string()),
                    ("way", format!("{:.1} m", snapshot.distance)),
                ],
            );
        }
        for (which, decided) in &snapshot.others {
            ui.separator();
            ui.label(RichText::new(which.word()).strong());
            ui.add(egui::Label::new(RichText::new(decided).small()).wrap());
        }
        if let Some(link) = &snapshot.link {
            ui.separator();
            line(ui, link);
        }
        warnings(ui, snapshot);
        if let Some(latency) = latency {
            ui.separator();
            rows(
                ui,
                "latency",
                &[
                    ("step to picture, median", format!("{:.1} ms", latency.median_ms)),
                    ("99 of 100 within", format!("{:.1} ms", latency.p99_ms)),
                ],
            );
        }
    });
}

/// From the arrival of steps to the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latency {
    /// Steps that were measured.
    pub steps: usize,
    /// The half takes no longer. **Units:** ms.
    pub median_ms: f64,
    /// Of a hundred, 99 take no longer. **Units:** ms.
    pub p99_ms: f64,
}

fn rows(ui: &mut Ui, name: &str, rows: &[(&str, String)]) {
    egui::Grid::new(name).num_columns(2).spacing([12.0, 3.0]).show(ui, |ui| {
        for (what, value) in rows {
            ui.label(*what);
            ui.label(RichText::new(value).monospace());
            ui.end_row();
        }
    });
}

fn line(ui: &mut Ui, link: &Link) {
    let (word, tone) = if link.heard {
        ("the shoe is heard", Color32::from_rgb(0x1d, 0x72, 0x3c))
    } else {
        ("nothing is heard", Color32::from_rgb(0xa8, 0x24, 0x24))
    };
    ui.label(RichText::new(format!(" {word} ")).strong().color(Color32::WHITE).background_color(tone));
    ui.label(&link.state);
    let or = |text: Option<String>| text.unwrap_or_else(|| "-".into());
    rows(
        ui,
        "link",
        &[
            ("address", link.address.clone()),
            ("frames", format!("{}, {} damaged", link.frames, link.damaged)),
            ("steps lost", link.lost.to_string()),
            ("clock known within", or(link.clock_ms.map(|ms| format!("{ms:.2} ms")))),
            ("load", or(link.load.map(|load| format!("{:.1} %", f64::from(load) * 0.1)))),
            ("battery", or(link.battery.map(|volts| format!("{volts:.2} V")))),
            ("sensor", or(link.temperature.map(|degrees| format!("{degrees:.1} °C")))),
            ("recording", or(link.recording.as_ref().map(|path| path.display().to_string()))),
        ],
    );
}

fn warnings(ui: &mut Ui, snapshot: &Snapshot) {
    if snapshot.warnings.is_empty() {
        return;
    }
    ui.separator();
    for Warning { what, advice } in &snapshot.warnings {
        ui.colored_label(ui.visuals().warn_fg_color, format!("⚠ {what}"));
        ui.label(RichText::new(format!("{advice}.")).small());
    }
}
