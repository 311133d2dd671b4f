//! The mouse and the fingers: they move the map and point at places.

use super::camera::{Camera, Projection, Sight};
use super::scene::Place;
use super::widget::Scenery;
use eframe::egui::{self, Modifiers, PointerButton, Pos2, Ui, Vec2};

/// A turn of the wheel by this many points makes everything e times as large.
const WHEEL_POINTS: f64 = 240.0;

/// The camera after what the mouse and the fingers did, if they did something.
///
/// The left button moves, the right one turns: with Ctrl only about the vertical, with Shift only up and down. The wheel
/// and two fingers zoom, two fingers turn. An `anchored` map is zoomed about its middle.
pub fn steer(ui: &Ui, response: &egui::Response, sight: &Sight, anchored: bool) -> Option<Camera> {
    let mut sight = *sight;
    let mut moved = false;
    let mut set = |sight: &mut Sight, camera: Camera| {
        *sight = Sight::new(camera.bounded(), sight.projection(), sight.rect());
        moved = true;
    };
    let modifiers = ui.input(|input| input.modifiers);
    let drag = response.drag_delta();
    if drag != Vec2::ZERO {
        let turns = response.dragged_by(PointerButton::Secondary)
            || (response.dragged_by(PointerButton::Primary) && modifiers.shift);
        if turns {
            let mut camera = *sight.camera();
            camera.turn(turning(drag, modifiers, response.dragged_by(PointerButton::Primary)));
            if sight.projection() == Projection::Flat {
                camera.elevation = sight.camera().elevation;
            }
            set(&mut sight, camera);
        } else if let Some(pointer) = response.interact_pointer_pos() {
            let camera = sight.dragged(pointer - drag, pointer);
            set(&mut sight, camera);
        }
    }
    if let Some(pointer) = response.hover_pos() {
        let (wheel, pinch, touch) =
            ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta(), input.multi_touch()));
        let factor = f64::from(pinch) * (f64::from(wheel) / WHEEL_POINTS).exp();
        if factor != 1.0 {
            let zoomed = sight.zoomed(pointer, factor);
            let target = if anchored { sight.camera().target } else { zoomed.target };
            let camera = Camera { target, ..zoomed };
            set(&mut sight, camera);
        }
        if let Some(turn) = touch.map(|touch| touch.rotation_delta).filter(|turn| *turn != 0.0) {
            let camera = Camera { bearing: sight.camera().bearing - f64::from(turn), ..*sight.camera() };
            set(&mut sight, camera);
        }
    }
    moved.then_some(*sight.camera())
}

/// The part of a drag that turns.
fn turning(drag: Vec2, modifiers: Modifiers, primary: bool) -> Vec2 {
    match (modifiers.command || modifiers.ctrl, modifiers.shift && !primary) {
        (true, false) => Vec2::new(drag.x, 0.0),
        (false, true) => Vec2::new(0.0, drag.y),
        _ => drag,
    }
}

/// The place under a point of the window: on the highest floor that is drawn whole there, else beside the lowest.
pub fn place(scenery: &Scenery<'_>, at: Pos2) -> Option<Place> {
    let ray = scenery.sight.ray(at);
    let storeys = scenery.scene.storeys();
    let whole = || (0..storeys.len()).filter(|&index| scenery.is_whole(index));
    let hit = |index: usize| {
        let [_, _, height] = scenery.scene.shown([0.0, 0.0, storeys[index].height_m], scenery.spread);
        ray.at_height(height).map(|point| (index, point))
    };
    let on = whole().rev().filter_map(hit).find(|(index, point)| storeys[*index].holds(*point));
    let (index, point) = on.or_else(|| whole().next().and_then(hit))?;
    scenery.scene.place(index, point)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ctrl_turns_about_the_vertical_and_shift_up_and_down() {
        let drag = Vec2::new(3.0, 4.0);
        assert_eq!(turning(drag, Modifiers::CTRL, false), Vec2::new(3.0, 0.0));
        assert_eq!(turning(drag, Modifiers::SHIFT, false), Vec2::new(0.0, 4.0));
        assert_eq!(turning(drag, Modifiers::SHIFT, true), drag);
        assert_eq!(turning(drag, Modifiers::CTRL | Modifiers::SHIFT, false), drag);
    }
}
