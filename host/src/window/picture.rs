//! The window as a picture, drawn without a display.

use super::App;
use super::engine::{Command, Kind, Opening};
use super::gpu::offscreen::{self, Picture, Sheet, Studio};
use super::layout::{Look, View};
use super::map::Map;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Nothing can draw.
    #[error(transparent)]
    Offscreen(#[from] offscreen::Error),
    /// What is to be seen cannot be opened.
    #[error("{0}")]
    Opening(String),
    /// It takes too long.
    #[error("after {0} s the moment to be seen has not been reached")]
    Late(u64),
}

/// What is to be seen.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// What is open; the first is selected.
    pub openings: Vec<Opening>,
    /// How it is laid out.
    pub layout: Option<PathBuf>,
    /// The time after the beginning of a recording; its end where there is none. For a shoe, how long it is listened to.
    /// **Units:** s.
    pub at: Option<f64>,
    /// Views that are brought to the front.
    pub views: Vec<View>,
    /// Size, and light or dark.
    pub sheet: Sheet,
}

/// No moment takes longer to be computed.
const PATIENCE: Duration = Duration::from_secs(600);
/// Between two frames while something is computed.
const PAUSE: Duration = Duration::from_millis(20);

/// Draws it.
///
/// # Errors
/// When nothing can draw, or the recording cannot be read.
pub fn draw(wanted: Wanted) -> Result<Picture, Error> {
    let Wanted { openings, layout, at, views, sheet } = wanted;
    let mut studio = Studio::new()?;
    let mut app = App::new(Some(Map::new(studio.render())), layout);
    app.layout().look = if sheet.dark { Look::Dark } else { Look::Light };
    views.into_iter().for_each(|view| app.layout().open(view));
    let fitted = app.layout().map.camera.is_none();
    let begun = Instant::now();
    let mut asked = vec![false; openings.len()];
    let mut openings = openings.into_iter();
    let mut settled = 0;
    while !asked.is_empty() && settled < 3 {
        studio.frame(sheet, |ui| {
            for (index, opening) in openings.by_ref().enumerate() {
                app.open(opening, ui.ctx(), index > 0);
            }
            app.shoes().select(0);
            app.show(ui);
        })?;
        let mut there = true;
        for (index, asked) in asked.iter_mut().enumerate() {
            let Some(snapshot) = app.shoes().get(index).cloned() else { continue };
            if let (Kind::Nothing, Some(fault)) = (snapshot.kind, &snapshot.fault) {
                return Err(Error::Opening(fault.clone()));
            }
            there &= match snapshot.kind {
                Kind::Nothing | Kind::Opening => false,
                Kind::Live => begun.elapsed().as_secs_f64() >= at.unwrap_or(5.0),
                Kind::Replay if !*asked => {
                    *asked = true;
                    let [first, last] = snapshot.span;
                    app.shoes().ask_one(index, Command::Play(false));
                    app.shoes().ask_one(index, Command::Jump(at.map_or(last, |at| first + at)));
                    false
                }
                Kind::Replay => snapshot.computing.is_none() && !snapshot.pace.playing,
            };
        }
        settled = if there { settled + 1 } else { 0 };
        if begun.elapsed() > PATIENCE {
            return Err(Error::Late(PATIENCE.as_secs()));
        }
        std::thread::sleep(PAUSE);
    }
    if fitted {
        // What was fitted when it was opened had the room that there was then.
        app.layout().map.camera = None;
    }
    Ok(studio.picture(sheet, |ui| app.show(ui))?)
}
