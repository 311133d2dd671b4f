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
    /// On the plane that touches WGS 84 at an origin: less than a centimetre wrong within a kilometre, nothing stretched.
    Geographic {
        /// Longitude and latitude of the origin. **Units:** degrees.
        origin: [f64; 2],
        /// From east to the x axis, counter-clockwise from above. **Units:** degrees.
        rotation_deg: f64,
    },
}

/// Equatorial radius and squared eccentricity of the WGS 84 ellipsoid. **Units:** m; 1.
const WGS84_RADIUS_M: f64 = 6_378_137.0;
const WGS84_ECCENTRICITY_2: f64 = 6.694_379_990_14e-3;

/// Turns longitude and latitude into the frame of the building and back.
#[derive(Debug)]
pub struct Projection(Surface);

/// What the frame of the building lies on.
#[derive(Debug)]
enum Surface {
    /// A UTM zone; boxed because it is large.
    Zone(Box<Zone>),
    /// The plane that touches the ellipsoid at a place.
    Plane { origin: [f64; 2], metres: [f64; 2], sin: f64, cos: f64 },
}

#[derive(Debug)]
struct Zone {
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
    /// For an EPSG code that is no UTM zone, and for an origin that is no place.
    pub fn projection(&self) -> Result<Option<Projection>, Error> {
        let (epsg, origin) = match *self {
            Self::Local => return Ok(None),
            Self::Geographic { origin, rotation_deg } => return Ok(Some(plane(origin, rotation_deg)?)),
            Self::Utm { epsg, origin } => (epsg, origin),
        };
        if !origin.iter().all(|value| value.is_finite()) {
            return Err(Error::Model(format!("the origin {origin:?} is no place in a UTM zone")));
        }
        let (zone, south) = match epsg {
            32_601..=32_660 => (epsg - 32_600, ""),
            32_701..=32_760 => (epsg - 32_700, " +south"),
            _ => return Err(Error::Model(format!("EPSG {epsg} is no UTM zone of WGS 84 (326zz, 327zz)"))),
        };
        let proj =
            |text: &str| Proj::from_proj_string(text).map_err(|error| Error::Model(format!("EPSG {epsg}: {error}")));
        Ok(Some(Projection(Surface::Zone(Box::new(Zone {
            earth: proj("+proj=longlat +datum=WGS84 +no_defs")?,
            zone: proj(&format!("+proj=utm +zone={zone}{south} +datum=WGS84 +units=m +no_defs"))?,
            origin,
        })))))
    }
}

/// The plane that touches the ellipsoid at `origin`. Near the poles it is of no use.
fn plane(origin: [f64; 2], rotation_deg: f64) -> Result<Projection, Error> {
    let [longitude, latitude] = origin;
    if !(longitude.abs() <= 180.0 && latitude.abs() <= 84.0) {
        return Err(Error::Model(format!(
            "the origin has longitude {longitude} and latitude {latitude}; expected degrees up to 180 and 84, in this order"
        )));
    }
    if rotation_deg.is_nan() || rotation_deg.abs() > 360.0 {
        return Err(Error::Model(format!("the building is turned by {rotation_deg} degrees; expected up to 360")));
    }
    let latitude = latitude.to_radians();
    let flattening = 1.0 - WGS84_ECCENTRICITY_2 * latitude.sin().powi(2);
    let along_parallel = WGS84_RADIUS_M / flattening.sqrt();
    let along_meridian = along_parallel * (1.0 - WGS84_ECCENTRICITY_2) / flattening;
    let metres = [along_parallel * latitude.cos(), along_meridian].map(f64::to_radians);
    let (sin, cos) = rotation_deg.to_radians().sin_cos();
    Ok(Projection(Surface::Plane { origin, metres, sin, cos }))
}

/// The same longitude within 180 degrees.
fn around(longitude: f64) -> f64 {
    if longitude.abs() <= 180.0 { longitude } else { (longitude + 180.0).rem_euclid(360.0) - 180.0 }
}

impl Projection {
    /// From longitude and latitude in degrees.
    ///
    /// # Errors
    /// For what is no place, or too far from the zone.
    pub fn to_building(&self, [longitude, latitude]: Point) -> Result<Point, Error> {
        let bad = || {
            Error::Model(format!(
                "longitude {longitude} and latitude {latitude} are no place near the building: are they swapped, or in metres?"
            ))
        };
        if !(longitude.abs() <= 180.0 && latitude.abs() <= 90.0) {
            return Err(bad());
        }
        let place = match &self.0 {
            Surface::Zone(zone) => {
                let mut point = (longitude.to_radians(), latitude.to_radians(), 0.0);
                transform(&zone.earth, &zone.zone, &mut point).map_err(|_| bad())?;
                [point.0 - zone.origin[0], point.1 - zone.origin[1]]
            }
            Surface::Plane { origin, metres, sin, cos } => {
                let east = around(longitude - origin[0]) * metres[0];
                let north = (latitude - origin[1]) * metres[1];
                [cos * east + sin * north, cos * north - sin * east]
            }
        };
        if place.iter().all(|value| value.is_finite()) { Ok(place) } else { Err(bad()) }
    }

    /// To longitude and latitude in degrees.
    ///
    /// # Errors
    /// For what is no place of the zone.
    pub fn to_earth(&self, [x, y]: Point) -> Result<Point, Error> {
        match &self.0 {
            Surface::Zone(zone) => {
                let mut point = (x + zone.origin[0], y + zone.origin[1], 0.0);
                transform(&zone.zone, &zone.earth, &mut point)
                    .map_err(|error| Error::Model(format!("({x}, {y}) m is no place of the zone: {error}")))?;
                Ok([point.0.to_degrees(), point.1.to_degrees()])
            }
            Surface::Plane { origin, metres, sin, cos } => {
                let (east, north) = (cos * x - sin * y, sin * x + cos * y);
                Ok([around(origin[0] + east / metres[0]), origin[1] + north / metres[1]])
            }
        }
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
    fn a_turned_plane_points_where_it_says() {
        let north =
            Georeference::Geographic { origin: [10.0, 45.0], rotation_deg: 90.0 }.projection().unwrap().unwrap();
        // A minute of latitude is a nautical mile, 1852 m; at 45 degrees within 0.1 %.
        let [longitude, latitude] = north.to_earth([1852.0, 0.0]).unwrap();
        assert!((longitude - 10.0).abs() < 1e-9 && ((latitude - 45.0) * 60.0 - 1.0).abs() < 1e-3, "{latitude}");
        let dateline = Georeference::Geographic { origin: [179.9999, 1.0], rotation_deg: 30.0 };
        let dateline = dateline.projection().unwrap().unwrap();
        let beyond = dateline.to_earth([100.0, 0.0]).unwrap();
        assert!(beyond[0] < -179.9, "{beyond:?}");
        let back = dateline.to_building(beyond).unwrap();
        assert!((back[0] - 100.0).abs() < 1e-6 && back[1].abs() < 1e-6, "{back:?}");
    }

    #[test]
    fn the_plane_and_the_zone_agree_where_both_apply() {
        // On the middle meridian of a zone its grid points north, and is 0.4 per mille too small.
        let plane = Georeference::Geographic { origin: [9.0, 53.5], rotation_deg: 0.0 }.projection().unwrap().unwrap();
        let unmoved = Georeference::Utm { epsg: 32_632, origin: [0.0; 2] }.projection().unwrap().unwrap();
        let origin = unmoved.to_building([9.0, 53.5]).unwrap();
        let place = unmoved.to_building(plane.to_earth([100.0, -50.0]).unwrap()).unwrap();
        let (x, y) = (place[0] - origin[0] - 99.96, place[1] - origin[1] + 49.98);
        // The plane is wrong by a millimetre at a hundred metres.
        assert!(x.hypot(y) < 2e-3, "{x} {y}");
    }

    #[test]
    fn what_is_no_place_is_refused() {
        assert!(
            Georeference::around(566_578.7, 5_932_830.4).unwrap_err().to_string().contains("swapped, or in metres")
        );
        let projection = Georeference::around(10.0, 53.0).unwrap().projection().unwrap().unwrap();
        assert!(projection.to_building([f64::NAN, 53.0]).is_err());
        assert!(Georeference::Utm { epsg: 4_326, origin: [0.0; 2] }.projection().is_err());
        assert!(Georeference::Utm { epsg: 32_632, origin: [f64::NAN; 2] }.projection().is_err());
        for (origin, rotation_deg) in [([53.5, 100.0], 0.0), ([f64::NAN, 0.0], 0.0), ([0.0, 0.0], f64::INFINITY)] {
            assert!(Georeference::Geographic { origin, rotation_deg }.projection().is_err(), "{origin:?}");
        }
    }
}
