//! The map as it is drawn, and what it does with the mouse, the keys and its buttons.
//!
//! Where nothing can draw (no graphics card, no software in its place) the tests say so and pass.

#![cfg(feature = "window")]
#![allow(clippy::unwrap_used, reason = "a test that cannot draw has failed")]

use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, Vec2, pos2, vec2};
use egui_kittest::{Harness, kittest::Queryable};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use sohle::building::{Building, geojson};
use sohle::particle::{Cluster, Particle};
use sohle::window::cube::Cube;
use sohle::window::gpu::Frames;
use sohle::window::gpu::offscreen::{Picture, Sheet, Studio};
use sohle::window::map::{
    Camera, Cloud, Foot, Map, Overlay, Person, Projection, Response, Rgb, Role, Scene, Track, View,
};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Colours as the map has them on light ground.
const GREEN: Rgb = [0x16, 0xa3, 0x4a];
const RED: Rgb = [0xdc, 0x26, 0x26];
const VIOLET: Rgb = [0x8b, 0x3f, 0xd9];

fn studio() -> Option<Studio> {
    match Studio::new() {
        Ok(studio) => Some(studio),
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

fn building(name: &str) -> Building {
    let file = format!("{}/../buildings/{name}.geojson", env!("CARGO_MANIFEST_DIR"));
    geojson::parse(&std::fs::read_to_string(file).unwrap(), name).unwrap()
}

/// Somebody on the ground floor of the institute who may be in one of two places.
fn overlay() -> Overlay {
    let particle = |index: usize| {
        let (sin, cos) = (index as f32 * 2.4).sin_cos();
        let far = (index as f32).sqrt() * 0.03;
        Particle { x: 30.0 + 2.0 * far * cos, y: 7.6 + far * sin, weight: 1.0, ..Particle::default() }
    };
    let track = |role, name: &str, shift: f64| {
        let points = (0..60).map(|index| [2.0 + f64::from(index) * 0.47, 7.7 + shift * f64::from(index) / 60.0, 0.0]);
        Track { name: name.into(), role, colour: None, pieces: vec![points.collect()].into() }
    };
    let cluster = |probability, x, y| Cluster {
        probability,
        position: Vector3::new(x, y, 0.0),
        covariance: Matrix3::new(1.6, 0.3, 0.0, 0.3, 0.4, 0.0, 0.0, 0.0, 0.0),
        heading: 0.1,
        heading_agreement: 0.9,
        floor: 0,
        floor_index: 0,
        count: 1_000,
    };
    Overlay {
        clouds: vec![Cloud { particles: (0..2_000).map(particle).collect(), colour: None }],
        tracks: vec![track(Role::Estimate, "estimated", 0.0), track(Role::Free, "without the map", -5.0)],
        people: vec![Person {
            name: "shoe".into(),
            position: [29.8, 7.7, 0.0],
            floor: 0,
            heading: Some(0.0),
            sigma_m: 0.7,
            colour: None,
            selected: true,
        }],
        clusters: vec![cluster(0.6, 30.0, 7.6), cluster(0.4, 12.0, 4.0)].into(),
        feet: Vec::new(),
    }
}

fn flat() -> View {
    View { projection: Projection::Flat, ..View::default() }
}

const SHEET: Sheet = Sheet { size: [640.0, 420.0], pixels_per_point: 1.0, dark: false };

fn picture(studio: &mut Studio, sheet: Sheet, view: &View, overlay: &Overlay) -> Picture {
    let scene = Arc::new(Scene::of(&building("institute")));
    let mut map = Map::new(studio.render());
    let mut view = view.clone();
    studio.picture(sheet, |ui| drop(map.show(ui, &mut view, &scene, overlay))).unwrap()
}

/// Pixels of nearly a colour: a dot of a particle is as small as a pixel, and shows some of what is below it.
fn count(picture: &Picture, rgb: Rgb) -> usize {
    let near = |pixel: &[u8]| (0..3).all(|channel| pixel[channel].abs_diff(rgb[channel]) < 48);
    picture.pixels.chunks_exact(4).filter(|pixel| near(pixel)).count()
}

#[test]
fn a_building_that_is_opened_later_comes_whole_into_view() {
    let Some(mut studio) = studio() else { return };
    let (view, nothing) = (View::default(), Overlay::default());
    let expected = picture(&mut studio, SHEET, &view, &nothing);
    let mut map = Map::new(studio.render());
    let mut view = view;
    let mut last = None;
    for scene in [Scene::open_ground(), Scene::of(&building("institute"))] {
        let scene = Arc::new(scene);
        last = Some(studio.picture(SHEET, |ui| drop(map.show(ui, &mut view, &scene, &nothing))).unwrap());
    }
    assert!(last.unwrap().pixels == expected.pixels);
}

#[test]
fn particles_and_paths_are_drawn_and_can_be_left_out() {
    let Some(mut studio) = studio() else { return };
    for projection in [Projection::Orbit, Projection::Flat] {
        let mut view = View { projection, hidden: [1, 2].into(), ..View::default() };
        // The badges of the clusters are green too, the person is red.
        view.layers.clusters = false;
        let drawn = Overlay { people: vec![], ..overlay() };
        let all = picture(&mut studio, SHEET, &view, &drawn);
        let [green, red, violet] = [GREEN, RED, VIOLET].map(|rgb| count(&all, rgb));
        assert!(green > 60 && red > 200 && violet > 200, "{projection:?}: {green} {red} {violet}");
        view.layers.particles = false;
        view.layers.estimate = false;
        let bare = picture(&mut studio, SHEET, &view, &drawn);
        // What is left of red is the needle to the north.
        let [green, red, violet] = [GREEN, RED, VIOLET].map(|rgb| count(&bare, rgb));
        assert!(green < 10 && red < 80 && violet > 200, "{projection:?}: {green} {red} {violet}");
    }
}

#[test]
fn ways_lie_under_whole_floors_and_on_those_of_glass() {
    let Some(mut studio) = studio() else { return };
    let drawn = Overlay { people: vec![], clouds: vec![], clusters: Vec::new().into(), ..overlay() };
    let mut seen = |level: i32, hidden: &[i32]| {
        let view = View { level: Some(level), hidden: hidden.iter().copied().collect(), ..View::default() };
        count(&picture(&mut studio, SHEET, &view, &drawn), VIOLET)
    };
    let [below, glass, alone] = [seen(2, &[]), seen(0, &[]), seen(0, &[1, 2])];
    // What is left below is the line in the legend.
    assert!(below < 80 && glass > 5 * below && alone > 5 * below, "{below} {glass} {alone}");
}

/// Where software draws, the building is kept from one picture to the next.
#[test]
fn what_is_kept_between_steps_looks_like_what_is_drawn_anew() {
    let Some(mut studio) = studio() else { return };
    let scene = Arc::new(Scene::of(&building("institute")));
    let (before, after) = (Overlay { tracks: vec![], ..overlay() }, overlay());
    for projection in [Projection::Orbit, Projection::Flat] {
        let view = View { projection, ..View::default() };
        let mut map = Map::quick(studio.render());
        let mut draw = |map: &mut Map, view: &mut View, overlay: &Overlay| {
            studio.picture(SHEET, |ui| drop(map.show(ui, view, &scene, overlay))).unwrap().pixels
        };
        let mut seen = view.clone();
        let first = draw(&mut map, &mut seen, &before);
        let kept = draw(&mut map, &mut seen, &after);
        assert!(first != kept);
        let mut fresh = seen.clone();
        let mut other = Map::quick(map.render());
        assert!(kept == draw(&mut other, &mut fresh, &after), "{projection:?}: a step");
        // Turned, the building is elsewhere; and back again as it was.
        let camera = seen.camera.unwrap();
        seen.camera = Some(Camera { bearing: camera.bearing + 0.3, ..camera });
        let turned = draw(&mut map, &mut seen, &after);
        assert!(turned != kept, "{projection:?}: turned");
        seen.camera = Some(camera);
        assert!(kept == draw(&mut map, &mut seen, &after), "{projection:?}: turned back");
    }
}

#[test]
fn frames_are_told_of_when_they_are_drawn() {
    let Some(mut studio) = studio() else { return };
    let frames = Frames::new(studio.render());
    let mut begun = Vec::new();
    for _ in 0..3 {
        begun.push(Instant::now());
        studio.frame(SHEET, |ui| frames.watch(ui, begun[begun.len() - 1])).unwrap();
    }
    let mut drawn = Vec::new();
    let patience = Instant::now() + Duration::from_secs(20);
    while drawn.len() < begun.len() && Instant::now() < patience {
        drawn.extend(frames.drawn());
        std::thread::sleep(Duration::from_millis(1));
    }
    assert_eq!(drawn.iter().map(|frame| frame.begun).collect::<Vec<_>>(), begun);
    assert!(drawn.iter().all(|frame| frame.drawn > frame.begun));
}

/// It belongs to the way without the map, and is left out with it.
#[test]
fn a_foot_on_its_way_is_drawn_from_where_it_stood() {
    let Some(mut studio) = studio() else { return };
    for projection in [Projection::Orbit, Projection::Flat] {
        let mut view = View { projection, ..View::default() };
        let mut overlay =
            Overlay { feet: vec![Foot { from: [4.0, 7.7, 0.0], to: [24.0, 7.7, 0.0] }], ..Overlay::default() };
        let foot = count(&picture(&mut studio, SHEET, &view, &overlay), VIOLET);
        view.layers.free = false;
        let hidden = count(&picture(&mut studio, SHEET, &view, &overlay), VIOLET);
        overlay.feet.clear();
        let without = count(&picture(&mut studio, SHEET, &view, &overlay), VIOLET);
        assert!(foot > without + 150 && hidden == without, "{projection:?}: {foot} {hidden} {without}");
    }
}

#[test]
fn a_floor_above_hides_what_is_below_until_it_is_hidden_itself() {
    let Some(mut studio) = studio() else { return };
    let drawn = Overlay { people: vec![], clusters: vec![].into(), ..overlay() };
    let covered = picture(&mut studio, SHEET, &View::default(), &drawn);
    let hidden = View { hidden: [1, 2].into(), ..View::default() };
    let open = picture(&mut studio, SHEET, &hidden, &drawn);
    assert!(count(&open, RED) > count(&covered, RED) + 100);
    // As soon as it is known where the person is, nothing hides it.
    let known = picture(&mut studio, SHEET, &View::default(), &overlay());
    assert!(count(&known, RED) > count(&covered, RED) + 100);
}

#[test]
fn nothing_is_drawn_again_when_nothing_changed() {
    let Some(mut studio) = studio() else { return };
    let scene = Arc::new(Scene::of(&building("twin")));
    let (mut map, mut view, overlay) = (Map::new(studio.render()), View::default(), overlay());
    let mut shots = || studio.picture(SHEET, |ui| drop(map.show(ui, &mut view, &scene, &overlay))).unwrap();
    let first = shots();
    assert_eq!(shots(), first);
}

#[test]
fn a_map_of_nothing_and_a_map_without_room_are_drawn() {
    let Some(mut studio) = studio() else { return };
    let scene = Arc::new(Scene::open_ground());
    let (mut map, mut view) = (Map::new(studio.render()), View::default());
    for size in [[640.0, 420.0], [30.0, 5.0], [1.0, 1.0], [3.0, 900.0]] {
        let sheet = Sheet { size, ..SHEET };
        studio.frame(sheet, |ui| drop(map.show(ui, &mut view, &scene, &Overlay::default()))).unwrap();
    }
    let broken =
        Track { name: "x".repeat(300), role: Role::Other, colour: None, pieces: vec![vec![[f64::NAN; 3]; 3]].into() };
    let odd = Overlay { tracks: vec![broken], people: vec![], ..overlay() };
    let picture = studio.picture(SHEET, |ui| drop(map.show(ui, &mut view, &scene, &odd))).unwrap();
    assert_eq!(picture.size, [640, 420]);
}

/// What a window would have around the map.
struct Shown {
    map: Map,
    view: View,
    scene: Arc<Scene>,
    overlay: Overlay,
    last: Response,
    /// What was clicked at any time.
    clicked: Option<sohle::window::map::Place>,
    picked: Option<usize>,
}

fn harness(studio: &Studio, view: View) -> Harness<'static, Shown> {
    let shown = Shown {
        map: Map::new(studio.render()),
        view,
        scene: Arc::new(Scene::of(&building("institute"))),
        overlay: overlay(),
        last: Response::default(),
        clicked: None,
        picked: None,
    };
    let mut harness = Harness::builder().with_size(vec2(800.0, 600.0)).with_max_steps(200).build_ui_state(
        |ui, shown: &mut Shown| {
            let told = shown.map.show(ui, &mut shown.view, &shown.scene, &shown.overlay);
            shown.clicked = told.clicked.clone().or(shown.clicked.take());
            shown.picked = told.picked.or(shown.picked);
            shown.last = told;
        },
        shown,
    );
    harness.run();
    harness
}

fn click(harness: &mut Harness<'_, Shown>, at: Pos2) {
    harness.hover_at(at);
    harness.step();
    harness.drag_at(at);
    harness.step();
    harness.drop_at(at);
    harness.run();
}

#[test]
fn buttons_have_names_and_do_what_they_say() {
    let Some(studio) = studio() else { return };
    let mut harness = harness(&studio, View::default());
    harness.get_by_label("Map of Institute");
    harness.get_by_label("2D").click();
    harness.run();
    assert_eq!(harness.state().view.projection, Projection::Flat);
    harness.get_by_label("F2").click();
    harness.run();
    assert_eq!(harness.state().view.level, Some(2));
    harness.get_by_label("3D").click();
    harness.run();
    harness.get_by_label("Hide floor F1").click();
    harness.run();
    assert!(harness.state().view.hidden.contains(&1));
    harness.get_by_label("All").click();
    harness.run();
    assert_eq!((harness.state().view.level, harness.state().view.hidden.len()), (None, 0));
    assert!(!harness.state().view.auto);
    harness.get_by_label("Auto").click();
    harness.run();
    assert!(harness.state().view.level.is_none() && harness.state().view.auto);
    harness.get_by_label("Follow").click();
    harness.run();
    assert!(harness.state().view.follow);
    // The person is on the ground floor; those above are hinted at.
    assert_eq!(harness.state().view.level, Some(0));
    let target = harness.state().view.camera.unwrap().target;
    assert!((target[0] - 29.8).abs() < 0.1 && (target[1] - 7.7).abs() < 0.1, "{target:?}");
    harness.get_by_label("Measure");
    harness.get_by_label("Layers").click();
    harness.run();
    harness.get_by_label("Particles (P)").click();
    harness.run();
    assert!(!harness.state().view.layers.particles);
}

#[test]
fn keys_switch_what_is_drawn_while_the_pointer_is_on_the_map() {
    let Some(studio) = studio() else { return };
    let mut harness = harness(&studio, View::default());
    harness.hover_at(pos2(400.0, 300.0));
    harness.run();
    for key in [Key::A, Key::S, Key::P, Key::Y, Key::X] {
        harness.key_press(key);
        harness.run();
    }
    let view = &harness.state().view;
    assert_eq!(view.hidden, [0, 1].into());
    assert!(!view.layers.particles && !view.layers.estimate && !view.layers.free && view.layers.corrected);
    harness.key_press(Key::A);
    harness.key_press(Key::V);
    harness.run();
    assert_eq!((harness.state().view.hidden.len(), harness.state().view.projection), (1, Projection::Flat));
}

#[test]
fn a_click_tells_the_place_and_a_badge_tells_the_cluster() {
    let Some(studio) = studio() else { return };
    let mut harness = harness(&studio, flat());
    let rect = harness.get_by_label("Map of Institute").rect();
    let camera = harness.state().view.camera.unwrap();
    let sight = sohle::window::map::camera::Sight::new(camera, Projection::Flat, rect);
    let at = |place| sight.project(place).unwrap();
    // In an office of the south side, away from everything that is drawn.
    click(&mut harness, at([38.0, 2.0, 0.0]));
    let place = harness.state().clicked.clone().unwrap();
    // A pixel is 8 cm here.
    assert!((place.point[0] - 38.0).abs() < 0.1 && (place.point[1] - 2.0).abs() < 0.1, "{place:?}");
    assert!(place.floor == 0 && place.room.is_some(), "{place:?}");
    click(&mut harness, at([12.0, 4.0, 0.0]));
    assert_eq!(harness.state().picked, Some(1));
}

#[test]
fn the_mouse_moves_turns_and_zooms_as_documented() {
    let Some(studio) = studio() else { return };
    let mut harness = harness(&studio, View { follow: true, ..View::default() });
    let middle = pos2(400.0, 330.0);
    let drag = |harness: &mut Harness<'_, Shown>, button, modifiers: Modifiers, by: Vec2| {
        harness.hover_at(middle);
        harness.step();
        harness.event(Event::ModifiersChanged(modifiers));
        let event = |at, pressed| Event::PointerButton { pos: at, button, pressed, modifiers };
        harness.event(event(middle, true));
        harness.step();
        for part in 1..=4 {
            harness.hover_at(middle + by * (part as f32 / 4.0));
            harness.step();
        }
        harness.event(event(middle + by, false));
        harness.event(Event::ModifiersChanged(Modifiers::NONE));
        harness.run();
    };
    let before = harness.state().view.camera.unwrap();
    drag(&mut harness, PointerButton::Secondary, Modifiers::CTRL, vec2(80.0, 40.0));
    let turned = harness.state().view.camera.unwrap();
    assert!(turned.bearing != before.bearing && turned.elevation == before.elevation && turned.target == before.target);
    assert!(harness.state().view.follow);
    drag(&mut harness, PointerButton::Secondary, Modifiers::SHIFT, vec2(80.0, 40.0));
    let tilted = harness.state().view.camera.unwrap();
    assert!(tilted.bearing == turned.bearing && tilted.elevation != turned.elevation);
    drag(&mut harness, PointerButton::Primary, Modifiers::NONE, vec2(80.0, 0.0));
    let moved = harness.state().view.camera.unwrap();
    assert!(moved.target != tilted.target && moved.bearing == tilted.bearing);
    // Moved away from the person by hand, it stays there.
    assert!(!harness.state().view.follow);
}

#[test]
fn the_cube_shows_the_sides_of_the_axes_towards_the_eye() {
    let Some(mut studio) = studio() else { return };
    let sheet = Sheet { size: [240.0, 220.0], ..SHEET };
    let mut share = |attitude: Option<UnitQuaternion<f64>>| {
        let mut cube = Cube { bearing: 0.0, elevation: 0.05 };
        let picture = studio.picture(sheet, |ui| drop(cube.show(ui, attitude))).unwrap();
        // Of a colour is what has more of one channel than of the others.
        [0, 1, 2].map(|channel| {
            let strong = |pixel: &&[u8]| {
                (0..3).all(|other| other == channel || pixel[channel] > pixel[other].saturating_add(60))
            };
            picture.pixels.chunks_exact(4).filter(strong).count()
        })
    };
    // The eye is in the south; the side that faces it there is -y. Turned by a half, it is +y.
    let about_z = |angle| Some(UnitQuaternion::from_euler_angles(0.0, 0.0, angle));
    let [red, green, _] = share(about_z(std::f64::consts::PI));
    assert!(green > 3_000 && red < green / 4, "{red} {green}");
    let [red, green, _] = share(about_z(-std::f64::consts::FRAC_PI_2));
    assert!(red > 3_000 && green < red / 4, "{red} {green}");
    assert!(share(None).into_iter().all(|pixels| pixels < 50));
}
