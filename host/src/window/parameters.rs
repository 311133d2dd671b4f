//! The settings of tracker and particle filter, to be changed while a recording is played.

use super::engine::{Command, Kind, Snapshot};
use crate::export::file;
use crate::{particle, toml_file};
use eframe::egui::{self, ComboBox, DragValue, RichText, Ui};
use serde::{Serialize, de::DeserializeOwned};
use sohle_shared::tracker::settings::{SETTINGS, Setting};
use sohle_shared::tracker::{self, Detector, Method};
use std::path::PathBuf;

/// Which settings are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Page {
    /// Those of the tracker.
    #[default]
    Tracker,
    /// Those of the particle filter.
    Particle,
}

/// What is being edited.
#[derive(Debug, Default)]
pub struct Editor {
    page: Page,
    /// Only settings whose name has this in it are shown.
    wanted: String,
    /// Where settings are read from and written to; nothing for the usual file.
    files: [Option<String>; 2],
    /// As they are here, if they were changed and the engine does not have them yet.
    tracker: Option<tracker::Parameters>,
    particle: Option<particle::Parameters>,
    /// What came of the last file.
    told: String,
}

impl Editor {
    /// Shows them; what is changed is asked for at once.
    pub fn show(&mut self, ui: &mut Ui, snapshot: &Snapshot, asked: &mut Vec<Command>) {
        let Some(current) = snapshot.settings.as_ref().filter(|_| snapshot.kind == Kind::Replay) else {
            ui.label("The settings of a recording that is played are shown here.");
            return;
        };
        ui.horizontal(|ui| {
            ui.selectable_value(&mut self.page, Page::Tracker, "Tracker");
            ui.add_enabled_ui(snapshot.particle.is_some(), |ui| {
                ui.selectable_value(&mut self.page, Page::Particle, "Particle filter");
            });
        });
        match (self.page, &snapshot.particle) {
            (Page::Particle, Some(current)) => self.particle(ui, current, asked),
            _ => self.tracker(ui, current, asked),
        }
    }

    fn tracker(&mut self, ui: &mut Ui, current: &tracker::Parameters, asked: &mut Vec<Command>) {
        self.tracker = self.tracker.filter(|edited| edited != current);
        let mut parameters = self.tracker.unwrap_or(*current);
        let before = parameters;
        let sets = [
            ("Default", "The settings that measured best", tracker::Parameters::default()),
            ("Documented", "The settings of the source document", tracker::Parameters::documented()),
        ];
        let mut done = self.buttons(ui, &mut parameters, &sets, Page::Tracker);
        done |= self.list(ui, |ui, wanted| {
            let mut done = choices(ui, &mut parameters);
            done |= numbers(ui, SETTINGS, wanted, &mut parameters);
            done
        });
        if parameters != before {
            self.tracker = Some(parameters);
        }
        let due = done || parameters != before && !ui.input(|input| input.pointer.any_down());
        let Some(edited) = self.tracker.filter(|_| due) else { return };
        match edited.check() {
            Ok(()) => {
                self.told.clear();
                asked.push(Command::Tracker(Box::new(edited)));
            }
            Err(unfit) => self.told = unfit.to_string(),
        }
    }

    fn particle(&mut self, ui: &mut Ui, current: &particle::Parameters, asked: &mut Vec<Command>) {
        self.particle.take_if(|edited| edited == current);
        let mut parameters = self.particle.clone().unwrap_or_else(|| current.clone());
        let before = parameters.clone();
        let sets = [
            ("Default", "The settings that measured best", particle::Parameters::default()),
            ("Phone", "For steps of a phone in the hand", particle::Parameters::phone()),
            ("Documented", "The settings of the source document", particle::Parameters::documented()),
        ];
        let mut done = self.buttons(ui, &mut parameters, &sets, Page::Particle);
        done |= self.list(ui, |ui, wanted| {
            let mut done = false;
            let method = &mut parameters.method;
            ComboBox::from_label("method").selected_text(format!("{method:?}")).show_ui(ui, |ui| {
                for other in [particle::Method::Covariance, particle::Method::Documented] {
                    done |= ui.selectable_value(method, other, format!("{other:?}")).changed();
                }
            });
            done |= numbers(ui, particle::settings::SETTINGS, wanted, &mut parameters);
            done
        });
        let changed = parameters != before;
        if changed {
            self.particle = Some(parameters);
        }
        let due = done || changed && !ui.input(|input| input.pointer.any_down());
        let Some(edited) = self.particle.as_ref().filter(|_| due) else { return };
        match edited.check() {
            Ok(()) => {
                self.told.clear();
                asked.push(Command::Particle(Box::new(edited.clone())));
            }
            Err(unfit) => self.told = unfit.to_string(),
        }
    }

    /// Whether the settings are to be applied.
    fn buttons<P: Clone + Serialize + DeserializeOwned>(
        &mut self,
        ui: &mut Ui,
        parameters: &mut P,
        sets: &[(&str, &str, P)],
        page: Page,
    ) -> bool {
        let mut done = false;
        let (file, usual) = match page {
            Page::Tracker => (&mut self.files[0], "parameters.toml"),
            Page::Particle => (&mut self.files[1], "particle.toml"),
        };
        let file = file.get_or_insert_with(|| usual.into());
        ui.horizontal_wrapped(|ui| {
            for (word, told, set) in sets {
                if ui.button(*word).on_hover_text(*told).clicked() {
                    *parameters = set.clone();
                    done = true;
                }
            }
            let label = ui.label("File");
            ui.add(egui::TextEdit::singleline(file).desired_width(140.0)).labelled_by(label.id);
            if ui.button("Load").on_hover_text("Reads the settings from the file").clicked() {
                match toml_file::read("settings", &PathBuf::from(&*file)) {
                    Ok(read) => {
                        *parameters = read;
                        done = true;
                    }
                    Err(error) => self.told = error.to_string(),
                }
            }
            if ui.button("Save").on_hover_text("Writes the settings as TOML").clicked() {
                self.told = match save(file, parameters) {
                    Ok(()) => format!("written to {file}"),
                    Err(told) => told,
                };
            }
        });
        done
    }

    /// The list of settings, of those whose names are wanted; whether they are to be applied.
    fn list(&mut self, ui: &mut Ui, show: impl FnOnce(&mut Ui, &str) -> bool) -> bool {
        ui.horizontal(|ui| {
            let label = ui.label("Find");
            ui.add(egui::TextEdit::singleline(&mut self.wanted).desired_width(120.0)).labelled_by(label.id);
        });
        if !self.told.is_empty() {
            ui.label(RichText::new(&self.told).small());
        }
        ui.separator();
        let wanted = self.wanted.trim().to_lowercase();
        egui::ScrollArea::both().auto_shrink(false).show(ui, |ui| show(ui, &wanted)).inner
    }
}

fn save(path: &str, parameters: &impl Serialize) -> Result<(), String> {
    let text = toml::to_string(parameters).map_err(|error| error.to_string())?;
    file::write(&PathBuf::from(path), text.as_bytes()).map_err(|error| error.to_string())
}

fn choices(ui: &mut Ui, parameters: &mut tracker::Parameters) -> bool {
    let before = *parameters;
    ui.horizontal(|ui| {
        let methods = [Method::Pivot, Method::Unscented].into_iter().filter(|method| method.available());
        ComboBox::from_label("method").selected_text(format!("{:?}", parameters.method)).show_ui(ui, |ui| {
            for method in methods {
                ui.selectable_value(&mut parameters.method, method, format!("{method:?}"));
            }
        });
        let detector = &mut parameters.document.detector;
        ui.add_enabled_ui(parameters.method == Method::Unscented, |ui| {
            ComboBox::from_label("detector").selected_text(format!("{detector:?}")).show_ui(ui, |ui| {
                for other in [
                    Detector::Documented,
                    Detector::Shoe,
                    Detector::Ared,
                    Detector::Amv,
                    Detector::Mag,
                    Detector::Adaptive,
                ] {
                    ui.selectable_value(detector, other, format!("{other:?}"));
                }
            });
        });
    });
    *parameters != before
}

/// The settings whose names are wanted, a row each, to be changed within their bounds. Whether what was changed is to be applied.
fn numbers<P>(ui: &mut Ui, settings: &'static [Setting<P>], wanted: &str, parameters: &mut P) -> bool {
    let rows = |ui: &mut Ui| {
        let mut done = false;
        for setting in settings.iter().filter(|setting| setting.name.contains(wanted)) {
            done |= number(ui, setting, parameters);
            ui.end_row();
        }
        done
    };
    egui::Grid::new("settings").num_columns(3).striped(true).show(ui, rows).inner
}

/// One setting. Whether it is to be applied.
fn number<P>(ui: &mut Ui, setting: &Setting<P>, parameters: &mut P) -> bool {
    let mut value = setting.value(parameters);
    let label = ui.label(setting.name);
    let size = value.abs().max(setting.least.abs()).max(1e-6);
    let drag = DragValue::new(&mut value).range(setting.least..=setting.largest).speed(size * 0.01).max_decimals(9);
    let response = ui.add(drag).labelled_by(label.id);
    let unit = if setting.unit == "1" { "" } else { setting.unit };
    ui.label(RichText::new(unit).weak());
    let response = response.on_hover_text(format!("{} to {} {unit}", setting.least, setting.largest));
    if response.changed() {
        setting.set(parameters, value);
    }
    response.drag_stopped() || response.lost_focus()
}
