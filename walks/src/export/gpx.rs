//! A walk as GPX 1.1 (topografix.com/GPX/1/1): a track for each path.
//!
//! GPX has no floors and no metres of uncertainty; they stand in extensions, beside the time of the clock. The elevation is
//! the height above the origin of the building, which the description says.

use super::pen::escaped;
use super::walk::{Point, Walk, runs};
use crate::building::georeference::Projection;
use std::fmt::Write;

/// Of the extensions. A name, not an address.
const NAMESPACE: &str = "urn:sohle:walk:1";

/// Why there is no GPX.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoGpx {
    /// GPX knows places on the earth only.
    #[error("GPX is made of longitude and latitude, and the building is nowhere on earth: its georeference is local")]
    Local,
    /// A place beyond the surface that the building lies on.
    #[error("({x:.1}, {y:.1}) m is no place on earth")]
    Nowhere {
        /// **Units:** m; **Frame:** building.
        x: f64,
        /// The same.
        y: f64,
    },
}

/// The text of the file.
///
/// # Errors
/// For a building that is nowhere on the earth.
pub fn text(walk: &Walk<'_>) -> Result<String, NoGpx> {
    let projection = walk.projection.ok_or(NoGpx::Local)?;
    let dated = walk.live.iter().chain(&walk.corrected).all(|point| point.unix_us.is_some());
    let date = if dated { "" } else { "; the date is not known: times count from the beginning of 1970" };
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    // Writing to a string does not fail.
    let _ = write!(
        out,
        "<gpx version=\"1.1\" creator=\"sohle {}\" xmlns=\"http://www.topografix.com/GPX/1/1\" xmlns:sohle=\"{NAMESPACE}\">\n\
         <metadata><name>{}</name><desc>Elevations are metres above the origin of the building{date}</desc></metadata>\n",
        env!("CARGO_PKG_VERSION"),
        escaped(walk.name),
    );
    for (name, points) in [("live", &walk.live), ("corrected", &walk.corrected)] {
        let _ = writeln!(out, "<trk><name>{name}</name>");
        for run in runs(points) {
            out.push_str("<trkseg>\n");
            for point in run {
                put(&mut out, point, projection)?;
            }
            out.push_str("</trkseg>\n");
        }
        out.push_str("</trk>\n");
    }
    out.push_str("</gpx>\n");
    Ok(out)
}

fn put(out: &mut String, point: &Point, projection: &Projection) -> Result<(), NoGpx> {
    let [x, y, z] = point.position;
    let [longitude, latitude] = projection.to_earth([x, y]).map_err(|_| NoGpx::Nowhere { x, y })?;
    let seconds = point.time.0 as f64 * 1e-6;
    let (stamp, floor, sigma) = (point.stamp(), point.floor, point.sigma_m);
    let probability = point.said.map_or_else(String::new, |(_, probability)| {
        format!("<sohle:probability>{probability:.4}</sohle:probability>")
    });
    // Nine digits are a tenth of a millimetre.
    let _ = writeln!(
        out,
        "<trkpt lat=\"{latitude:.9}\" lon=\"{longitude:.9}\"><ele>{z:.3}</ele><time>{stamp}</time><extensions>\
         <sohle:step>{}</sohle:step><sohle:time_s>{seconds:.6}</sohle:time_s><sohle:floor>{floor}</sohle:floor>\
         <sohle:sigma_m>{sigma:.3}</sohle:sigma_m>{probability}</extensions></trkpt>",
        point.step,
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::walk::tests::{projection, walk};
    use super::*;

    #[test]
    fn another_programs_reader_finds_the_paths() {
        let projection = projection();
        let walk = walk(Some(&projection));
        let text = text(&walk).unwrap();
        let read = ::gpx::read(text.as_bytes()).unwrap();
        assert_eq!(read.metadata.unwrap().name.as_deref(), Some("A & <B>"));
        let sizes: Vec<Vec<usize>> = read
            .tracks
            .iter()
            .map(|track| track.segments.iter().map(|segment| segment.points.len()).collect())
            .collect();
        assert_eq!(sizes, [vec![2, 3], vec![6]]);
        let last = read.tracks[1].segments[0].points.last().unwrap();
        assert_eq!(last.elevation, Some(3.6));
        assert_eq!(last.time.unwrap().format().unwrap(), "2023-11-14T22:13:25.500000000Z");
        let back = projection.to_building([last.point().x(), last.point().y()]).unwrap();
        assert!((back[0] - 15.0).abs() < 1e-3 && (back[1] - 5.0).abs() < 1e-3, "{back:?}");
        assert!(text.contains("<sohle:floor>1</sohle:floor><sohle:sigma_m>0.250</sohle:sigma_m>"), "{text}");
    }

    #[test]
    fn a_building_that_is_nowhere_has_no_gpx_and_an_unknown_date_is_told() {
        assert_eq!(text(&walk(None)), Err(NoGpx::Local));
        let projection = projection();
        let mut walk = walk(Some(&projection));
        walk.live[3].unix_us = None;
        assert!(text(&walk).unwrap().contains("the date is not known"));
    }
}
