//! The lists: of what is open, and of the views.

use super::layout::{Layout, Plot, View};
use super::shoes::Shoes;
use eframe::egui::{self, Ui};

/// Shows it. A click opens a view or brings it to the front.
pub fn show(ui: &mut Ui, layout: &mut Layout, shoes: &mut Shoes) {
    ui.add_space(4.0);
    let mut wanted = None;
    let entry = |ui: &mut Ui, layout: &Layout, view: View, wanted: &mut Option<View>| {
        let open = layout.is_open(view);
        if ui.selectable_label(open, layout.title(view)).clicked() {
            *wanted = Some(view);
        }
    };
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        if shoes.count() > 0 {
            egui::CollapsingHeader::new("Shoes").default_open(true).show(ui, |ui| shoes.list(ui));
        }
        egui::CollapsingHeader::new("Views").default_open(true).show(ui, |ui| {
            for view in [View::Map, View::Attitude, View::Status, View::Parameters] {
                entry(ui, layout, view, &mut wanted);
            }
        });
        egui::CollapsingHeader::new("Plots").default_open(true).show(ui, |ui| {
            for number in 0..layout.plots.len() {
                entry(ui, layout, View::Plot(number), &mut wanted);
            }
            if ui.button("New plot").clicked() {
                let number = layout.plots.len();
                layout.plots.push(Plot::of(&format!("Plot {}", number + 1), &[]));
                wanted = Some(View::Plot(number));
            }
        });
        ui.separator();
        if ui.button("Usual places").on_hover_text("Puts all views where they were at first").clicked() {
            layout.dock = Layout::default().dock;
        }
    });
    if let Some(view) = wanted {
        layout.open(view);
    }
}
