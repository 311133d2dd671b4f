//! Buttons on the map: how it is looked at, which floors, what is drawn.

use super::camera::Projection;
use super::keys;
use super::ruler::Ruler;
use super::scene::Scene;
use super::view::{SPREAD, View};
use eframe::egui::{self, Align, Button, Frame, Layout, Margin, Rect, Response, RichText, Slider, Ui, UiBuilder, vec2};

/// A map that is narrower has only the most important buttons. **Units:** points.
const ROOMY: f32 = 380.0;
/// Height of the bar, and width of the list of floors. **Units:** points.
const BAR: f32 = 28.0;
const LIST: f32 = 88.0;
/// Of a row of the list of floors. **Units:** points.
const ROW: f32 = 22.0;

/// Shows them and does what they say. Tells whether all of the building is to be shown.
pub fn show(ui: &mut Ui, rect: Rect, view: &mut View, scene: &Scene, level: Option<i32>, ruler: &mut Ruler) -> bool {
    let inner = rect.shrink(8.0);
    let mut fit = false;
    let bar = Rect::from_min_size(inner.min, vec2(inner.width(), BAR));
    let mut top = ui.new_child(UiBuilder::new().max_rect(bar).layout(Layout::left_to_right(Align::Min)));
    top.set_clip_rect(rect.intersect(ui.clip_rect()));
    panel(&mut top, |ui| {
        ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
        for (projection, word, told) in [
            (Projection::Orbit, "3D", "All floors in perspective (V)"),
            (Projection::Flat, "2D", "One floor, flat and to scale (V)"),
        ] {
            if ui.selectable_label(view.projection == projection, word).on_hover_text(told).clicked() {
                fit |= view.projection != projection;
                view.projection = projection;
            }
        }
        ui.separator();
        fit |= ui.button("Fit").on_hover_text("Show all of the building (F)").clicked();
        if ui.selectable_label(view.follow, "Follow").on_hover_text("Go with the person (G)").clicked() {
            view.follow = !view.follow;
        }
        if inner.width() > ROOMY {
            if ui.selectable_label(ruler.is_on(), "Measure").on_hover_text("Click to measure distances (M)").clicked() {
                ruler.switch();
            }
            ui.menu_button("Layers", |ui| layers(ui, view));
        }
    });
    if scene.storeys().len() > 1 {
        let list = Rect::from_min_max(inner.right_top() - vec2(LIST.min(inner.width()), 0.0), inner.max);
        let mut right = ui.new_child(UiBuilder::new().max_rect(list).layout(Layout::top_down(Align::Min)));
        right.set_clip_rect(rect.intersect(ui.clip_rect()));
        panel(&mut right, |ui| floors(ui, view, scene, level, inner.height() - 110.0));
    }
    fit
}

fn panel(ui: &mut Ui, add: impl FnOnce(&mut Ui)) {
    let fill = ui.visuals().window_fill().gamma_multiply(0.92);
    let stroke = ui.visuals().widgets.noninteractive.bg_stroke;
    Frame::new().fill(fill).stroke(stroke).corner_radius(6.0).inner_margin(Margin::same(4)).show(ui, add);
}

fn layers(ui: &mut Ui, view: &mut View) {
    let layers = &mut view.layers;
    for (switch, word) in [
        (&mut layers.particles, "Particles (P)"),
        (&mut layers.estimate, "Estimated path (Y)"),
        (&mut layers.free, "Path without the map (X)"),
        (&mut layers.corrected, "Corrected past (C)"),
        (&mut layers.truth, "True path (T)"),
        (&mut layers.others, "Other trackers"),
        (&mut layers.clusters, "Possible places"),
        (&mut layers.names, "Names (L)"),
    ] {
        ui.checkbox(switch, word);
    }
    if view.projection == Projection::Orbit {
        ui.separator();
        let slider = Slider::new(&mut view.spread, SPREAD.0..=SPREAD.1).fixed_decimals(1).suffix(" x");
        ui.add(slider.text("floors apart"));
    }
}

/// The list of floors, the highest on top: a click looks at one, the eye shows or hides it.
fn floors(ui: &mut Ui, view: &mut View, scene: &Scene, level: Option<i32>, height: f32) {
    ui.spacing_mut().item_spacing = vec2(2.0, 2.0);
    ui.with_layout(Layout::top_down(Align::Min), |ui| {
        let rows = scene.storeys().len() as f32 + 2.0;
        let mut list = |ui: &mut Ui| {
            if view.projection == Projection::Orbit {
                for (auto, word, told) in [
                    (true, "Auto", "Look at the floor of the person, as soon as that is known"),
                    (false, "All", "Look at all floors"),
                ] {
                    let chosen = view.level.is_none() && view.auto == auto;
                    if row(ui, chosen, word, true).on_hover_text(told).clicked() {
                        (view.level, view.auto) = (None, auto);
                        view.hidden.clear();
                    }
                }
            }
            for (index, storey) in scene.storeys().iter().enumerate().rev() {
                ui.horizontal(|ui| {
                    let shown = !view.hidden.contains(&storey.number);
                    if view.projection == Projection::Orbit {
                        let eye = if shown { "👁" } else { "–" };
                        let button = Button::new(eye).min_size(vec2(ROW, ROW)).frame(false);
                        let name = format!("{} floor {}", if shown { "Hide" } else { "Show" }, storey.name);
                        let eye = ui.add(button).on_hover_text(&name);
                        eye.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::Button, true, &name));
                        if eye.clicked() {
                            keys::toggle_floor(view, scene, index);
                        }
                    }
                    let told = format!("Look at {} ({:.1} m)", storey.name, storey.height_m);
                    if row(ui, level == Some(storey.number), &storey.name, shown).on_hover_text(told).clicked() {
                        view.level = Some(storey.number);
                        view.hidden.remove(&storey.number);
                        view.follow = false;
                    }
                });
            }
        };
        if rows * (ROW + 4.0) > height {
            egui::ScrollArea::vertical().max_height(height.max(60.0)).show(ui, list);
        } else {
            list(ui);
        }
    });
}

fn row(ui: &mut Ui, selected: bool, name: &str, shown: bool) -> Response {
    let text = RichText::new(name);
    let text = if shown { text } else { text.weak() };
    ui.add(Button::selectable(selected, text).truncate().min_size(vec2(34.0, ROW)))
}
