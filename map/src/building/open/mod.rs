//! Opens a building of any format: recognises the format by the content, and reads the files that belong together.

mod recognise;

use super::dxf::{self, Layers, PlanFile};
use super::error::Error;
use super::hcu::FloorFile;
use super::model::Building;
use super::{geojson, hcu, imdf, osm, ros, xyz10};
use recognise::recognise;
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
    /// OpenStreetMap XML with Simple Indoor Tagging
    Osm,
    /// DXF by layer: a file for each floor, a folder of them, or one file with the floor in the names of the layers
    Dxf,
    /// Indoor Mapping Data Format: the folder of an unpacked archive, or a file in it
    Imdf,
    /// A map of ROS map_server: a YAML file with its image, or a folder with one for each floor
    Ros,
}

/// What files may leave open.
#[derive(Clone, Debug)]
pub struct Options {
    /// Read as this, whatever it looks like.
    pub format: Option<Format>,
    /// From floor to floor, where the format has no heights. **Units:** m.
    pub storey_m: f64,
    /// What is on which layer of a DXF file.
    pub layers: Layers,
}

impl Default for Options {
    fn default() -> Self {
        // Offices and schools have 3 to 4 m.
        Self { format: None, storey_m: 3.5, layers: Layers::default() }
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
        Format::Osm => osm::parse(&stem(path), &text(path)?, &shown(path), options.storey_m),
        Format::Dxf => open_dxf(path, options),
        Format::Imdf => open_imdf(path, options),
        Format::Ros => open_ros(path, options),
    }
}

/// The names of layers in a TOML file.
///
/// # Errors
/// When it cannot be read or is no table of layers.
pub fn layers(path: &Path) -> Result<Layers, Error> {
    Layers::parse(&text(path)?, &shown(path))
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

/// Files of one floor each: number and name of the floor. One file alone may be called like the building.
fn floor_files(path: &Path, ending: &str) -> Result<Vec<(i32, String, PathBuf)>, Error> {
    let paths = if path.is_dir() { files(path, ending)? } else { vec![path.to_owned()] };
    let is_alone = paths.len() == 1;
    let floor = |path: PathBuf| {
        let name = stem(&path);
        match floor_number(&name) {
            Some(number) => Ok((number, name, path)),
            None if is_alone => Ok((0, "0".to_owned(), path)),
            None => Err(unknown(&path, "the name of the file must be that of the floor, as EG, 1OG or 2UG")),
        }
    };
    paths.into_iter().map(floor).collect()
}

fn open_dxf(path: &Path, options: &Options) -> Result<Building, Error> {
    let mut plans = Vec::new();
    for (number, name, path) in floor_files(path, "dxf")? {
        plans.push((number, name, shown(&path), bytes(&path)?));
    }
    let plans: Vec<_> =
        plans.iter().map(|(number, name, file, bytes)| PlanFile { number: *number, name, bytes, file }).collect();
    dxf::parse(&stem(path), &plans, &options.layers, options.storey_m)
}

fn open_ros(path: &Path, options: &Options) -> Result<Building, Error> {
    let mut maps = Vec::new();
    for (number, name, path) in floor_files(path, "yaml")? {
        let info = ros::Info::parse(&text(&path)?, &shown(&path))?;
        let image = bytes(&path.with_file_name(&info.image))?;
        maps.push((number, name, shown(&path), info, image));
    }
    let maps: Vec<_> = maps
        .iter()
        .map(|(number, name, file, info, image)| ros::MapFile { number: *number, name, info, image, file })
        .collect();
    ros::parse(&stem(path), &maps, options.storey_m)
}

fn open_imdf(path: &Path, options: &Options) -> Result<Building, Error> {
    let folder = if path.is_dir() { path } else { path.parent().unwrap_or(Path::new(".")) };
    let paths = imdf::KINDS.map(|kind| (kind, folder.join(format!("{kind}.geojson"))));
    let mut parts = Vec::new();
    for (kind, path) in paths.iter().filter(|(_, path)| path.is_file()) {
        parts.push((*kind, text(path)?, shown(path)));
    }
    let parts: Vec<_> = parts.iter().map(|(kind, text, file)| imdf::Part { kind, text, file }).collect();
    imdf::parse(&folder_name(folder), &parts, options.storey_m)
}

/// What a folder is called, also one that is written as a dot.
fn folder_name(folder: &Path) -> String {
    fs::canonicalize(folder).map_or_else(|_| stem(folder), |folder| stem(&folder))
}

const XYZ10_MAP: &str = "geojson_map.json";
const XYZ10_INFO: &str = "floor_info.json";

fn open_xyz10(path: &Path) -> Result<Building, Error> {
    let folder = if path.is_dir() { path } else { path.parent().unwrap_or(Path::new(".")) };
    let folder_name = folder_name(folder);
    let map = folder.join(XYZ10_MAP);
    let number = floor_number(&folder_name).unwrap_or(0);
    xyz10::parse(&folder_name, number, &text(&map)?, &text(&folder.join(XYZ10_INFO))?, &shown(&map))
}

#[cfg(test)]
mod tests;
