//! The map as a part of a window.

use super::camera::{Camera, Projection, Sight};
use super::glide::Glide;
use super::overlay::{Overlay, Person};
use super::painter::{Look, Opacity, Painter};
use super::palette::Palette;
use super::ruler::Ruler;
use super::scene::{Place, Scene};
use super::view::{SPREAD, View};
use super::{controls, gauges, keys, lettering, pins, pointer};
use crate::building::Point;
use crate::window::gpu::{Care, RenderState};
use eframe::egui::{self, Rect, Sense, Ui, WidgetInfo, WidgetType, pos2};
use std::sync::Arc;

/// Of walls in perspective: cut, so that one sees into rooms. **Units:** m.
const WALL_HEIGHT_M: f32 = 1.1;
/// Of walls of a flat map: their tops lie just above everything else. **Units:** m.
const FLAT_WALL_M: f32 = 0.05;
/// Of a floor above the one that is looked at.
const HINTED: Opacity = Opacity { ground: 0.05, walls: 0.09, marks: 0.3 };
const WHOLE: Opacity = Opacity { ground: 1.0, walls: 1.0, marks: 1.0 };
/// Before it is known where somebody is, the floor of a place that is likelier than this is looked at.
const LIKELY: f64 = 0.8;

/// What was pointed at.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Response {
    /// A place that was clicked.
    pub clicked: Option<Place>,
    /// A cluster that was clicked: its index in [`Overlay::clusters`].
    pub picked: Option<usize>,
    /// A person that was clicked: its index in [`Overlay::people`].
    pub selected: Option<usize>,
    /// The place under the pointer.
    pub hovered: Option<Place>,
}

/// A map in a window, with what it has sent to the graphics card.
#[derive(Debug)]
pub struct Map {
    painter: Painter,
    /// How the camera moves, while it does.
    glide: Option<Glide>,
    /// Bounds of what was shown last.
    shown: Option<[Point; 2]>,
    /// What is measured.
    ruler: Ruler,
    /// The cluster whose details are shown, and where it was when it was clicked.
    picked: Option<usize>,
}

/// What a part of the map needs to know to draw itself.
#[derive(Clone, Copy)]
pub(super) struct Scenery<'a> {
    pub scene: &'a Scene,
    pub overlay: &'a Overlay,
    pub view: &'a View,
    pub sight: &'a Sight,
    pub palette: &'a Palette,
    pub opacities: &'a [Opacity],
    pub spread: f64,
}

impl Scenery<'_> {
    /// Where a place of the building is in the window.
    pub fn at(&self, place: [f64; 3]) -> Option<egui::Pos2> {
        self.sight.project(self.scene.shown(place, self.spread))
    }

    /// Whether a floor is drawn whole, rather than hinted at or not at all.
    pub fn is_whole(&self, storey: usize) -> bool {
        self.opacities.get(storey).is_some_and(|opacity| *opacity == WHOLE)
    }

    /// Whether anything of a floor is drawn.
    pub fn is_drawn(&self, storey: usize) -> bool {
        self.opacities.get(storey).is_some_and(|opacity| opacity.marks > 0.0)
    }
}

impl Map {
    /// A map that draws with this, as well as it can.
    pub fn new(render: &RenderState) -> Self {
        Self::with(render, Care::BEST)
    }

    /// A map that moves with ease, also where there is no graphics card.
    pub fn quick(render: &RenderState) -> Self {
        Self::with(render, Care::quick(render))
    }

    fn with(render: &RenderState, care: Care) -> Self {
        Self { painter: Painter::new(render, care), glide: None, shown: None, ruler: Ruler::default(), picked: None }
    }

    /// What it draws with.
    pub fn render(&self) -> &RenderState {
        self.painter.render()
    }

    /// How much is spent on pictures.
    pub fn care(&self) -> Care {
        self.painter.care()
    }

    /// Shows all of the building, or all of the walk where there is none.
    pub fn fit(&self, view: &View, scene: &Scene, overlay: &Overlay, rect: Rect) -> Camera {
        let spread = spread(view);
        let level = level(view, scene, overlay);
        let mut points: Vec<[f64; 3]> = Vec::new();
        for storey in scene.storeys() {
            let left_out = match view.projection {
                Projection::Flat => Some(storey.number) != level,
                Projection::Orbit => view.hidden.contains(&storey.number),
            };
            if !left_out {
                points.extend(storey.hull.iter().map(|[x, y]| scene.shown([*x, *y, storey.height_m], spread)));
            }
        }
        if points.is_empty() {
            let tracks = overlay.tracks.iter().flat_map(|track| track.pieces.iter().flatten());
            points.extend(tracks.copied().chain(overlay.people.iter().map(|person| person.position)));
        }
        if points.is_empty() {
            let [low, high] = scene.bounds();
            points = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]]
                .map(|[x, y]| [x, y, scene.datum()])
                .to_vec();
        }
        // A flat map has north up until somebody turns it.
        let bearing = if view.projection == Projection::Flat { 0.0 } else { Camera::default().bearing };
        let camera = view.camera.unwrap_or(Camera { bearing, ..Camera::default() });
        Sight::new(camera.bounded(), view.projection, rect).fitted(&points)
    }

    /// Draws the map into all the room that there is, and does what the mouse and the keys say.
    pub fn show(&mut self, ui: &mut Ui, view: &mut View, scene: &Arc<Scene>, overlay: &Overlay) -> Response {
        let pixels_per_point = ui.ctx().pixels_per_point();
        let snap = |value: f32| (value * pixels_per_point).round() / pixels_per_point;
        let (room, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        let rect =
            Rect::from_min_max(pos2(snap(room.min.x), snap(room.min.y)), pos2(snap(room.max.x), snap(room.max.y)));
        let name = scene.name();
        response.widget_info(|| WidgetInfo::labeled(WidgetType::Other, true, format!("Map of {name}")));
        if rect.width() < 8.0 || rect.height() < 8.0 {
            return Response::default();
        }
        // Where somebody looked in one building says nothing of another.
        let bounds = scene.bounds();
        if self.shown.replace(bounds).is_some_and(|before| before != bounds) {
            (view.camera, self.glide) = (None, None);
        }
        let camera = match view.camera {
            Some(camera) => camera.bounded(),
            None => self.fit(view, scene, overlay, rect),
        };
        view.camera = Some(camera);
        keys::act(ui, &response, view, scene, &mut self.ruler);
        if keys::wants_fit(ui, &response) || response.double_clicked() {
            self.send(view, self.fit(view, scene, overlay, rect));
            view.follow = false;
        }
        self.steer(ui, &response, view, rect);
        self.follow(view, scene, overlay);
        self.glide(ui, view);

        let spread = spread(view);
        let level = level(view, scene, overlay);
        let opacities = opacities(view, scene, level);
        let sight = Sight::new(view.camera.unwrap_or_default(), view.projection, rect);
        let palette = Palette::of(ui.visuals().dark_mode);
        let flat = view.projection == Projection::Flat;
        let look = Look {
            sight: &sight,
            pixels_per_point,
            palette,
            spread,
            wall_height_m: if flat { FLAT_WALL_M } else { WALL_HEIGHT_M },
            opacities: &opacities,
            layers: view.layers,
        };
        let painter = ui.painter_at(rect);
        self.painter.paint(scene, overlay, &look).show(&painter, rect);

        let scenery = Scenery { scene, overlay, view, sight: &sight, palette, opacities: &opacities, spread };
        let mut letters = lettering::Letters::new(&painter, palette, rect, self.care().fine);
        let pinned = pins::draw(&painter, &mut letters, &scenery, self.picked);
        let told = self.point(&response, &scenery, &pinned);
        self.ruler.draw(&painter, &mut letters, &scenery, told.hovered.as_ref());
        if view.layers.names {
            lettering::names(&mut letters, &scenery);
        }
        gauges::draw(&painter, &scenery, told.hovered.as_ref());
        if controls::show(ui, rect, view, scene, level, &mut self.ruler) {
            self.send(view, self.fit(view, scene, overlay, rect));
        }
        told
    }

    /// Moves the camera by mouse and touch.
    fn steer(&mut self, ui: &Ui, response: &egui::Response, view: &mut View, rect: Rect) {
        let camera = view.camera.unwrap_or_default();
        let sight = Sight::new(camera, view.projection, rect);
        if let Some(steered) = pointer::steer(ui, response, &sight, view.follow) {
            view.camera = Some(steered.bounded());
            self.glide = None;
            // Whoever moves the map away from the person does not want it back at the next step.
            view.follow &= steered.target == camera.target;
        }
    }

    /// Goes with the selected person.
    fn follow(&mut self, view: &mut View, scene: &Scene, overlay: &Overlay) {
        let (true, Some(person)) = (view.follow, followed(overlay)) else { return };
        if view.level != Some(person.floor) && scene.storey(person.floor).is_some() {
            view.level = Some(person.floor);
        }
        let camera = view.camera.unwrap_or_default();
        let target = scene.shown(person.position, spread(view));
        let goal = self.glide.as_ref().map_or(camera, Glide::goal);
        let wanted = Camera { target, ..goal }.bounded();
        if !wanted.is_at(&goal) {
            self.send(view, wanted);
        }
    }

    /// Sends the camera somewhere, from where it is.
    fn send(&mut self, view: &View, to: Camera) {
        self.glide = Some(Glide::new(view.camera.unwrap_or_default(), to));
    }

    /// Brings the camera nearer to where it is going.
    fn glide(&mut self, ui: &Ui, view: &mut View) {
        let Some(glide) = &mut self.glide else { return };
        let passed = f64::from(ui.input(|input| input.stable_dt)).min(0.1);
        view.camera = Some(glide.go(passed));
        if glide.is_over() {
            self.glide = None;
        } else {
            ui.ctx().request_repaint();
        }
    }

    /// What is under the pointer, and what was clicked.
    fn point(&mut self, response: &egui::Response, scenery: &Scenery<'_>, pinned: &pins::Pinned) -> Response {
        let mut told = Response::default();
        let Some(pointer) = response.hover_pos() else { return told };
        told.hovered = pointer::place(scenery, pointer);
        if response.clicked() {
            if self.ruler.is_on() {
                self.ruler.add(told.hovered.as_ref());
            } else if let Some(person) = pinned.person_at(pointer) {
                told.selected = Some(person);
            } else if let Some(cluster) = pinned.cluster_at(pointer) {
                told.picked = Some(cluster);
                self.picked = if self.picked == Some(cluster) { None } else { Some(cluster) };
            } else {
                told.clicked.clone_from(&told.hovered);
                self.picked = None;
            }
        }
        told
    }
}

/// How far apart floors are shown: a flat map has only one.
fn spread(view: &View) -> f64 {
    let spread = if view.spread.is_finite() { view.spread.clamp(SPREAD.0, SPREAD.1) } else { SPREAD.0 };
    if view.projection == Projection::Flat { 1.0 } else { spread }
}

/// The person that is followed.
pub(super) fn followed(overlay: &Overlay) -> Option<&Person> {
    overlay.people.iter().find(|person| person.selected).or(overlay.people.first())
}

/// The floor that is looked at: a flat map always has one.
fn level(view: &View, scene: &Scene, overlay: &Overlay) -> Option<i32> {
    let there = |number: &i32| scene.storey(*number).is_some();
    let asked = view.level.filter(there);
    let likeliest =
        overlay.clusters.first().filter(|cluster| cluster.probability > LIKELY).map(|cluster| cluster.floor);
    let person = followed(overlay).map(|person| person.floor).or(likeliest).filter(there);
    if view.projection == Projection::Orbit {
        return asked.or(person.filter(|_| view.auto));
    }
    let ground = Some(0).filter(there).or(scene.storeys().first().map(|storey| storey.number));
    asked.or(person).or(ground)
}

/// How each floor is drawn.
fn opacities(view: &View, scene: &Scene, level: Option<i32>) -> Vec<Opacity> {
    let highest = level.and_then(|number| scene.storey(number)).map_or(usize::MAX, |(index, _)| index);
    let storeys = scene.storeys().iter().enumerate();
    storeys
        .map(|(index, storey)| match view.projection {
            Projection::Flat if index == highest => WHOLE,
            Projection::Flat => Opacity::default(),
            Projection::Orbit if view.hidden.contains(&storey.number) => Opacity::default(),
            Projection::Orbit if index > highest => HINTED,
            Projection::Orbit => WHOLE,
        })
        .collect()
}
