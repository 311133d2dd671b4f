//! Where what is said of somebody goes, beside the folder of results: files, the standard output, clients.

use crate::building::georeference::Projection;
use crate::cli::{Error, print};
use crate::export::walk::{Point, Walk};
use crate::export::{ExportError, file, gpx, walk_geojson};
use crate::follow::Follower;
use crate::serve::Server;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Outputs that can be asked for.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct Wanted {
    /// Writes the path with time, floor and uncertainty, as it was said and corrected: .geojson or .gpx; may be repeated
    #[arg(long, value_name = "FILE.geojson|FILE.gpx")]
    pub track: Vec<PathBuf>,
    /// Writes what is said after each step, a JSON object to a line, as it is said; '-' is the standard output, which has
    /// nothing else then
    #[arg(long, value_name = "FILE|-")]
    pub places: Option<PathBuf>,
    /// Gives the same lines to WebSocket clients, as they come; a port alone is open to this machine only
    #[arg(long, value_name = "[HOST:]PORT")]
    pub serve: Option<String>,
}

impl Wanted {
    /// Whether the standard output belongs to the lines.
    pub fn takes_stdout(&self) -> bool {
        self.places.as_deref() == Some(Path::new("-"))
    }

    /// Opens what is to be written while it goes on, and refuses what cannot be written at the end.
    pub fn open(&self, projection: Option<&Projection>) -> Result<Outputs, Error> {
        for path in &self.track {
            match extension(path).as_str() {
                "geojson" | "json" => {}
                "gpx" if projection.is_some() => {}
                "gpx" => {
                    return Err(Error::new(format!(
                        "--track {}: {}; write .geojson, or give the building a georeference (docs/building.md)",
                        path.display(),
                        gpx::NoGpx::Local
                    )));
                }
                _ => return Err(Error::new(format!("--track {}: expected .geojson or .gpx", path.display()))),
            }
        }
        let server = self.serve.as_deref().map(Server::start).transpose()?;
        if let Some(server) = &server {
            eprintln!("places are served at ws://{}", server.address());
        }
        let places = match &self.places {
            Some(_) if self.takes_stdout() => Some(Sink::Stdout),
            Some(path) => {
                let refused = |source| ExportError::Write { path: path.clone(), source };
                Some(Sink::File(File::create(path).map_err(refused)?, path.clone()))
            }
            None => None,
        };
        Ok(Outputs { tracks: self.track.clone(), places, server })
    }
}

fn extension(path: &Path) -> String {
    path.extension().and_then(|extension| extension.to_str()).unwrap_or_default().to_ascii_lowercase()
}

enum Sink {
    Stdout,
    File(File, PathBuf),
}

/// Those that are open.
pub struct Outputs {
    tracks: Vec<PathBuf>,
    places: Option<Sink>,
    server: Option<Server>,
}

impl Outputs {
    /// Hands on a line, without its end. A file that takes no more is closed, and that is told once.
    pub fn line(&mut self, line: &str) {
        if let Some(server) = &self.server {
            server.tell(line);
        }
        let line = format!("{line}\n");
        let fault = match &mut self.places {
            Some(Sink::Stdout) => print(&line).err().map(|error| error.to_string()),
            Some(Sink::File(file, path)) => {
                file.write_all(line.as_bytes()).err().map(|error| format!("cannot write {}: {error}", path.display()))
            }
            None => None,
        };
        if let Some(fault) = fault {
            eprintln!("{fault}; no more places are written to it");
            self.places = None;
        }
    }

    /// Writes the tracks and takes leave of the clients.
    pub fn finish(self, walk: &Walk<'_>) -> Result<(), Error> {
        if let Some(server) = self.server {
            let dropped = server.dropped();
            if dropped > 0 {
                eprintln!("{dropped} lines were not sent to clients that read too slowly");
            }
            server.finish();
        }
        for path in &self.tracks {
            let text = if extension(path) == "gpx" { gpx::text(walk)? } else { walk_geojson::text(walk) };
            file::write(path, text.as_bytes())?;
        }
        Ok(())
    }
}

/// The walk for the exports. `unix_us` has the date of each step that was followed, where it is known.
pub fn walk<'a>(follower: &'a Follower, unix_us: &[Option<i64>], projection: Option<&'a Projection>) -> Walk<'a> {
    let building = follower.building();
    let path = follower.path();
    let live = path.iter().zip(unix_us).filter_map(|(followed, &unix_us)| {
        let place = followed.place.as_ref()?;
        Some(Point {
            step: followed.step,
            time: followed.time,
            unix_us,
            floor: place.floor,
            position: place.position.into(),
            sigma_m: place.sigma_m,
            said: Some((followed.state, place.probability)),
        })
    });
    // Numbers of steps begin anew when the shoe does: each is looked for behind the one before.
    let mut from = 0;
    let corrected = follower.past().into_iter().filter_map(|past| {
        let at = from + path.get(from..)?.iter().position(|followed| followed.step == past.step)?;
        from = at + 1;
        Some(Point {
            step: past.step,
            time: path[at].time,
            unix_us: unix_us.get(at).copied().flatten(),
            floor: building.floors.get(past.floor)?.number,
            position: past.position,
            sigma_m: past.sigma_m,
            said: None,
        })
    });
    Walk { name: &building.name, projection, live: live.collect(), corrected: corrected.collect() }
}
