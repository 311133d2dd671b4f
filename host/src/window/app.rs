//! The window itself: it shows the latest snapshot, and hands on what is asked for. It computes nothing.

use super::dialogs::{Dialog, Wanted};
use super::engine::{Command, Kind, Make, Opening, Snapshot};
use super::gpu::{self, Frames};
use super::help;
use super::layout::{Layout, Look, View};
use super::map::{Map, Overlay, Scene};
use super::parameters::Editor;
use super::shoes::Shoes;
use super::{plots, saving, selector, status, toolbar};
use eframe::egui::{
    self, CentralPanel, Color32, Context, Frame, Panel, ThemePreference, Ui, ViewportCommand, Visuals, WidgetText,
};
use eframe::wgpu::TextureFormat;
use egui_dock::{DockArea, Style, TabViewer};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// All that the window keeps.
pub struct App {
    shoes: Shoes,
    /// Where there is nothing to draw with, the map is missing.
    map: Option<Map>,
    ground: Arc<Scene>,
    layout: Layout,
    file: Option<PathBuf>,
    dialog: Dialog,
    editor: Editor,
    help: bool,
    told: String,
    /// What was opened last.
    opening: Option<Opening>,
    /// Tells when frames have been drawn.
    frames: Option<Frames>,
    /// Something was opened of which nothing has been told yet.
    unseen: bool,
    /// Of the window that is drawn into.
    format: TextureFormat,
}

impl App {
    /// A window that is laid out as its `file` says, with a map if anything can draw one.
    pub fn new(map: Option<Map>, file: Option<PathBuf>) -> Self {
        let (layout, told) = match file.as_deref().map(Layout::read) {
            Some(Ok(layout)) => (layout, String::new()),
            Some(Err(error)) => (Layout::default(), error.to_string()),
            None => (Layout::default(), String::new()),
        };
        Self {
            shoes: Shoes::default(),
            frames: None,
            map,
            ground: Arc::new(Scene::open_ground()),
            layout,
            file,
            dialog: Dialog::default(),
            editor: Editor::default(),
            help: false,
            told,
            opening: None,
            unseen: false,
            format: TextureFormat::Rgba8Unorm,
        }
    }

    /// Measures how long pictures take, and tells how long it is from a step to its picture.
    pub fn measured(self) -> Self {
        Self { frames: self.map.as_ref().map(|map| Frames::new(map.render())), ..self }
    }

    /// Opens something in the place of what is selected, or beside all that is open.
    pub fn open(&mut self, opening: Opening, context: &Context, beside: bool) {
        self.dialog.suggest(Wanted {
            what: opening.what.to_string(),
            building: opening.building.as_ref().map(ToString::to_string).unwrap_or_default(),
            start: opening.settings.follow.start.clone(),
            beside,
        });
        self.opening = Some(opening.clone());
        self.begin(opening.name(), Box::new(move || opening.open()), context, beside);
    }

    /// Shows something of this name that somebody else makes.
    pub fn begin(&mut self, name: String, make: Make, context: &Context, beside: bool) {
        self.shoes.open(name, make, context, beside);
        self.unseen = true;
    }

    /// What is shown of the selected one.
    pub fn snapshot(&self) -> &Snapshot {
        self.shoes.snapshot()
    }

    /// All that is open.
    pub fn shoes(&mut self) -> &mut Shoes {
        &mut self.shoes
    }

    /// Whether there is a graphics card for what is fine.
    fn is_fine(&self) -> bool {
        self.map.as_ref().is_none_or(|map| map.care().fine)
    }

    /// How it is laid out.
    pub fn layout(&mut self) -> &mut Layout {
        &mut self.layout
    }

    /// Asks the engine for something.
    pub fn ask(&self, command: Command) {
        self.shoes.ask(command);
    }

    /// From steps to pictures, so far.
    pub fn latency(&self) -> Option<status::Latency> {
        self.shoes.latency()
    }

    /// Draws the window.
    pub fn show(&mut self, ui: &mut Ui) {
        let begun = Instant::now();
        if let Some(frames) = &self.frames {
            frames.drawn().for_each(|frame| self.shoes.drawn(frame));
            frames.watch(ui, begun);
        }
        if self.shoes.look(begun) {
            ui.ctx().send_viewport_cmd(ViewportCommand::Close);
        }
        ui.ctx().set_theme(match self.layout.look {
            Look::System => ThemePreference::System,
            Look::Light => ThemePreference::Light,
            Look::Dark => ThemePreference::Dark,
        });
        let fine = self.is_fine();
        ui.ctx().tessellation_options_mut(|options| options.feathering = fine);
        let mut commands = Vec::new();
        let snapshot = self.shoes.snapshot().clone();
        if self.unseen && snapshot.signals.span().is_some() {
            self.unseen = false;
            self.layout.show_known(|signal| snapshot.signals.knows(signal));
        }
        // What is behind everything has the colour of panels and views already.
        let bare = Frame::side_top_panel(ui.style()).fill(Color32::TRANSPARENT);
        let asked = Panel::top("toolbar").frame(bare).show(ui, |ui| toolbar::show(ui, &snapshot, &mut commands)).inner;
        Panel::bottom("bar").frame(bare).show(ui, |ui| {
            ui.add_space(2.0);
            toolbar::bar(ui, &snapshot, &self.told, &mut commands);
            ui.add_space(2.0);
        });
        if self.layout.selector {
            Panel::left("views")
                .frame(bare)
                .default_size(160.0)
                .show(ui, |ui| selector::show(ui, &mut self.layout, &mut self.shoes));
        }
        CentralPanel::no_frame().show(ui, |ui| self.views(ui, &snapshot, &mut commands));
        for asked in asked {
            self.obey(ui, asked, &mut commands);
        }
        for asked in help::pressed(ui) {
            self.key(asked, &mut commands);
        }
        help::show(ui, &mut self.help);
        if let Some(wanted) = self.dialog.show(ui) {
            let opening = wanted.opening(self.opening.as_ref());
            self.open(opening, ui.ctx(), wanted.beside);
        }
        if let Some(told) = saving::screenshot(ui.ctx()) {
            self.told = told;
        }
        for command in commands {
            self.ask(command);
        }
    }

    fn views(&mut self, ui: &mut Ui, snapshot: &Snapshot, commands: &mut Vec<Command>) {
        let fine = self.is_fine();
        let Layout { map: map_view, cube, plots, dock, .. } = &mut self.layout;
        let drawing = self.shoes.drawing();
        let mut views = Views {
            fine,
            snapshot,
            drawing: &drawing,
            person: None,
            map: self.map.as_mut(),
            ground: &self.ground,
            map_view,
            cube,
            plots,
            editor: &mut self.editor,
            latency: self.shoes.latency(),
            commands,
        };
        let style = Style::from_egui(ui.style().as_ref());
        DockArea::new(dock).style(style).show_inside(ui, &mut views);
        if let Some(person) = views.person {
            self.shoes.select_person(person);
        }
    }

    fn obey(&mut self, ui: &Ui, asked: toolbar::Asked, commands: &mut Vec<Command>) {
        match asked {
            toolbar::Asked::Open => self.dialog.ask_recording(self.shoes.count()),
            toolbar::Asked::Connect => self.dialog.ask_shoe(self.shoes.count()),
            toolbar::Asked::Picture => saving::ask_screenshot(ui.ctx()),
            toolbar::Asked::Track => commands.push(Command::Export(saving::name("sohle-track", "geojson"))),
            toolbar::Asked::Record => {
                let recording = self.snapshot().link.as_ref().is_some_and(|link| link.recording.is_some());
                commands.push(Command::Record((!recording).then(|| saving::name("sohle-live", "mcap"))));
            }
            toolbar::Asked::Selector => self.layout.selector = !self.layout.selector,
            toolbar::Asked::Look => {
                self.layout.look = if ui.visuals().dark_mode { Look::Light } else { Look::Dark };
            }
            toolbar::Asked::Help => self.help = !self.help,
        }
    }

    fn key(&mut self, asked: help::Asked, commands: &mut Vec<Command>) {
        let [first, last] = self.snapshot().span;
        let command = match asked {
            help::Asked::Help => return self.help = !self.help,
            help::Asked::Open => return self.dialog.ask_recording(self.shoes.count()),
            help::Asked::Connect => return self.dialog.ask_shoe(self.shoes.count()),
            help::Asked::Play => Command::Play(!self.snapshot().pace.playing),
            help::Asked::Ahead => Command::StepAhead,
            help::Asked::Back => Command::StepBack,
            help::Asked::Home => Command::Jump(first),
            help::Asked::End => Command::Jump(last),
        };
        if self.snapshot().kind == Kind::Replay {
            commands.push(command);
        }
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut Ui, frame: &mut eframe::Frame) {
        if let Some(render) = frame.wgpu_render_state() {
            self.format = render.target_format;
        }
        self.show(ui);
    }

    fn clear_color(&self, visuals: &Visuals) -> [f32; 4] {
        gpu::background(visuals, self.format)
    }

    fn on_exit(&mut self) {
        self.shoes.finish();
        if let Some(file) = &self.file
            && let Err(error) = self.layout.write(file)
        {
            eprintln!("the layout of the window is not kept: {error}");
        }
    }
}

/// What the views need.
struct Views<'a> {
    /// Whether there is a graphics card for what is fine.
    fine: bool,
    snapshot: &'a Snapshot,
    drawing: &'a (Option<Arc<Scene>>, Overlay),
    /// Who was clicked on the map.
    person: Option<usize>,
    map: Option<&'a mut Map>,
    ground: &'a Arc<Scene>,
    map_view: &'a mut super::map::View,
    cube: &'a mut super::cube::Cube,
    plots: &'a mut Vec<super::layout::Plot>,
    editor: &'a mut Editor,
    latency: Option<status::Latency>,
    commands: &'a mut Vec<Command>,
}

impl Views<'_> {
    fn map(&mut self, ui: &mut Ui) {
        let Some(map) = &mut self.map else {
            ui.label("There is nothing to draw the map with: no graphics card, and no software in its place.");
            return;
        };
        let (scene, overlay) = self.drawing;
        let told = map.show(ui, self.map_view, scene.as_ref().unwrap_or(self.ground), overlay);
        self.person = told.selected;
        let place = told.clicked.filter(|_| self.snapshot.whereabouts.is_some());
        if let Some(place) = place {
            let [x, y] = place.point;
            self.commands.push(Command::Start(format!("{},{x:.3},{y:.3}", place.floor)));
        }
    }
}

impl TabViewer for Views<'_> {
    type Tab = View;

    fn id(&mut self, view: &mut View) -> egui::Id {
        egui::Id::new(*view)
    }

    fn title(&mut self, view: &mut View) -> WidgetText {
        match view {
            View::Map => "Map".into(),
            View::Attitude => "Attitude".into(),
            View::Status => "Status".into(),
            View::Parameters => "Parameters".into(),
            View::Plot(number) => self.plots.get(*number).map_or("", |plot| &plot.title).into(),
        }
    }

    fn ui(&mut self, ui: &mut Ui, view: &mut View) {
        match view {
            View::Map => self.map(ui),
            View::Attitude => {
                self.cube.show(ui, self.snapshot.attitude);
            }
            View::Status => status::show(ui, self.snapshot, self.latency),
            View::Parameters => self.editor.show(ui, self.snapshot, self.commands),
            View::Plot(number) => {
                if let Some(plot) = self.plots.get_mut(*number) {
                    plots::show(ui, *number, plot, self.snapshot, self.fine, self.commands);
                }
            }
        }
    }

    fn scroll_bars(&self, _: &View) -> [bool; 2] {
        [false, false]
    }

    fn clear_background(&self, _: &View) -> bool {
        // A view has the colour of what is behind it, in the window and in a window of its own.
        false
    }
}
