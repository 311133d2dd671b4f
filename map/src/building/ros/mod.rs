//! Reads maps as robots make them (ROS map_server): an image with a description beside it. Occupied pixels become walls.
//!
//! Such a map knows neither doors nor rooms: doors are gaps. What is unknown is free.

mod contour;
mod info;
mod raster;
#[cfg(test)]
mod tests;

pub use info::{Info, is_info};

use super::error::Error;
use super::geometry::Point;
use super::model::{Building, Floor};
use raster::Raster;

/// A map of one floor.
#[derive(Clone, Debug)]
pub struct MapFile<'a> {
    /// Number of the floor.
    pub number: i32,
    /// What it is called.
    pub name: &'a str,
    /// What its description says.
    pub info: &'a Info,
    /// The image that the description names.
    pub image: &'a [u8],
    /// The name of the description in errors.
    pub file: &'a str,
}

/// The building of some maps, in the frame that their origins are given in. Floors are `storey_m` apart.
///
/// # Errors
/// When an image is none, nothing in it is occupied, or it reaches too far.
pub fn parse(name: &str, maps: &[MapFile<'_>], storey_m: f64) -> Result<Building, Error> {
    let mut building = Building { name: name.to_owned(), ..Building::default() };
    for map in maps {
        let wrong = |what: String| Error::Format { file: map.file.to_owned(), format: "map of map_server", what };
        let raster = Raster::read(map.image, map.info).map_err(wrong)?;
        let walls = contour::walls(&raster).map_err(wrong)?;
        if walls.is_empty() {
            return Err(wrong("nothing in its image is occupied".to_owned()));
        }
        let Info { resolution_m, origin: [x, y, turn], .. } = *map.info;
        let (sin, cos) = turn.sin_cos();
        let place = |[u, v]: Point| {
            let (u, v) = (u * resolution_m, v * resolution_m);
            [x + cos * u - sin * v, y + sin * u + cos * v]
        };
        building.floors.push(Floor {
            number: map.number,
            name: map.name.to_owned(),
            height_m: f64::from(map.number) * storey_m,
            walls: walls.into_iter().map(|wall| wall.map(place)).collect(),
            ..Floor::default()
        });
    }
    building.assembled()
}
