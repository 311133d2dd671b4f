//! The path as a file.

use crate::cli::located::walk;
use crate::export::{file, steps_csv, walk_geojson};
use crate::follow::Follower;
use crate::track::Track;
use std::path::Path;

/// Writes the path in the building as GeoJSON, or, without one, the steps as a table. What came of it.
pub fn track(path: &Path, track: &Track, follower: Option<&Follower>) -> String {
    let (path, text) = match follower {
        Some(follower) => {
            let projection = follower.building().georeference.projection().ok().flatten();
            let dates = vec![None; follower.path().len()];
            (path.to_owned(), walk_geojson::text(&walk(follower, &dates, projection.as_ref())))
        }
        None => (path.with_extension("csv"), steps_csv::table(track)),
    };
    match file::write(&path, text.as_bytes()) {
        Ok(()) => format!("the path is in {}", path.display()),
        Err(error) => error.to_string(),
    }
}
