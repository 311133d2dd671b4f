//! What is asked before something is opened.

use super::engine::{Opening, Plan, What};
use crate::follow;
use crate::link::Address;
use eframe::egui::{self, RichText, TextEdit, Ui};
use std::path::{Path, PathBuf};

/// What is to be shown, in words.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// A recording, or the address of a shoe.
    pub what: String,
    /// A building, or nothing.
    pub building: String,
    /// Where the walk begins, or nothing.
    pub start: String,
    /// Beside what is open, not in its place.
    pub beside: bool,
}

impl Wanted {
    /// What is to be opened, with the settings of what was opened `before`.
    pub fn opening(&self, before: Option<&Opening>) -> Opening {
        let text = |text: &str| Some(text.trim().to_owned()).filter(|text| !text.is_empty());
        let what = match self.what.trim().parse() {
            Ok(address) => What::Shoe(address),
            Err(_) => What::Recording(self.what.trim().into()),
        };
        let mut opening = Opening::of(what);
        if let Some(before) = before {
            opening.settings = before.settings.clone();
        }
        // One that was read, and has no file, keeps its name in the field until another is wanted.
        let same = before.and_then(|before| before.building.clone()).filter(|plan| plan.to_string() == self.building);
        opening.building = same.or_else(|| text(&self.building).map(|path| Plan::File(path.into())));
        opening.settings.follow.start = text(&self.start).unwrap_or(follow::Settings::default().start);
        opening
    }
}

/// Which question is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Question {
    Recording,
    Shoe,
}

/// The dialog.
#[derive(Debug, Default)]
pub struct Dialog {
    question: Option<Question>,
    wanted: Wanted,
    /// Folder whose files are listed, and they.
    folder: PathBuf,
    files: Vec<PathBuf>,
    ports: Vec<String>,
    /// How many are open.
    open: usize,
}

/// Files that may be recordings.
const RECORDINGS: [&str; 6] = ["mcap", "csv", "txt", "mat", "tsv", "dat"];

impl Dialog {
    /// Asks for a recording.
    ///
    /// `open` is how many are open.
    pub fn ask_recording(&mut self, open: usize) {
        self.open = open;
        self.question = Some(Question::Recording);
        // What was named may be a shoe.
        if self.wanted.what.trim().parse::<Address>().is_ok() {
            self.wanted.what.clear();
        }
        let folder = PathBuf::from(self.wanted.what.trim());
        let folder =
            folder.parent().filter(|folder| folder.is_dir()).map_or_else(|| PathBuf::from("."), Path::to_owned);
        self.list(folder);
    }

    /// Asks for a shoe.
    ///
    /// `open` is how many are open.
    pub fn ask_shoe(&mut self, open: usize) {
        self.open = open;
        self.question = Some(Question::Shoe);
        if self.wanted.what.trim().parse::<Address>().is_err() {
            self.wanted.what.clear();
        }
        let ports = serialport::available_ports().unwrap_or_default();
        self.ports = ports.into_iter().map(|port| format!("serial:{}", port.port_name)).collect();
        self.ports.extend(["ble:any", "tcp:127.0.0.1:7700"].map(String::from));
    }

    /// Sets what is asked for first.
    pub fn suggest(&mut self, wanted: Wanted) {
        self.wanted = wanted;
    }

    fn list(&mut self, folder: PathBuf) {
        let entries = std::fs::read_dir(&folder).into_iter().flatten();
        let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
        files.retain(|path| {
            let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
            let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
            !hidden && (path.is_dir() || RECORDINGS.contains(&extension.as_str()))
        });
        files.sort_by_key(|path| (!path.is_dir(), path.clone()));
        (self.folder, self.files) = (folder, files);
    }

    /// Shows the dialog, if one is open, and what was answered.
    pub fn show(&mut self, ui: &Ui) -> Option<Wanted> {
        let question = self.question?;
        let mut answered = false;
        let modal = egui::Modal::new("dialog".into()).show(ui.ctx(), |ui| {
            ui.set_width(520.0);
            ui.heading(match question {
                Question::Recording => "Open a recording",
                Question::Shoe => "Connect to a shoe",
            });
            match question {
                Question::Recording => self.recordings(ui),
                Question::Shoe => self.shoes(ui),
            }
            let building = "none: the steps alone";
            field(ui, "Building", &mut self.wanted.building, building);
            field(ui, "Start", &mut self.wanted.start, "anywhere; entrances, a room, or FLOOR,X,Y[,HEADING_DEG]");
            if self.open > 0 {
                let told = "Shows it with its own colour, not in the place of the selected one";
                ui.checkbox(&mut self.wanted.beside, "Beside what is open").on_hover_text(told);
            }
            let address = self.wanted.what.trim().parse::<Address>();
            let fault = match question {
                Question::Recording if self.wanted.what.trim().is_empty() => Some("no file is named".to_owned()),
                Question::Recording => None,
                Question::Shoe => address.err().map(|error| error.to_string()),
            };
            ui.add_space(6.0);
            ui.horizontal(|ui| {
                let word = if question == Question::Recording { "Play" } else { "Connect" };
                answered = ui.add_enabled(fault.is_none(), egui::Button::new(word)).clicked();
                if ui.button("Cancel").clicked() {
                    self.question = None;
                }
            });
            if let Some(fault) = fault {
                ui.label(RichText::new(fault).small().weak());
            }
        });
        if answered || modal.should_close() {
            self.question = None;
        }
        answered.then(|| self.wanted.clone())
    }

    fn recordings(&mut self, ui: &mut Ui) {
        field(ui, "Recording", &mut self.wanted.what, "a file");
        let mut go = None;
        ui.horizontal(|ui| {
            if ui.button("Up").on_hover_text("To the folder above").clicked() {
                let folder = self.folder.canonicalize().unwrap_or_default();
                go = folder.parent().map(Path::to_owned);
            }
            ui.label(RichText::new(self.folder.display().to_string()).weak());
        });
        egui::ScrollArea::vertical().max_height(220.0).auto_shrink([false, true]).show(ui, |ui| {
            for path in &self.files {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                let name = if path.is_dir() { format!("{name}/") } else { name.into_owned() };
                let chosen = self.wanted.what == path.display().to_string();
                if ui.selectable_label(chosen, name).clicked() {
                    if path.is_dir() {
                        go = Some(path.clone());
                    } else {
                        self.wanted.what = path.display().to_string();
                    }
                }
            }
            if self.files.is_empty() {
                ui.label("no recordings here");
            }
        });
        if let Some(folder) = go {
            self.list(folder);
        }
    }

    fn shoes(&mut self, ui: &mut Ui) {
        field(ui, "Address", &mut self.wanted.what, "serial:/dev/ttyACM0, tcp:HOST:PORT or ble:any");
        for port in &self.ports {
            if ui.selectable_label(self.wanted.what == *port, port).clicked() {
                self.wanted.what.clone_from(port);
            }
        }
    }
}

fn field(ui: &mut Ui, name: &str, text: &mut String, hint: &str) {
    ui.horizontal(|ui| {
        let label = ui.add_sized([80.0, 18.0], egui::Label::new(name));
        ui.add(TextEdit::singleline(text).hint_text(hint).desired_width(f32::INFINITY)).labelled_by(label.id);
    });
}
