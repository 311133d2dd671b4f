//! `sohle window`: the building, the person, the shoe and every signal, live and in replay.

use super::Error;
use crate::export::file;
use crate::follow;
use crate::link::Address;
use crate::recording::Profile;
use crate::window::engine::walk::Settings;
use crate::window::engine::{Opening, What};
use crate::window::gpu::offscreen::Sheet;
use crate::window::layout::{View, usual_file};
use crate::window::{picture, run, saving};
use crate::{calibration, particle, toml_file};
use std::path::PathBuf;
use std::time::Duration;

/// Opens the window: plays a recording, or listens to a shoe
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Without anything to show, the window asks for it. F1 tells what keys there are. Where the views are is kept\n\
from one run to the next.\n\n\
Examples:\n  sohle window sohle-out/demo/recording.mcap --building buildings/twin.geojson --start W02\n  \
sohle window tcp:127.0.0.1:7700 --building buildings/twin.geojson\n  \
sohle window walk.mcap --picture window.png --at 30"
)]
pub struct Args {
    /// A recording, or a shoe as tcp:HOST:PORT or serial:PATH, which may be followed by @BAUD
    #[arg(value_name = "FILE|LINK")]
    what: Option<String>,
    /// Follows the steps through this building: any format that 'sohle building show' takes
    #[arg(long, value_name = "FILE|DIR", requires = "what")]
    building: Option<PathBuf>,
    /// Where the walk begins: anywhere, entrances, a room, or FLOOR,X,Y or FLOOR,X,Y,HEADING_DEG [default: anywhere]
    #[arg(long, value_name = "WHERE", allow_hyphen_values = true, requires = "building")]
    start: Option<String>,
    /// How the recording is laid out; recognised from the content when left out
    #[arg(long, value_name = "NAME|FILE.toml", requires = "what")]
    profile: Option<String>,
    /// Settings of the tracker as 'sohle parameters' prints them
    #[arg(long, value_name = "FILE.toml", requires = "what")]
    parameters: Option<PathBuf>,
    /// Settings of the particle filter; others keep their default
    #[arg(long, value_name = "FILE.toml", requires = "building")]
    particle: Option<PathBuf>,
    /// What 'sohle calibrate' found of the sensor; every sample is corrected by it before it is tracked
    #[arg(long, value_name = "FILE.toml", requires = "what")]
    calibration: Option<PathBuf>,
    /// Keeps where the views are in this file instead of the user's own; 'none' keeps nothing
    #[arg(long, value_name = "FILE.json|none")]
    layout: Option<PathBuf>,
    /// Closes the window after so many seconds
    #[arg(long = "for", value_name = "SECONDS")]
    duration: Option<f64>,
    /// Draws the window into this file, and opens none; needs no display
    #[arg(long, value_name = "FILE.png", conflicts_with = "duration")]
    picture: Option<PathBuf>,
    /// The second of the recording that the picture shows [default: its end]; of a shoe, how long it is listened to
    #[arg(long, value_name = "SECONDS", requires = "picture")]
    at: Option<f64>,
    /// Size of the picture [default: 1280x800]
    #[arg(long, value_name = "WIDTHxHEIGHT", requires = "picture", value_parser = size)]
    size: Option<[f32; 2]>,
    /// A picture light on dark
    #[arg(long, requires = "picture")]
    dark: bool,
    /// Shows the plot of this number in front; may be repeated
    #[arg(long, value_name = "N", requires = "picture")]
    plot: Vec<usize>,
}

/// Least and most points of a picture along one side.
const SIDE: std::ops::RangeInclusive<f32> = 200.0..=8_000.0;

fn size(text: &str) -> Result<[f32; 2], String> {
    let sides = text.split_once('x').and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    sides
        .filter(|sides: &[f32; 2]| sides.iter().all(|side| SIDE.contains(side)))
        .ok_or_else(|| format!("expected WIDTHxHEIGHT, each from {} to {}", SIDE.start(), SIDE.end()))
}

/// Opens it, or draws it.
pub fn run(args: Args) -> Result<(), Error> {
    let layout = match &args.layout {
        Some(path) if path.as_os_str() == "none" => None,
        Some(path) => Some(path.clone()),
        // A picture does not depend on who draws it.
        None if args.picture.is_some() => None,
        None => usual_file(),
    };
    let opening = opening(&args)?;
    let Some(path) = args.picture else {
        let duration = match args.duration {
            Some(seconds) if !(seconds > 0.0 && seconds < 1e9) => {
                return Err(Error::new(format!("--for {seconds}: expected more than 0 seconds")));
            }
            seconds => seconds.map(Duration::from_secs_f64),
        };
        return Ok(run::window(opening, layout, duration)?);
    };
    let sheet = Sheet { size: args.size.unwrap_or([1280.0, 800.0]), pixels_per_point: 1.0, dark: args.dark };
    let views = args.plot.into_iter().map(View::Plot).collect();
    let drawn = picture::draw(picture::Wanted { opening, layout, at: args.at, views, sheet })?;
    let bytes = saving::rgba(drawn.size, &drawn.pixels).map_err(Error::new)?;
    Ok(file::write(&path, &bytes)?)
}

fn opening(args: &Args) -> Result<Option<Opening>, Error> {
    let Some(what) = &args.what else { return Ok(None) };
    let path = PathBuf::from(what);
    let what = match what.parse::<Address>() {
        Ok(address) => What::Shoe(address),
        Err(error) if (what.starts_with("serial:") || what.starts_with("tcp:")) && !path.exists() => {
            return Err(Error::from(error));
        }
        Err(_) => What::Recording(path),
    };
    let usual = follow::Settings::default();
    let settings = Settings {
        tracker: args.parameters.as_deref().map(super::parameters::read).transpose()?.unwrap_or_default(),
        follow: follow::Settings {
            start: args.start.clone().unwrap_or_else(|| usual.start.clone()),
            particle: match &args.particle {
                Some(path) => toml_file::read("settings of the particle filter", path)?,
                None => particle::Parameters::default(),
            },
            ..usual
        },
        calibration: args.calibration.as_deref().map(calibration::read).transpose()?,
    };
    let profile = args.profile.as_deref().map(Profile::parse).transpose()?;
    Ok(Some(Opening { what, profile, building: args.building.clone(), settings }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_two_numbers() {
        assert_eq!(size("1280x800"), Ok([1280.0, 800.0]));
        for wrong in ["", "1280", "1280x", "0x800", "axb", "1280x99999", "NaNx800"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }
}
