//! What a tracked walk leaves behind: pictures, GeoJSON and tables in a folder.
//!
//! Everything is a function of the track alone: no date, no machine name, no order of a hash map, so that the same walk
//! writes the same bytes. Each file is complete or absent ([`mod@file`]).

pub mod file;
pub mod geojson;
pub mod gpx;
pub(crate) mod pen;
pub mod picture;
pub mod plan;
pub mod png;
pub(crate) mod scale;
pub mod steps_csv;
pub mod svg;
pub mod walk;
pub mod walk_geojson;

use crate::track::Track;
use picture::{Picture, Placement, Role};
use std::path::{Path, PathBuf};

/// Why an output could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The system refused a file or a folder.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Which file or folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The picture could not be turned into pixels.
    #[error("the picture cannot be drawn: {0}")]
    Draw(String),
}

/// A track, how it came about, and where it belongs.
#[derive(Clone, Copy, Debug)]
pub struct Named<'a> {
    /// Which settings made it; appended to file names unless it is [`Role::Chosen`].
    pub role: Role,
    /// The settings in a word, for people.
    pub label: &'a str,
    /// The track.
    pub track: &'a Track,
    /// The settings as TOML.
    pub parameters: &'a str,
    /// From the frame of the track to that of the picture.
    pub placement: Placement,
}

/// Writes picture, map features, steps and settings of every track into `folder`, which is made if it is not there.
/// Returns the names of the files, in the order written. Files of the same names are replaced, others left alone.
pub fn write_all(
    folder: &Path,
    picture: &Picture,
    tracks: &[Named<'_>],
    origin: Option<geojson::Origin>,
) -> Result<Vec<String>, ExportError> {
    file::folder(folder)?;
    let drawing = svg::draw(picture);
    let mut files = vec![
        ("track.svg".to_owned(), drawing.clone().into_bytes()),
        ("track.png".to_owned(), png::render(&drawing)?),
        ("track.geojson".to_owned(), geojson::collection(picture, tracks, origin).into_bytes()),
    ];
    for named in tracks {
        let suffix = match named.role {
            Role::Chosen => "",
            Role::Documented => "_documented",
            Role::Truth => "_truth",
        };
        files.push((format!("steps{suffix}.csv"), steps_csv::table(named.track).into_bytes()));
        files.push((format!("parameters{suffix}.toml"), named.parameters.as_bytes().to_vec()));
    }
    for (name, bytes) in &files {
        file::write(&folder.join(name), bytes)?;
    }
    Ok(files.into_iter().map(|(name, _)| name).collect())
}

#[cfg(test)]
pub(crate) mod synthetic {
    //! Tracks made up for the tests of this module.
    use crate::track::Track;
    use nalgebra::{Matrix4, Vector3};
    use sohle_shared::sample::ClippedSamples;
    use sohle_shared::step::{FloorMode, Step, StepQuality};
    use sohle_shared::time::Micros;

    /// Around a square, then up a flight of stairs: `strides` strides of 1.3 m, the last fifth of them on stairs.
    pub fn square_and_stairs(strides: u32) -> Track {
        let mut track = Track::default();
        for index in 0..=strides {
            let stairs = index * 5 > strides * 4;
            let (forward, up) = match (index, stairs) {
                (0, _) => (0.0, 0.0),
                (_, true) => (0.6, 0.34),
                (_, false) => (1.3, 0.0),
            };
            let turn = if index > 0 && index % 10 == 0 && !stairs { core::f32::consts::FRAC_PI_2 } else { 0.0 };
            track.add(Step {
                index,
                stance_start: Micros(i64::from(index) * 1_100_000),
                stance_end: Micros(i64::from(index) * 1_100_000 + 450_000),
                displacement: Vector3::new(forward, 0.0, up),
                turn,
                covariance: Matrix4::from_diagonal_element(1e-4),
                mode: if stairs { FloorMode::Stairs } else { FloorMode::Level },
                quality: StepQuality { gyro_clipped: index == 3, ..StepQuality::default() },
                clipped: ClippedSamples { accel: 0, gyro: if index == 3 { 7 } else { 0 } },
            });
        }
        track
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_earlier_run_is_replaced_file_by_file_and_the_rest_stays() {
        let track = synthetic::square_and_stairs(50);
        let named = Named {
            role: Role::Chosen,
            label: "default",
            track: &track,
            parameters: "",
            placement: Placement::default(),
        };
        let mut picture = Picture::new("Test");
        picture.lines.push(picture::Line::of(&named, Vec::new()));
        let home = tempfile::tempdir().unwrap();
        let folder = home.path().join("deep/out");
        let first = write_all(&folder, &picture, &[named], None).unwrap();
        std::fs::write(folder.join("steps.csv"), "old").unwrap();
        std::fs::write(folder.join("mine.txt"), "mine").unwrap();
        write_all(&folder, &picture, &[named], None).unwrap();
        assert!(std::fs::read_to_string(folder.join("steps.csv")).unwrap().starts_with("index,"));
        let mut found: Vec<_> = std::fs::read_dir(&folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        found.sort();
        let mut expected = first;
        expected.push("mine.txt".to_owned());
        expected.sort();
        assert_eq!(found, expected);
    }
}
