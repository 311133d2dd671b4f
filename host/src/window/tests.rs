//! Every control of the window, as those know it who cannot see it, and the window as a whole.

use super::engine::{Beside, Command, Kind, Opening, Plan, Positions, What};
use super::gpu::offscreen::{self, Sheet};
use super::layout::{Layout, View};
use super::map::{self, Projection, Role as Drawn};
use super::{App, picture};
use crate::building::{geojson, route};
use crate::cli::fixes::Source;
use crate::simulation::{Route, Scenario, SensorModel, output};
use eframe::egui::accesskit::Role;
use eframe::egui::{Key, Modifiers};
use egui_dock::DockState;
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

const TWIN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../buildings/twin.geojson");

/// A walk in the twin, in a folder of its own.
fn recording(home: &tempfile::TempDir) -> PathBuf {
    named(home, "a walk with a name that is far longer than any toolbar has room for")
}

fn named(home: &tempfile::TempDir, name: &str) -> PathBuf {
    let building = geojson::parse(&std::fs::read_to_string(TWIN).unwrap(), TWIN).unwrap();
    let route = Route::through(&building, &route::plan(&building, &["W02", "hall"]).unwrap()).unwrap();
    let mut sensor = SensorModel::bmx055_calibrated();
    (sensor.accel.rate, sensor.gyro.rate) = (400.0, 400.0);
    let scenario = Scenario { route, sensor, ..Scenario::default() };
    let path = home.path().join(format!("{name}.mcap"));
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
    window.state().ask(Command::Jump(first));
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
fn settings_of_the_particle_filter_apply_at_once_too() {
    let home = tempfile::tempdir().unwrap();
    let mut window = playing(&home);
    window.state_mut().layout().open(View::Parameters);
    window.run_steps(2);
    window.get_by_label("Particle filter").click();
    window.run_steps(2);
    window.get_by_label("Phone").click();
    let phone = crate::particle::Parameters::phone();
    until(&mut window, |app| app.snapshot().particle.as_deref() == Some(&phone));
    write(&mut window, "Find", "turn_");
    assert!(window.query_all_by_label("turn_share").next().is_some());
    assert!(window.query_by_label("leak").is_none());
}

#[test]
fn the_walk_graph_is_followed_on_when_that_is_asked_for() {
    let home = tempfile::tempdir().unwrap();
    let mut window = playing(&home);
    // Nothing else says where somebody is.
    choose(&mut window, Beside::Positions, |app| !app.snapshot().positions);
    let ways = |app: &App, which: Beside| {
        let tracks = &app.snapshot().overlay.tracks;
        tracks.iter().find(|track| track.name == which.word().to_lowercase()).map_or(0, |track| track.pieces[0].len())
    };
    let runs = |app: &App, which: Beside| app.snapshot().others.iter().any(|(running, _)| *running == which);
    for which in [Beside::Documented, Beside::Matcher] {
        choose(&mut window, which, |app| runs(app, which));
    }
    window.key_press(Key::End);
    until(&mut window, |app| {
        app.snapshot().computing.is_none() && ways(app, Beside::Documented) > 1 && ways(app, Beside::Matcher) > 1
    });
    // What was decided at the last step, and where that leaves somebody.
    assert!(window.query_all_by_label_contains(", delta ").next().is_some());
    assert!(window.query_all_by_label_contains(" hypotheses, loss ").next().is_some());
    choose(&mut window, Beside::Documented, |app| !runs(app, Beside::Documented) && ways(app, Beside::Documented) == 0);
    assert!(runs(window.state(), Beside::Matcher));
}

/// Opens the menu of other methods, clicks one and closes it.
fn choose(window: &mut Harness<'static, App>, which: Beside, until_is: impl Fn(&App) -> bool) {
    window.get_by_label("Methods").click();
    window.run_steps(2);
    window.get_by_role_and_label(Role::CheckBox, which.word()).click();
    until(window, until_is);
    window.key_press(Key::Escape);
    window.run_steps(2);
}

#[test]
fn positions_are_drawn_with_the_path_that_steps_and_they_give() {
    let home = tempfile::tempdir().unwrap();
    let path = recording(&home);
    // Where somebody is in truth, each second of the first part.
    let recording = crate::recording::read(&path, std::fs::File::open(&path).unwrap(), None).unwrap();
    let truth = recording.truth.unwrap();
    let line = |second: i64| {
        let at = truth.poses.partition_point(|pose| pose.time.0 < second * 1_000_000);
        let [x, y, _] = truth.poses[at].position;
        format!("{{\"time_us\":{second}000000,\"position\":[{x},{y}],\"sigma_m\":1}}\n")
    };
    let lines: String = (2..20).map(line).collect();
    let fixes = home.path().join("fixes.jsonl");
    std::fs::write(&fixes, lines + "no JSON\n").unwrap();
    let mut window = window(None);
    let context = window.ctx.clone();
    let mut opening = Opening::of(What::Recording(path));
    opening.positions = Some(Positions::From(Source::File(fixes)));
    opening.building = Some(Plan::File(TWIN.into()));
    opening.settings.follow.start = "W02".into();
    window.state_mut().open(opening, &context, false);
    until(&mut window, |app| app.snapshot().kind == Kind::Replay && app.snapshot().positions);
    window.key_press(Key::End);
    let pieces = |app: &App, name: &str| {
        let tracks = &app.snapshot().overlay.tracks;
        tracks.iter().find(|track| track.name == name).map(|track| track.pieces.len())
    };
    // Each position is a cross of two strokes.
    until(&mut window, |app| app.snapshot().computing.is_none() && pieces(app, "positions") == Some(36));
    assert_eq!(pieces(window.state(), "steps and positions"), Some(1));
    assert!(window.query_all_by_label_contains(" by 18 positions").next().is_some());
    choose(&mut window, Beside::Positions, |app| pieces(app, "positions").is_none());
}

#[test]
fn several_are_shown_each_in_its_colour_and_one_is_selected() {
    let home = tempfile::tempdir().unwrap();
    let (path, other) = (recording(&home), named(&home, "other"));
    let mut window = window(None);
    let context = window.ctx.clone();
    for (beside, path) in [(false, &path), (true, &other)] {
        let mut opening = Opening::of(What::Recording(path.clone()));
        opening.building = Some(Plan::File(TWIN.into()));
        opening.settings.follow.start = "W02".into();
        window.state_mut().open(opening, &context, beside);
        until(&mut window, |app| app.snapshot().kind == Kind::Replay);
        window.state_mut().ask(Command::Play(false));
        window.state_mut().ask(Command::Jump(f64::from(u16::MAX)));
        until(&mut window, |app| app.snapshot().computing.is_none() && app.snapshot().steps > 5);
    }
    let (_, both) = window.state_mut().shoes().drawing();
    assert_eq!((both.clouds.len(), both.people.len()), (2, 2));
    assert!(both.clouds[0].colour.is_some() && both.clouds[0].colour != both.clouds[1].colour);
    assert_eq!(both.people.iter().map(|person| person.selected).collect::<Vec<_>>(), [false, true]);
    let estimates = both.tracks.iter().filter(|track| track.role == Drawn::Estimate).count();
    assert!(estimates == 2 && both.tracks.len() > 2, "the selected one has all its ways");
    // What did not change is not made anew.
    let (_, again) = window.state_mut().shoes().drawing();
    assert!(Arc::ptr_eq(&both.tracks[0].pieces, &again.tracks[0].pieces));
    window.state_mut().shoes().select_person(0);
    window.run_steps(2);
    assert_ne!(window.state().snapshot().name, "other");
    window.get_by_label("other").click();
    window.run_steps(2);
    assert_eq!(window.state().snapshot().name, "other");
    window.get_by_label("Close other").click();
    window.run_steps(2);
    assert!(window.query_by_label("other").is_none() && window.state_mut().shoes().count() == 1);
    let (_, one) = window.state_mut().shoes().drawing();
    assert_eq!(one.clouds[0].colour, None, "alone, it is green");
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

/// Each view by itself, and all of them, as they were when somebody looked at them last. Software draws the same everywhere but
/// for single pixels; what a graphics card draws is not compared.
#[test]
fn every_view_looks_as_it_did() {
    let home = tempfile::tempdir().unwrap();
    let path = recording(&home);
    let flat = map::View { projection: Projection::Flat, ..map::View::default() };
    let only = |view: View| Layout { dock: DockState::new(vec![view]), selector: false, ..Layout::default() };
    let wanted = [
        ("window", [1000.0, 640.0], false, Layout::default()),
        ("map", [480.0, 360.0], false, only(View::Map)),
        ("map_dark", [480.0, 360.0], true, only(View::Map)),
        ("map_flat", [480.0, 360.0], false, Layout { map: flat, ..only(View::Map) }),
        ("attitude", [400.0, 400.0], false, only(View::Attitude)),
        ("status", [400.0, 500.0], false, only(View::Status)),
        ("parameters", [400.0, 500.0], false, only(View::Parameters)),
        ("plot", [640.0, 320.0], false, only(View::Plot(2))),
    ];
    let mut results = egui_kittest::SnapshotResults::new();
    for (name, size, dark, layout) in wanted {
        let file = home.path().join(format!("{name}.json"));
        layout.write(&file).unwrap();
        let mut opening = Opening::of(What::Recording(path.clone()));
        opening.building = Some(Plan::File(TWIN.into()));
        opening.settings.follow.start = "W02".into();
        let sheet = Sheet { size, pixels_per_point: 1.0, dark };
        let wanted =
            picture::Wanted { openings: vec![opening], layout: Some(file), at: Some(28.0), views: Vec::new(), sheet };
        let drawn = match picture::draw(wanted) {
            Err(picture::Error::Offscreen(offscreen::Error::NoAdapter(told))) => return eprintln!("skipped: {told}"),
            drawn => drawn.unwrap(),
        };
        if !drawn.in_software {
            return eprintln!("skipped: what a graphics card draws is not compared");
        }
        let [width, height] = drawn.size;
        let image = image::RgbaImage::from_raw(width, height, drawn.pixels).unwrap();
        // Another processor lets some edges fall the other way; whatever is moved or missing has many more pixels.
        let options =
            egui_kittest::SnapshotOptions::new().threshold(1.0).max_failed_pixels((width * height / 250) as usize);
        results.add(egui_kittest::try_image_snapshot_options(&image, name, &options));
    }
    results.unwrap();
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
