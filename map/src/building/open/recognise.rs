//! Tells the format of a building by what is in the file or folder.

use super::{Format, XYZ10_INFO, XYZ10_MAP, bytes, files, text, unknown};
use crate::building::error::Error;
use crate::building::{dxf, ros};
use std::path::Path;

/// Which format it is.
///
/// # Errors
/// When nothing tells, or it cannot be read.
pub(super) fn recognise(path: &Path) -> Result<Format, Error> {
    if path.is_dir() { of_folder(path) } else { of_file(path) }
}

fn of_folder(path: &Path) -> Result<Format, Error> {
    let has = |name: &str| path.join(name).is_file();
    if has(XYZ10_MAP) && has(XYZ10_INFO) {
        return Ok(Format::Xyz10);
    }
    if has("level.geojson") && has("unit.geojson") {
        return Ok(Format::Imdf);
    }
    if let Some(first) = files(path, "geojson")?.first()
        && text(first)?.contains("\"ifc_class\"")
    {
        return Ok(Format::Hcu);
    }
    if !files(path, "dxf")?.is_empty() {
        return Ok(Format::Dxf);
    }
    if let Some(first) = files(path, "yaml")?.first()
        && ros::is_info(&text(first)?)
    {
        return Ok(Format::Ros);
    }
    Err(unknown(
        path,
        "the folder holds neither floors with IFC classes, in DXF or as maps, nor a floor_info.json or a unit.geojson",
    ))
}

fn of_file(path: &Path) -> Result<Format, Error> {
    let bytes = bytes(path)?;
    if bytes.starts_with(b"PK\x03\x04") {
        return Err(unknown(path, "it is an archive: unpack it and name the folder"));
    }
    if dxf::is_dxf(&bytes) {
        return Ok(Format::Dxf);
    }
    let text = String::from_utf8(bytes).map_err(|_| unknown(path, "it is no text (UTF-8)"))?;
    if text.contains("\"sohle_building\"") {
        Ok(Format::Sohle)
    } else if text.contains("\"ifc_class\"") {
        Ok(Format::Hcu)
    } else if path.file_name().is_some_and(|name| name == XYZ10_MAP) {
        Ok(Format::Xyz10)
    } else if text.contains("\"feature_type\"") {
        Ok(Format::Imdf)
    } else if text.trim_start_matches('\u{feff}').trim_start().starts_with('<') && text.contains("<osm") {
        Ok(Format::Osm)
    } else if ros::is_info(&text) {
        Ok(Format::Ros)
    } else {
        Err(unknown(path, "nothing in it tells which format it is; --format does"))
    }
}
