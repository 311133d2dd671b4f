//! What is open: one shoe or recording, or several, of which one is selected and has its details shown.

use super::engine::{Command, Engine, Kind, Make, Snapshot};
use super::gpu::Frame;
use super::latencies::Latencies;
use super::map::palette::colour;
use super::map::{Overlay, Rgb, Role, Scene};
use super::status::Latency;
use crate::particle::State;
use eframe::egui::{self, Context, RichText, Ui};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Colours of shoes, where there are several: told apart also by who sees fewer colours (Okabe and Ito 2008).
const COLOURS: [Rgb; 7] = [
    [0xd5, 0x5e, 0x00],
    [0x00, 0x72, 0xb2],
    [0x00, 0x9e, 0x73],
    [0xcc, 0x79, 0xa7],
    [0xe6, 0x9f, 0x00],
    [0x56, 0xb4, 0xe9],
    [0x80, 0x80, 0x80],
];

/// A shoe that has gone is not waited for longer than its own answers take.
pub const PATIENCE: Duration = Duration::from_secs(25);

/// Who asks for a frame without any delay gets two, and the next step waits until the second is drawn too.
const AT_ONCE: Duration = Duration::from_nanos(1);

/// One of them.
struct Shoe {
    engine: Engine,
    snapshot: Arc<Snapshot>,
    latencies: Latencies,
    colour: Rgb,
}

/// All that is open.
#[derive(Default)]
pub struct Shoes {
    open: Vec<Shoe>,
    selected: usize,
    /// What was closed and has not ended yet.
    leaving: Vec<JoinHandle<()>>,
    nothing: Arc<Snapshot>,
    /// What was drawn of several, and of which snapshots.
    drawn: Option<(Vec<Arc<Snapshot>>, usize, Overlay)>,
}

/// What is asked of the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asked {
    Select(usize),
    Close(usize),
}

impl Shoes {
    /// Opens one more, or one in the place of the selected one, and selects it.
    pub fn open(&mut self, name: String, make: Make, context: &Context, beside: bool) {
        if !beside && !self.open.is_empty() {
            self.close(self.selected);
        }
        let taken: Vec<Rgb> = self.open.iter().map(|shoe| shoe.colour).collect();
        let colour = COLOURS.into_iter().find(|colour| !taken.contains(colour));
        let context = context.clone();
        self.open.push(Shoe {
            engine: Engine::start(name, make, move || context.request_repaint_after(AT_ONCE)),
            snapshot: Arc::default(),
            latencies: Latencies::default(),
            colour: colour.unwrap_or(COLOURS[self.open.len() % COLOURS.len()]),
        });
        self.selected = self.open.len() - 1;
    }

    fn close(&mut self, index: usize) {
        if index < self.open.len() {
            self.leaving.retain(|thread| !thread.is_finished());
            self.leaving.push(self.open.remove(index).engine.leave());
            // Who was selected stays so, and moves up if one above is gone.
            let selected = if index < self.selected { self.selected - 1 } else { self.selected };
            self.select(selected);
        }
    }

    /// Looks for what is new, for a frame that begins. Whether somebody opened something for so long and no longer.
    pub fn look(&mut self, frame: Instant) -> bool {
        for shoe in &mut self.open {
            if let Some(snapshot) = shoe.engine.take() {
                shoe.latencies.arrived(snapshot.stepped);
                shoe.snapshot = snapshot;
            }
            shoe.latencies.begun(frame);
        }
        self.open.iter().any(|shoe| shoe.snapshot.ended)
    }

    /// A frame is drawn.
    pub fn drawn(&mut self, frame: Frame) {
        for shoe in &mut self.open {
            shoe.latencies.drawn(frame);
            shoe.engine.drawn_in(frame.drawn.saturating_duration_since(frame.begun));
        }
    }

    /// How many are open.
    pub fn count(&self) -> usize {
        self.open.len()
    }

    /// The latest of the selected one.
    pub fn snapshot(&self) -> &Arc<Snapshot> {
        self.open.get(self.selected).map_or(&self.nothing, |shoe| &shoe.snapshot)
    }

    /// From steps to pictures, of the selected one.
    pub fn latency(&self) -> Option<Latency> {
        self.open.get(self.selected)?.latencies.told()
    }

    /// The latest of one of them.
    pub fn get(&self, index: usize) -> Option<&Arc<Snapshot>> {
        self.open.get(index).map(|shoe| &shoe.snapshot)
    }

    /// Selects one of them.
    pub fn select(&mut self, index: usize) {
        self.selected = index.min(self.open.len().saturating_sub(1));
    }

    /// Asks the selected one for something.
    pub fn ask(&self, command: Command) {
        self.ask_one(self.selected, command);
    }

    /// Asks one of them for something.
    pub fn ask_one(&self, index: usize, command: Command) {
        if let Some(shoe) = self.open.get(index) {
            shoe.engine.ask(command);
        }
    }

    /// Selects the one whose person this is in what was drawn.
    pub fn select_person(&mut self, person: usize) {
        let owners = |(index, shoe): (usize, &Shoe)| std::iter::repeat_n(index, shoe.snapshot.overlay.people.len());
        let owner = self.neighbours().flat_map(owners).nth(person);
        self.selected = owner.unwrap_or(self.selected);
    }

    /// Those that are in the same building as the selected one, itself among them.
    fn neighbours(&self) -> impl Iterator<Item = (usize, &Shoe)> {
        let place = |snapshot: &Snapshot| snapshot.scene.as_deref().map(|scene| scene.name().to_owned());
        let here = place(self.snapshot());
        let there = self.open.iter().enumerate();
        there.filter(move |(index, shoe)| *index == self.selected || (here.is_some() && place(&shoe.snapshot) == here))
    }

    /// The building of the selected one, and what is drawn on it: where there are several, each has its colour.
    pub fn drawing(&mut self) -> (Option<Arc<Scene>>, Overlay) {
        let selected = self.snapshot().clone();
        let scene = selected.scene.clone();
        if self.open.len() < 2 {
            return (scene, selected.overlay.clone());
        }
        let snapshots: Vec<_> = self.open.iter().map(|shoe| shoe.snapshot.clone()).collect();
        if let Some((of, chosen, overlay)) = &self.drawn
            && *chosen == self.selected
            && of.len() == snapshots.len()
            && of.iter().zip(&snapshots).all(|(one, other)| Arc::ptr_eq(one, other))
        {
            return (scene, overlay.clone());
        }
        let Overlay { clusters, feet, .. } = &selected.overlay;
        let mut all = Overlay { clusters: clusters.clone(), feet: feet.clone(), ..Overlay::default() };
        for (index, shoe) in self.neighbours() {
            let (chosen, colour) = (index == self.selected, Some(shoe.colour));
            let Overlay { clouds, tracks, people, .. } = &shoe.snapshot.overlay;
            all.clouds.extend(clouds.iter().cloned().map(|mut cloud| {
                cloud.colour = colour;
                cloud
            }));
            all.tracks.extend(tracks.iter().filter(|track| chosen || track.role == Role::Estimate).cloned().map(
                |mut track| {
                    if track.role == Role::Estimate {
                        track.colour = colour;
                    }
                    track
                },
            ));
            all.people.extend(people.iter().cloned().map(|mut person| {
                person.name.clone_from(&shoe.snapshot.name);
                person.colour = colour;
                person.selected = chosen;
                person
            }));
        }
        self.drawn = Some((snapshots, self.selected, all.clone()));
        (scene, all)
    }

    /// The list of them: colour, name, and what is known of each.
    pub fn list(&mut self, ui: &mut Ui) {
        let mut asked = None;
        for (index, shoe) in self.open.iter().enumerate() {
            let snapshot = &shoe.snapshot;
            ui.horizontal(|ui| {
                let (rect, _) = ui.allocate_exact_size(egui::vec2(10.0, 10.0), egui::Sense::hover());
                ui.painter().circle_filled(rect.center(), 5.0, colour(shoe.colour));
                // Both may be cut, or be a mere mark: the whole name is told to who cannot see it.
                let named = |response: egui::Response, told: String| {
                    response.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::Button, true, &told));
                    response.on_hover_text(told)
                };
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    if named(ui.small_button("✖"), format!("Close {}", snapshot.name)).clicked() {
                        asked = Some(Asked::Close(index));
                    }
                    ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                        let name = egui::Button::selectable(index == self.selected, &snapshot.name).truncate();
                        if named(ui.add(name), snapshot.name.clone()).clicked() {
                            asked = Some(Asked::Select(index));
                        }
                    });
                });
            });
            ui.add(egui::Label::new(RichText::new(known(snapshot)).small().weak()).truncate());
        }
        match asked {
            Some(Asked::Select(index)) => self.selected = index,
            Some(Asked::Close(index)) => self.close(index),
            None => {}
        }
    }

    /// Ends all of them and waits until they have ended, so that recordings are whole; not for ever.
    pub fn finish(&mut self) {
        while !self.open.is_empty() {
            self.close(0);
        }
        let begun = Instant::now();
        while self.leaving.iter().any(|thread| !thread.is_finished()) && begun.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

/// What is known of one, in a line.
fn known(snapshot: &Snapshot) -> String {
    if let Some(fault) = snapshot.fault.as_ref().filter(|_| snapshot.kind == Kind::Nothing) {
        return fault.clone();
    }
    let silent = snapshot.link.as_ref().filter(|link| !link.heard).map(|link| link.state.clone());
    let place = snapshot.whereabouts.as_ref().map(|whereabouts| {
        let located = whereabouts.state == State::Located;
        let names = [&whereabouts.room, &whereabouts.floor].into_iter().flatten().filter(|_| located);
        std::iter::once(whereabouts.state.word()).chain(names.map(String::as_str)).collect::<Vec<_>>().join(", ")
    });
    let way = || format!("{} steps, {:.0} m", snapshot.steps, snapshot.distance);
    silent.or(place).unwrap_or_else(way)
}
