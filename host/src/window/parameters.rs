//! The settings of the tracker, to be changed while a recording is played.

use super::engine::{Command, Kind, Snapshot};
use crate::cli::parameters::read;
use crate::export::file;
use eframe::egui::{self, ComboBox, DragValue, RichText, Ui};
use sohle_shared::tracker::settings::{SETTINGS, Setting};
use sohle_shared::tracker::{Detector, Method, Parameters};
use std::path::PathBuf;

/// What is being edited.
#[derive(Debug)]
pub struct Editor {
    /// Only settings whose name has this in it are shown.
    wanted: String,
    /// Where settings are read from and written to.
    file: String,
    /// As they are here, if they were changed and the engine does not have them yet.
    edited: Option<Parameters>,
    /// What came of the last file.
    told: String,
}

impl Default for Editor {
    fn default() -> Self {
        Self { wanted: String::new(), file: "parameters.toml".into(), edited: None, told: String::new() }
    }
}

impl Editor {
    /// Shows them; what is changed is asked for at once.
    pub fn show(&mut self, ui: &mut Ui, snapshot: &Snapshot, asked: &mut Vec<Command>) {
        let Some(current) = snapshot.settings.as_ref().filter(|_| snapshot.kind == Kind::Replay) else {
            ui.label("The settings of a recording that is played are shown here.");
            return;
        };
        if self.edited.is_some_and(|edited| edited == **current) {
            self.edited = None;
        }
        let mut parameters = self.edited.unwrap_or(**current);
        let before = parameters;
        let mut done = self.buttons(ui, &mut parameters);
        ui.horizontal(|ui| {
            let label = ui.label("Find");
            ui.add(egui::TextEdit::singleline(&mut self.wanted).desired_width(120.0)).labelled_by(label.id);
        });
        if !self.told.is_empty() {
            ui.label(RichText::new(&self.told).small());
        }
        ui.separator();
        egui::ScrollArea::both().auto_shrink(false).show(ui, |ui| {
            done |= choices(ui, &mut parameters);
            egui::Grid::new("settings").num_columns(3).striped(true).show(ui, |ui| {
                let wanted = self.wanted.trim().to_lowercase();
                for setting in SETTINGS.iter().filter(|setting| setting.name.contains(&wanted)) {
                    done |= number(ui, setting, &mut parameters);
                    ui.end_row();
                }
            });
        });
        if parameters != before {
            self.edited = Some(parameters);
        }
        let Some(edited) = self.edited.filter(|_| done || parameters != before && !ui.input(|i| i.pointer.any_down()))
        else {
            return;
        };
        match edited.check() {
            Ok(()) => {
                self.told.clear();
                asked.push(Command::Tracker(Box::new(edited)));
            }
            Err(unfit) => self.told = unfit.to_string(),
        }
    }

    /// Whether the settings are to be applied.
    fn buttons(&mut self, ui: &mut Ui, parameters: &mut Parameters) -> bool {
        let mut done = false;
        ui.horizontal_wrapped(|ui| {
            for (word, told, set) in [
                ("Default", "The settings that measured best", Parameters::default()),
                ("Documented", "The settings of the source document", Parameters::documented()),
            ] {
                if ui.button(word).on_hover_text(told).clicked() {
                    *parameters = set;
                    done = true;
                }
            }
            let label = ui.label("File");
            ui.add(egui::TextEdit::singleline(&mut self.file).desired_width(140.0)).labelled_by(label.id);
            if ui.button("Load").on_hover_text("Reads the settings from the file").clicked() {
                match read(&PathBuf::from(&self.file)) {
                    Ok(read) => {
                        *parameters = read;
                        done = true;
                    }
                    Err(error) => self.told = error.to_string(),
                }
            }
            if ui.button("Save").on_hover_text("Writes the settings as TOML").clicked() {
                self.told = match save(&self.file, parameters) {
                    Ok(()) => format!("written to {}", self.file),
                    Err(told) => told,
                };
            }
        });
        done
    }
}

fn save(path: &str, parameters: &Parameters) -> Result<(), String> {
    let text = toml::to_string(parameters).map_err(|error| error.to_string())?;
    file::write(&PathBuf::from(path), text.as_bytes()).map_err(|error| error.to_string())
}

fn choices(ui: &mut Ui, parameters: &mut Parameters) -> bool {
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

/// One setting. Whether it is to be applied.
fn number(ui: &mut Ui, setting: &'static Setting, parameters: &mut Parameters) -> bool {
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
