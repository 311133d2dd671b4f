//! Where the building is on the earth.

use super::error::Error;
use super::geometry::Point;
use proj4rs::Proj;
use proj4rs::transform::transform;

/// Where the origin of the building is.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Georeference {
    /// Somewhere.
    #[default]
    Local,
    /// In a UTM zone (WGS 84), 0.4 per mille too long or too short at most.
    Utm {
        /// EPSG code: 326 and the zone in the north, 327 and the zone in the south.
        epsg: u32,
        /// Easting and northing of the origin. **Units:** m.
        origin: [f64; 2],
    },
}

/// Turns longitude and latitude into the frame of the building and back.
#[derive(Debug)]
pub struct Projection {
    earth: Proj,
    zone: Proj,
    origin: [f64; 2],
}

impl Georeference {
    /// The UTM zone of a place, with its origin there, rounded to metres. **Units:** degrees.
    ///
    /// # Errors
    /// For places that are none, and beyond 84 degrees of latitude, where there are no zones.
    pub fn around(longitude: f64, latitude: f64) -> Result<Self, Error> {
        if !((-180.0..=180.0).contains(&longitude) && (-84.0..=84.0).contains(&latitude)) {
            return Err(Error::Model(format!(
                "longitude {longitude} and latitude {latitude} are no place in a UTM zone: are they swapped, or in metres?"
            )));
        }
        let zone = (((longitude + 180.0) / 6.0).floor() as u32 + 1).min(60);
        let epsg = if latitude < 0.0 { 32_700 } else { 32_600 } + zone;
        let unmoved = Self::Utm { epsg, origin: [0.0; 2] };
        let Some(projection) = unmoved.projection()? else { return Ok(unmoved) };
        let origin = projection.to_building([longitude, latitude])?.map(f64::round);
        Ok(Self::Utm { epsg, origin })
    }

    /// The way from longitude and latitude; nothing for a building that is somewhere.
    ///
    /// # Errors
    /// For an EPSG code that is no UTM zone.
    pub fn projection(&self) -> Result<Option<Projection>, Error> {
        let Self::Utm { epsg, origin } = *self else { return Ok(None) };
        let (zone, south) = match epsg {
            32_601..=32_660 => (epsg - 32_600, ""),
            32_701..=32_760 => (epsg - 32_700, " +south"),
            _ => return Err(Error::Model(format!("EPSG {epsg} is no UTM zone of WGS 84 (326zz, 327zz)"))),
        };
        let proj =
            |text: &str| Proj::from_proj_string(text).map_err(|error| Error::Model(format!("EPSG {epsg}: {error}")));
        Ok(Some(Projection {
            earth: proj("+proj=longlat +datum=WGS84 +no_defs")?,
            zone: proj(&format!("+proj=utm +zone={zone}{south} +datum=WGS84 +units=m +no_defs"))?,
            origin,
        }))
    }
}

impl Projection {
    /// From longitude and latitude in degrees.
    ///
    /// # Errors
    /// For what is no place, or too far from the zone.
    pub fn to_building(&self, [longitude, latitude]: Point) -> Result<Point, Error> {
        let mut point = (longitude.to_radians(), latitude.to_radians(), 0.0);
        let bad = || {
            Error::Model(format!(
                "longitude {longitude} and latitude {latitude} are no place near the building: are they swapped, or in metres?"
            ))
        };
        if !(longitude.abs() <= 180.0 && latitude.abs() <= 90.0) {
            return Err(bad());
        }
        transform(&self.earth, &self.zone, &mut point).map_err(|_| bad())?;
        let place = [point.0 - self.origin[0], point.1 - self.origin[1]];
        if place.iter().all(|value| value.is_finite()) { Ok(place) } else { Err(bad()) }
    }

    /// To longitude and latitude in degrees.
    ///
    /// # Errors
    /// For what is no place of the zone.
    pub fn to_earth(&self, [x, y]: Point) -> Result<Point, Error> {
        let mut point = (x + self.origin[0], y + self.origin[1], 0.0);
        transform(&self.zone, &self.earth, &mut point)
            .map_err(|error| Error::Model(format!("({x}, {y}) m is no place of the zone: {error}")))?;
        Ok([point.0.to_degrees(), point.1.to_degrees()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zone_32_is_where_the_survey_has_it() {
        // 53.54 north, 10.005 east: PROJ (cs2cs EPSG:4326 EPSG:32632) is the reference to be matched to a centimetre.
        let georeference = Georeference::Utm { epsg: 32_632, origin: [0.0; 2] };
        let projection = georeference.projection().unwrap().unwrap();
        let [east, north] = projection.to_building([9.0, 0.0]).unwrap();
        assert!((east - 500_000.0).abs() < 1e-3 && north.abs() < 1e-3);
        // Along the middle meridian a degree of latitude from 53 to 54 is 111.2765 km on WGS 84, times 0.9996.
        let [_, from] = projection.to_building([9.0, 53.0]).unwrap();
        let [_, to] = projection.to_building([9.0, 54.0]).unwrap();
        assert!(((to - from) / 0.9996 - 111_276.0).abs() < 30.0, "{}", (to - from) / 0.9996);
    }

    #[test]
    fn there_and_back_is_the_same_place() {
        for [longitude, latitude] in [[10.005, 53.5404], [-70.2, -33.4], [179.9, 1.0]] {
            let georeference = Georeference::around(longitude, latitude).unwrap();
            let projection = georeference.projection().unwrap().unwrap();
            let place = projection.to_building([longitude, latitude]).unwrap();
            assert!(place[0].abs() < 1.0 && place[1].abs() < 1.0, "{place:?}");
            let [lon, lat] = projection.to_earth([place[0] + 30.0, place[1] - 20.0]).unwrap();
            let back = projection.to_building([lon, lat]).unwrap();
            assert!((back[0] - place[0] - 30.0).abs() < 1e-4 && (back[1] - place[1] + 20.0).abs() < 1e-4);
        }
    }

    #[test]
    fn what_is_no_place_is_refused() {
        assert!(
            Georeference::around(566_578.7, 5_932_830.4).unwrap_err().to_string().contains("swapped, or in metres")
        );
        let projection = Georeference::around(10.0, 53.0).unwrap().projection().unwrap().unwrap();
        assert!(projection.to_building([f64::NAN, 53.0]).is_err());
        assert!(Georeference::Utm { epsg: 4_326, origin: [0.0; 2] }.projection().is_err());
    }
}
