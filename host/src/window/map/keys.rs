//! The keys of the map.

use super::camera::{Camera, Projection};
use super::ruler::Ruler;
use super::scene::Scene;
use super::view::View;
use eframe::egui::{self, Key, Modifiers, Ui};

/// Keys and mouse, and what they do: for the help.
pub const KEYS: &[(&str, &str)] = &[
    ("Left button", "move the map"),
    ("Right button", "turn it; with Ctrl only sideways, with Shift only up and down"),
    ("Wheel, pinch", "zoom"),
    ("Click", "set where the person starts; on a cluster, show its rank and probability"),
    ("Double click, F", "show all of the building"),
    ("A", "show or hide the first floor of the map"),
    ("S", "show or hide the second floor of the map"),
    ("P", "show or hide the particles"),
    ("Y", "show or hide the estimated path"),
    ("X", "show or hide the path without the map"),
    ("C", "show or hide the corrected past"),
    ("T", "show or hide the true path"),
    ("L", "show or hide names"),
    ("V", "switch between perspective and flat map"),
    ("G", "go with the person"),
    ("N", "turn north up"),
    ("Page up, page down", "look at the floor above, below"),
    ("+, -", "zoom"),
    ("M", "measure distances; Escape ends it"),
];

/// Whether keys are meant for the map: the pointer is on it, and nobody writes text.
fn is_listening(ui: &Ui, response: &egui::Response) -> bool {
    (response.hovered() || response.has_focus()) && !ui.ctx().egui_wants_keyboard_input()
}

fn pressed(ui: &Ui, key: Key) -> bool {
    ui.input_mut(|input| input.consume_key(Modifiers::NONE, key))
}

/// Whether somebody wants to see all.
pub fn wants_fit(ui: &Ui, response: &egui::Response) -> bool {
    is_listening(ui, response) && pressed(ui, Key::F)
}

/// Does what the keys say.
pub fn act(ui: &Ui, response: &egui::Response, view: &mut View, scene: &Scene, ruler: &mut Ruler) {
    if !is_listening(ui, response) {
        return;
    }
    for (index, key) in [Key::A, Key::S].into_iter().enumerate() {
        if pressed(ui, key) {
            toggle_floor(view, scene, index);
        }
    }
    let layers = &mut view.layers;
    let switches = [
        (Key::P, &mut layers.particles),
        (Key::Y, &mut layers.estimate),
        (Key::X, &mut layers.free),
        (Key::C, &mut layers.corrected),
        (Key::T, &mut layers.truth),
        (Key::L, &mut layers.names),
        (Key::G, &mut view.follow),
    ];
    for (key, switch) in switches {
        *switch ^= pressed(ui, key);
    }
    if pressed(ui, Key::V) {
        switch_projection(view);
    }
    if pressed(ui, Key::M) {
        ruler.switch();
    }
    if ruler.is_on() && pressed(ui, Key::Escape) {
        ruler.switch();
    }
    for (key, up) in [(Key::PageUp, true), (Key::PageDown, false)] {
        if pressed(ui, key) {
            view.level = next_level(view.level, scene, up);
            view.follow = false;
        }
    }
    if let Some(camera) = &mut view.camera {
        if pressed(ui, Key::N) {
            camera.bearing = 0.0;
        }
        for (key, factor) in [(Key::Plus, 0.8), (Key::Equals, 0.8), (Key::Minus, 1.25)] {
            if pressed(ui, key) {
                *camera = Camera { distance_m: camera.distance_m * factor, ..*camera }.bounded();
            }
        }
    }
}

/// Shows or hides a floor, counted from the lowest.
pub fn toggle_floor(view: &mut View, scene: &Scene, index: usize) {
    if let Some(storey) = scene.storeys().get(index)
        && !view.hidden.remove(&storey.number)
    {
        view.hidden.insert(storey.number);
    }
}

/// From perspective to flat and back.
pub fn switch_projection(view: &mut View) {
    view.projection = match view.projection {
        Projection::Orbit => Projection::Flat,
        Projection::Flat => Projection::Orbit,
    };
}

/// The floor above or below; above the highest are all.
fn next_level(level: Option<i32>, scene: &Scene, up: bool) -> Option<i32> {
    let storeys = scene.storeys();
    let index = level.and_then(|number| scene.storey(number)).map_or(storeys.len(), |(index, _)| index);
    let next = if up { index + 1 } else { index.saturating_sub(1) };
    storeys.get(next).map(|storey| storey.number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::window::map::scene::tests::house;

    #[test]
    fn one_goes_through_the_floors_and_all_of_them() {
        let scene = Scene::of(&house());
        assert_eq!(next_level(None, &scene, false), Some(1));
        assert_eq!(next_level(Some(1), &scene, false), Some(0));
        assert_eq!(next_level(Some(0), &scene, false), Some(0));
        assert_eq!(next_level(Some(1), &scene, true), None);
        assert_eq!(next_level(None, &scene, true), None);
    }

    #[test]
    fn a_floor_is_hidden_and_shown_again() {
        let scene = Scene::of(&house());
        let mut view = View::default();
        toggle_floor(&mut view, &scene, 1);
        assert!(view.hidden.contains(&1));
        toggle_floor(&mut view, &scene, 1);
        toggle_floor(&mut view, &scene, 9);
        assert_eq!(view, View::default());
    }
}
