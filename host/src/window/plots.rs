//! Plots: any signal over time.
//!
//! The wheel and the left button change the range of values, the wheel with Ctrl how much time is seen, a double click shows
//! all values again (Foot, 6.2.3). A click goes to that moment of a recording.

use super::engine::{Command, Kind, Signal, Snapshot};
use super::layout::Plot;
use eframe::egui::{self, Color32, RichText, Ui, Vec2b, vec2};
use egui_plot::{Line, PlotPoints, VLine};

/// Colours of the curves, one after the other: told apart also by who sees fewer colours (Okabe and Ito 2008).
const COLOURS: [(u8, u8, u8); 7] =
    [(0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (230, 159, 0), (86, 180, 233), (128, 128, 128)];
/// Least and most that is seen of the time. **Units:** s.
const SECONDS: (f64, f64) = (0.1, 86_400.0);
/// Values below it are drawn there in a plot of logarithms.
const LEAST: f64 = 1e-6;
/// Points of the wheel for a factor of e.
const WHEEL: f32 = 300.0;

/// Shows a plot, and what it asks for.
///
/// Where it is not to be `fine`, a curve goes up and down once in two points of the width, not in each.
pub fn show(ui: &mut Ui, number: usize, plot: &mut Plot, snapshot: &Snapshot, fine: bool, asked: &mut Vec<Command>) {
    let seen = snapshot.time;
    ui.horizontal(|ui| {
        ui.menu_button("Signals", |ui| signals(ui, plot, snapshot));
        ui.checkbox(&mut plot.follow, "Follow").on_hover_text("Goes with the time; moving the plot ends it");
        ui.checkbox(&mut plot.logarithmic, "Log").on_hover_text("Logarithmic values");
        if ui.button("All").on_hover_text("Shows all of the time").clicked() {
            plot.follow = false;
            ui.data_mut(|data| data.insert_temp(ui.id().with(("all", number)), true));
        }
        for (index, signal) in plot.signals.iter().enumerate() {
            let (name, unit) = signal.words();
            let value = snapshot.signals.at(*signal, seen);
            let value = value.map_or("-".to_owned(), |value| format!("{value:.3}"));
            let unit = if unit == "1" { "" } else { unit };
            ui.label(RichText::new(format!("{name} {value} {unit}")).color(colour(index)).small());
        }
    });
    if snapshot.signals.span().is_some() && !plot.signals.iter().any(|signal| snapshot.signals.knows(*signal)) {
        ui.label(RichText::new("Nothing of this is told here; 'Signals' has what is.").weak());
    }
    let all = ui.data_mut(|data| data.remove_temp::<bool>(ui.id().with(("all", number)))).unwrap_or_default();
    let size = ui.available_size();
    if size.x < 40.0 || size.y < 40.0 {
        return;
    }
    let (follow, seconds, logarithmic) = (plot.follow, plot.seconds, plot.logarithmic);
    let scale = move |value: f64| if logarithmic { value.max(LEAST).log10() } else { value };
    let shown = move |value: f64| if logarithmic { 10_f64.powf(value) } else { value };
    let names: Vec<(Signal, Color32)> =
        plot.signals.iter().enumerate().map(|(index, signal)| (*signal, colour(index))).collect();
    let wheel = ui.input(|input| (input.smooth_scroll_delta.y, input.zoom_delta()));
    let signals = &snapshot.signals;
    let span = signals.span().unwrap_or([0.0, seconds]);
    let response = egui_plot::Plot::new(("plot", number))
        .width(size.x)
        .height(size.y)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .x_axis_label("s")
        .y_axis_formatter(move |mark, _| number_word(shown(mark.value)))
        .label_formatter(move |position| {
            let at = match position {
                egui_plot::HoverPosition::NearDataPoint { position, .. }
                | egui_plot::HoverPosition::Elsewhere { position } => position,
            };
            let mut text = format!("{:.2} s", at.x);
            for (signal, _) in &names {
                let (name, unit) = signal.words();
                if let Some(value) = signals.at(*signal, at.x) {
                    text +=
                        &format!("\n{name}: {} {}", number_word(f64::from(value)), if unit == "1" { "" } else { unit });
                }
            }
            Some(text)
        })
        .show(ui, |ui| {
            if follow {
                let end = seen.max(span[0] + 0.2 * seconds);
                ui.set_plot_bounds_x(end - seconds..=end + 0.02 * seconds);
            } else if all {
                ui.set_plot_bounds_x(span[0]..=span[1].max(span[0] + SECONDS.0));
                ui.set_auto_bounds(Vec2b::new(false, true));
            }
            let mut factor = 1.0;
            if ui.response().hovered() {
                let (scroll, zoom) = wheel;
                if zoom != 1.0 {
                    factor = zoom;
                    if !follow {
                        ui.zoom_bounds_around_hovered(vec2(zoom, 1.0));
                    }
                } else if scroll != 0.0 {
                    ui.zoom_bounds_around_hovered(vec2(1.0, (scroll / WHEEL).exp()));
                }
            }
            let bounds = ui.plot_bounds();
            let range = [bounds.min()[0], bounds.max()[0]];
            let columns = ui.response().rect.width() as usize / if fine { 1 } else { 2 };
            for (index, signal) in plot.signals.iter().enumerate() {
                let curve = signals.curve(*signal, range, columns);
                let points: PlotPoints<'_> = curve.into_iter().map(|[time, value]| [time, scale(value)]).collect();
                ui.line(Line::new(signal.words().0, points).color(colour(index)).width(1.5));
            }
            ui.vline(VLine::new("now", seen).color(Color32::from_gray(128)).width(1.0));
            let clicked = ui.response().clicked().then(|| ui.pointer_coordinate()).flatten().map(|point| point.x);
            let dragged = ui.response().dragged() && ui.response().drag_delta().x.abs() > 0.0;
            (factor, clicked, dragged)
        });
    let (factor, clicked, dragged) = response.inner;
    plot.seconds = (plot.seconds / f64::from(factor)).clamp(SECONDS.0, SECONDS.1);
    plot.follow &= !dragged;
    if let Some(time) = clicked.filter(|_| snapshot.kind == Kind::Replay) {
        asked.push(Command::Jump(time));
    }
}

fn signals(ui: &mut Ui, plot: &mut Plot, snapshot: &Snapshot) {
    ui.text_edit_singleline(&mut plot.title).on_hover_text("Title of the plot");
    egui::ScrollArea::vertical().max_height(400.0).show(ui, |ui| {
        for signal in Signal::ALL {
            let mut on = plot.signals.contains(&signal);
            let (name, unit) = signal.words();
            let word = if unit == "1" { name.to_owned() } else { format!("{name}, {unit}") };
            let known = snapshot.signals.knows(signal);
            let word = if known { RichText::new(word) } else { RichText::new(word).weak() };
            if ui.checkbox(&mut on, word).changed() {
                if on {
                    plot.signals.insert(signal);
                } else {
                    plot.signals.remove(&signal);
                }
            }
        }
    });
}

fn colour(index: usize) -> Color32 {
    let (r, g, b) = COLOURS[index % COLOURS.len()];
    Color32::from_rgb(r, g, b)
}

/// A number with as many digits as say something.
fn number_word(value: f64) -> String {
    match value.abs() {
        size if size >= 1e5 || (size > 0.0 && size < 1e-3) => format!("{value:.1e}"),
        size if size >= 100.0 => format!("{value:.0}"),
        size if size >= 1.0 => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let words = [1.5e7, 12_345.6, 3.12345, 0.01234, 0.0, 2e-5].map(number_word);
        assert_eq!(words, ["1.5e7", "12346", "3.12", "0.012", "0.000", "2.0e-5"]);
    }
}
