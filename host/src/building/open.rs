//! Opens a building of any format: recognises the format by the content, and reads the files that belong together.

use super::error::Error;
use super::hcu::FloorFile;
use super::model::Building;
use super::{geojson, hcu, xyz10};
use std::fs;
use std::path::{Path, PathBuf};

/// A format that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// The project's own GeoJSON
    Sohle,
    /// GeoJSON with IFC classes as poslab (HCU Hamburg) has it: a file for each floor, or a folder of them
    Hcu,
    /// A floor's folder of the indoor-location competition 2020: geojson_map.json and floor_info.json
    Xyz10,
}

/// What files may leave open.
#[derive(Clone, Debug)]
pub struct Options {
    /// Read as this, whatever it looks like.
    pub format: Option<Format>,
    /// From floor to floor, where the format has no heights. **Units:** m.
    pub storey_m: f64,
}

impl Default for Options {
    fn default() -> Self {
        // Offices and schools have 3 to 4 m.
        Self { format: None, storey_m: 3.5 }
    }
}

/// The largest file that is read. **Units:** bytes.
const LARGEST: u64 = 200_000_000;

/// The building in a file or folder.
///
/// # Errors
/// When it cannot be read, is of no known format, or makes no building.
pub fn open(path: &Path, options: &Options) -> Result<Building, Error> {
    let format = match options.format {
        Some(format) => format,
        None => recognise(path)?,
    };
    match format {
        Format::Sohle => geojson::parse(&text(path)?, &shown(path)),
        Format::Hcu => open_hcu(path, options),
        Format::Xyz10 => open_xyz10(path),
    }
}

/// Which format it is, by what is in it.
fn recognise(path: &Path) -> Result<Format, Error> {
    if path.is_dir() {
        let has = |name: &str| path.join(name).is_file();
        if has(XYZ10_MAP) && has(XYZ10_INFO) {
            return Ok(Format::Xyz10);
        }
        return match files(path, "geojson")?.first() {
            Some(first) if text(first)?.contains("\"ifc_class\"") => Ok(Format::Hcu),
            _ => Err(unknown(path, "the folder holds neither floors with IFC classes nor a floor_info.json")),
        };
    }
    let text = text(path)?;
    if text.contains("\"sohle_building\"") {
        Ok(Format::Sohle)
    } else if text.contains("\"ifc_class\"") {
        Ok(Format::Hcu)
    } else if path.file_name().is_some_and(|name| name == XYZ10_MAP) {
        Ok(Format::Xyz10)
    } else {
        Err(unknown(path, "nothing in it tells which format it is; --format does"))
    }
}

fn unknown(path: &Path, what: &str) -> Error {
    Error::Format { file: shown(path), format: "building", what: what.to_owned() }
}

/// As messages name it.
fn shown(path: &Path) -> String {
    path.display().to_string()
}

/// What a building is called if its files do not tell.
fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "building".to_owned(), |stem| stem.to_string_lossy().into_owned())
}

fn bytes(path: &Path) -> Result<Vec<u8>, Error> {
    let failed = |source| Error::File { file: shown(path), source };
    let length = fs::metadata(path).map_err(failed)?.len();
    if length > LARGEST {
        return Err(unknown(path, &format!("it has {length} bytes, more than {LARGEST}")));
    }
    fs::read(path).map_err(failed)
}

fn text(path: &Path) -> Result<String, Error> {
    String::from_utf8(bytes(path)?).map_err(|_| unknown(path, "it is no text (UTF-8)"))
}

/// The files of a folder with an ending, sorted by name.
fn files(folder: &Path, ending: &str) -> Result<Vec<PathBuf>, Error> {
    let failed = |source| Error::File { file: shown(folder), source };
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(ending)) && path.is_file() {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// The number of a floor by what people call it, in German and English: `EG` 0, `1OG` 1, `2UG` -2, `F3` and `L3` 3, `B1` -1.
pub fn floor_number(name: &str) -> Option<i32> {
    let name = name.trim().to_uppercase();
    let digits: String = name.chars().filter(char::is_ascii_digit).collect();
    let letters: String = name.chars().filter(|character| character.is_alphabetic()).collect();
    let number: Option<i32> = if digits.is_empty() { Some(1) } else { digits.parse().ok() };
    let has_digits = !digits.is_empty();
    match &letters[..] {
        "EG" | "GF" | "G" | "ERDGESCHOSS" if !has_digits => Some(0),
        "OG" | "OBERGESCHOSS" => number,
        "UG" | "KG" | "B" | "UNTERGESCHOSS" => number.map(|number| -number),
        "F" | "L" | "LEVEL" | "FLOOR" | "" if has_digits => {
            number.map(|number| if name.starts_with('-') { -number } else { number })
        }
        _ => None,
    }
}

fn open_hcu(path: &Path, options: &Options) -> Result<Building, Error> {
    let paths = if path.is_dir() { files(path, "geojson")? } else { vec![path.to_owned()] };
    let mut floors = Vec::new();
    for path in &paths {
        let name = stem(path);
        let number = floor_number(&name)
            .ok_or_else(|| unknown(path, "the name of the file must be that of the floor, as EG, 1OG or 2UG"))?;
        floors.push((number, name, shown(path), text(path)?));
    }
    floors.sort_by_key(|floor| floor.0);
    let files: Vec<_> = floors
        .iter()
        .map(|(number, name, file, text)| FloorFile {
            number: *number,
            name,
            height_m: f64::from(*number) * options.storey_m,
            text,
            file,
        })
        .collect();
    hcu::parse(&stem(path), &files)
}

const XYZ10_MAP: &str = "geojson_map.json";
const XYZ10_INFO: &str = "floor_info.json";

fn open_xyz10(path: &Path) -> Result<Building, Error> {
    let folder = if path.is_dir() { path } else { path.parent().unwrap_or(Path::new(".")) };
    let folder_name = fs::canonicalize(folder).map_or_else(|_| stem(folder), |folder| stem(&folder));
    let map = folder.join(XYZ10_MAP);
    let number = floor_number(&folder_name).unwrap_or(0);
    xyz10::parse(&folder_name, number, &text(&map)?, &text(&folder.join(XYZ10_INFO))?, &shown(&map))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::{ConnectorKind, Floor, Georeference, Room};
    use crate::recording::recordings_dir;

    /// A folder of the recordings, if they are there.
    fn recorded(path: &str) -> Option<PathBuf> {
        let found = recordings_dir().map(|folder| folder.join(path)).filter(|path| path.exists());
        if found.is_none() {
            println!("skipped: no recordings");
        }
        found
    }

    #[test]
    fn floors_have_numbers_by_name() {
        let known = [("EG", 0), ("1OG", 1), ("4. OG", 4), ("2UG", -2), ("UG", -1), ("F3", 3), ("B1", -1), ("-2", -2)];
        for (name, number) in known {
            assert_eq!(floor_number(name), Some(number), "{name}");
        }
        for name in ["", "roof", "F", "99999999999OG"] {
            assert_eq!(floor_number(name), None, "{name}");
        }
    }

    #[test]
    fn the_university_has_three_floors_and_surveyed_places_lie_in_its_corridors() {
        let Some(folder) = recorded("hcu_hamburg") else { return };
        let building = open(&folder.join("floorplans"), &Options::default()).unwrap();
        let numbers: Vec<_> = building.floors.iter().map(|floor| floor.number).collect();
        assert_eq!(numbers, [0, 1, 4]);
        let Georeference::Utm { epsg, origin } = building.georeference else { panic!("no zone") };
        assert_eq!(epsg, 32_632);
        // Surveyed places where somebody walked, in the same zone.
        let table = fs::read_to_string(folder.join("eight_walk/demo_waypoints.csv")).unwrap();
        let places: Vec<[f64; 2]> = table
            .lines()
            .skip(1)
            .map(|line| {
                let values: Vec<f64> = line.split_whitespace().map(|value| value.parse().unwrap()).collect();
                [values[1] - origin[0], values[2] - origin[1]]
            })
            .collect();
        let floor = building.floor(4).unwrap();
        assert_eq!(places.len(), 13);
        let rooms: Vec<_> = places.iter().filter_map(|place| floor.room_at(*place)).collect();
        assert_eq!(rooms.len(), places.len());
        // `F` are corridors (Flure). The places are given to a decimetre and lie at corners, some of them in a stairwell
        // or a store beside the corridor.
        let corridors = rooms.iter().filter(|room| room.name.starts_with("4 F")).count();
        assert!(corridors * 4 >= places.len() * 3, "{corridors} of {rooms:?}");
        let stairs = building.connectors.iter().filter(|connector| connector.kind == ConnectorKind::Stairs).count();
        assert!(stairs > 2, "{stairs} staircases");
    }

    #[test]
    fn the_mall_has_shops_and_walkers_stay_between_them() {
        for (name, walk, shops) in [("F1", "5dd9ef979191710006b57086", 172), ("F4", "5ddb6558c5b77e0006b17918", 123)] {
            let Some(folder) = recorded(&format!("xyz10_mall/site1/{name}")) else { return };
            let building = open(&folder, &Options::default()).unwrap();
            assert_eq!(building, open(&folder.join(XYZ10_MAP), &Options::default()).unwrap());
            let floor: &Floor = &building.floors[0];
            assert_eq!((floor.name.as_str(), floor.rooms.len()), (name, shops));
            let text = fs::read_to_string(folder.join(format!("{walk}.txt"))).unwrap();
            let points: Vec<[f64; 2]> = text
                .lines()
                .filter_map(|line| {
                    let mut fields = line.split('\t').skip_while(|field| *field != "TYPE_WAYPOINT").skip(1);
                    Some([fields.next()?.parse().ok()?, fields.next()?.parse().ok()?])
                })
                .collect();
            assert!(points.len() > 4);
            let in_shop = |point: &&[f64; 2]| floor.room_at(**point).map(|room: &Room| &room.name).is_some();
            let inside = points.iter().filter(in_shop).count();
            // Most of the walk is in the corridors; what the shops are called decides nothing.
            assert!(inside * 4 <= points.len(), "{inside} of {} in {name}", points.len());
        }
    }

    #[test]
    fn what_is_no_building_is_told() {
        let home = tempfile::tempdir().unwrap();
        let message = |name: &str| open(&home.path().join(name), &Options::default()).unwrap_err().to_string();
        assert!(message("absent.geojson").ends_with("absent.geojson cannot be read"));
        fs::write(home.path().join("noise"), [0, 159, 146, 150]).unwrap();
        assert!(message("noise").ends_with("it is no text (UTF-8)"));
        fs::write(home.path().join("empty"), "").unwrap();
        assert!(message("empty").contains("nothing in it tells which format"));
        fs::create_dir(home.path().join("folder")).unwrap();
        assert!(message("folder").contains("the folder holds neither"));
        let floor = r#"{"type":"FeatureCollection","features":[{"type":"Feature","properties":{"ifc_class":"IfcWall"},"geometry":null}]}"#;
        fs::write(home.path().join("plan.geojson"), floor).unwrap();
        assert!(message("plan.geojson").contains("must be that of the floor"));
        fs::write(home.path().join("EG.geojson"), floor).unwrap();
        assert_eq!(message("EG.geojson"), "the building has no floors");
    }
}
