//! Every control of the window, as those know it who cannot see it, and the window as a whole.

use super::engine::{Kind, Opening, Plan, What};
use super::gpu::offscreen::{self, Sheet};
use super::layout::{Layout, View};
use super::{App, picture};
use crate::building::{geojson, route};
use crate::simulation::{Route, Scenario, SensorModel, output};
use eframe::egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use std::path::PathBuf;
use std::time::{Duration, Instant};

const TWIN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../buildings/twin.geojson");

/// A walk in the twin, in a folder of its own.
fn recording(home: &tempfile::TempDir) -> PathBuf {
    let building = geojson::parse(&std::fs::read_to_string(TWIN).unwrap(), TWIN).unwrap();
    let route = Route::through(&building, &route::plan(&building, &["W02", "hall"]).unwrap()).unwrap();
    let mut sensor = SensorModel::bmx055_calibrated();
    (sensor.accel.rate, sensor.gyro.rate) = (400.0, 400.0);
    let scenario = Scenario { route, sensor, ..Scenario::default() };
    let path = home.path().join("a walk with a name that is far longer than any toolbar has room for.mcap");
    output::write(&scenario, &path, 20, |_| {}).unwrap();
    path
}

/// The window without anything to draw the map with: controls need no graphics card.
fn window(file: Option<PathBuf>) -> Harness<'static, App> {
    Harness::builder()
        .with_size([1280.0, 800.0])
        .with_max_steps(64)
        .build_ui_state(|ui, app: &mut App| app.show(ui), App::new(None, file))
}

fn playing(home: &tempfile::TempDir) -> Harness<'static, App> {
    let mut opening = Opening::of(What::Recording(recording(home)));
    opening.building = Some(Plan::File(TWIN.into()));
    opening.settings.follow.start = "W02".into();
    let mut window = window(None);
    let context = window.ctx.clone();
    window.state_mut().open(opening, &context, false);
    until(&mut window, |app| app.snapshot().kind == Kind::Replay);
    window.get_by_label("Pause").click();
    until(&mut window, |app| !app.snapshot().pace.playing);
    window
}

/// Lets the window run until something holds.
fn until(window: &mut Harness<'static, App>, holds: impl Fn(&App) -> bool) {
    let begun = Instant::now();
    while !holds(window.state()) {
        assert!(begun.elapsed() < Duration::from_secs(60), "{:?}", window.state().snapshot().fault);
        std::thread::sleep(Duration::from_millis(5));
        window.step();
    }
    window.run_steps(2);
}

/// Writes into the field of this name.
fn write(window: &mut Harness<'static, App>, field: &str, text: &str) {
    window.get_by_label(field).focus();
    window.run_steps(4);
    window.get_by_label(field).type_text(text);
    window.run_steps(12);
}

#[test]
fn without_anything_open_only_what_opens_can_be_pressed() {
    let mut window = window(None);
    window.run_steps(12);
    for word in ["View list", "Open…", "Connect…", "Export picture", "?", "◑"] {
        assert!(!window.get_by_label(word).accesskit_node().is_disabled(), "{word}");
    }
    for word in ["RESET", "INIT", "TRACK", "Start recording", "Export track"] {
        assert!(window.get_by_label(word).accesskit_node().is_disabled(), "{word}");
    }
    assert!(window.query_by_label("Play").is_none(), "there is nothing to be played");
    window.get_by_label("nothing is open");
}

#[test]
fn a_recording_is_played_and_gone_through_by_its_buttons() {
    let home = tempfile::tempdir().unwrap();
    let mut window = playing(&home);
    let [first, last] = window.state().snapshot().span;
    window.state().ask(super::engine::Command::Jump(first));
    until(&mut window, |app| app.snapshot().computing.is_none() && app.snapshot().steps == 0);
    for steps in 1..4 {
        window.get_by_label("To the next step").click();
        until(&mut window, |app| app.snapshot().steps == steps);
    }
    let third = window.state().snapshot().time;
    window.get_by_label("To the step before").click();
    until(&mut window, |app| app.snapshot().steps == 2 && app.snapshot().computing.is_none());
    window.get_by_label("To the next step").click();
    until(&mut window, |app| app.snapshot().steps == 3);
    assert_eq!(window.state().snapshot().time, third, "back and forth is the same moment");
    window.key_press(Key::End);
    until(&mut window, |app| app.snapshot().time == last && app.snapshot().computing.is_none());
    let end = window.state().snapshot().clone();
    let whereabouts = end.whereabouts.unwrap();
    assert_eq!(whereabouts.room.as_deref(), Some("hall"), "{:?}", whereabouts.state);
    assert!(!end.overlay.clouds[0].particles.is_empty() && !end.overlay.tracks.is_empty());
    for word in ["located", "hall", "TRACKING"] {
        assert!(window.query_all_by_label_contains(word).next().is_some(), "{word}");
    }
    window.get_by_label("RESET").click();
    until(&mut window, |app| app.snapshot().steps == 0);
    window.get_by_label("TRACK").click();
    window.key_press(Key::Home);
    until(&mut window, |app| app.snapshot().time == first && app.snapshot().computing.is_none());
}

#[test]
fn settings_are_bounded_and_apply_at_once() {
    let home = tempfile::tempdir().unwrap();
    let mut window = playing(&home);
    window.state_mut().layout().open(View::Parameters);
    window.run_steps(2);
    window.get_by_label("Documented").click();
    let documented = sohle_shared::tracker::Parameters::documented();
    until(&mut window, |app| app.snapshot().settings.as_deref() == Some(&documented));
    window.get_by_label("Default").click();
    let default = sohle_shared::tracker::Parameters::default();
    until(&mut window, |app| app.snapshot().settings.as_deref() == Some(&default));
    // Every setting that is shown has a name that is read out.
    write(&mut window, "Find", "stance.floor");
    assert!(window.query_all_by_label("stance.floor").next().is_some());
    assert!(window.query_by_label("stance.ceiling").is_none());
}

#[test]
fn views_are_opened_from_the_list_and_plots_are_made() {
    let mut window = window(None);
    window.run_steps(2);
    let plots = window.state_mut().layout().plots.len();
    window.get_by_label("New plot").click();
    window.run_steps(12);
    assert!(window.state_mut().layout().plots.len() == plots + 1);
    assert!(window.state_mut().layout().is_open(View::Plot(plots)));
    window.get_by_label("Usual places").click();
    window.run_steps(12);
    assert!(!window.state_mut().layout().is_open(View::Plot(plots)));
    window.get_by_label("View list").click();
    window.run_steps(12);
    assert!(window.query_by_label("New plot").is_none(), "the list is hidden");
}

#[test]
fn all_keys_are_told_in_the_help() {
    let mut window = window(None);
    window.run_steps(2);
    window.key_press(Key::F1);
    window.run_steps(12);
    for key in ["A", "S", "P", "Y", "X", "Space", "Ctrl+O"] {
        assert!(window.query_all_by_label(key).next().is_some(), "{key}");
    }
    window.get_by_label("Close").click();
    window.run_steps(12);
    assert!(window.query_by_label("Keys and mouse").is_none());
}

#[test]
fn dialogs_say_what_is_missing() {
    let mut window = window(None);
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::K);
    window.run_steps(12);
    let connect = |window: &Harness<'static, App>| window.get_by_label("Connect").accesskit_node().is_disabled();
    assert!(connect(&window));
    write(&mut window, "Address", "tcp:nowhere.invalid:1");
    assert!(!connect(&window));
    window.get_by_label("Cancel").click();
    window.run_steps(12);
    window.get_by_label("Open…").click();
    window.run_steps(12);
    assert!(window.get_by_label("Play").accesskit_node().is_disabled());
}

#[test]
fn what_cannot_be_opened_is_told() {
    let home = tempfile::tempdir().unwrap();
    let broken = home.path().join("broken.mcap");
    let whole = std::fs::read(recording(&home)).unwrap();
    for (bytes, word) in [(&b""[..], "empty"), (&b"no recording at all"[..], "broken.mcap")] {
        std::fs::write(&broken, bytes).unwrap();
        let mut window = window(None);
        let context = window.ctx.clone();
        window.state_mut().open(Opening::of(What::Recording(broken.clone())), &context, false);
        until(&mut window, |app| app.snapshot().fault.is_some());
        let fault = window.state().snapshot().fault.clone().unwrap();
        assert!(fault.contains(word), "{fault}");
    }
    // One that ends in the middle is played as far as it goes, or refused in words.
    std::fs::write(&broken, &whole[..whole.len() / 2]).unwrap();
    let mut window = window(None);
    let context = window.ctx.clone();
    window.state_mut().open(Opening::of(What::Recording(broken)), &context, false);
    until(&mut window, |app| app.snapshot().fault.is_some() || app.snapshot().kind == Kind::Replay);
}

#[test]
fn a_broken_layout_is_told_and_the_usual_one_is_there() {
    let home = tempfile::tempdir().unwrap();
    let file = home.path().join("window.json");
    std::fs::write(&file, "{\"dock\": 7}").unwrap();
    let mut window = window(Some(file));
    window.run_steps(12);
    assert!(window.query_all_by_label_contains("where it was at first").next().is_some());
    assert_eq!(window.state_mut().layout().plots, Layout::default().plots);
}

#[test]
fn the_whole_window_is_drawn_with_particles_and_path() {
    let home = tempfile::tempdir().unwrap();
    for dark in [false, true] {
        let mut opening = Opening::of(What::Recording(recording(&home)));
        opening.building = Some(Plan::File(TWIN.into()));
        opening.settings.follow.start = "W02".into();
        let sheet = Sheet { size: [1280.0, 800.0], pixels_per_point: 1.0, dark };
        let wanted = picture::Wanted { openings: vec![opening], layout: None, at: None, views: Vec::new(), sheet };
        let drawn = match picture::draw(wanted) {
            Err(picture::Error::Offscreen(offscreen::Error::NoAdapter(told))) => return eprintln!("skipped: {told}"),
            drawn => drawn.unwrap(),
        };
        // Adapters differ in single pixels; each of these is drawn with hundreds.
        let count = |is: fn([u8; 4]) -> bool| {
            drawn.pixels.chunks_exact(4).filter(|pixel| is([pixel[0], pixel[1], pixel[2], pixel[3]])).count()
        };
        let red = count(|[r, g, b, _]| r > 150 && g < 100 && b < 100);
        let green = count(|[r, g, b, _]| g > 90 && r < 90 && b < 120);
        assert!(red > 200 && green > 200, "{red} {green}");
    }
}
