//! A fix in the frame of the building, checked.

use super::fix::{Fix, Frame, Measured};
use crate::building::georeference::Projection;
use crate::building::{Building, Georeference};
use nalgebra::{Matrix2, Rotation2};
use sohle_shared::time::Micros;
use std::sync::Arc;

/// Clocks differ by so much; what was measured later than it arrived by more is from the future. **Units:** us.
const CLOCKS_US: i64 = 1_000_000;
/// Nobody who is tracked in a building is farther from its origin. **Units:** m.
const FARTHEST_M: f64 = 5_000.0;
/// Longest range that is one. **Units:** m.
const LONGEST_RANGE_M: f64 = 1_000.0;
/// A standard deviation outside of these is none. **Units:** m.
const SIGMAS_M: (f64, f64) = (1e-3, 1e4);
/// How far apart two places are that show where east is. **Units:** degrees.
const ASIDE_DEG: f64 = 1e-4;

/// A position or a range in the frame of the building, with a covariance that is one.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// When it was measured.
    pub time: Micros,
    /// Who says so.
    pub source: Arc<str>,
    /// **Frame:** building.
    pub measured: Measured,
    /// Number of the floor, if the source knows it.
    pub floor: Option<i32>,
}

impl Observation {
    /// A position with the same standard deviation in all directions. **Units:** m.
    pub fn position(time: Micros, place: [f64; 2], sigma_m: f64) -> Self {
        let covariance = Matrix2::identity() * (sigma_m * sigma_m);
        Self { time, source: "".into(), measured: Measured::Position { place, covariance }, floor: None }
    }
}

/// Why a fix is of no use.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Refused {
    /// Something is no number.
    #[error("{0} is no finite number")]
    NoNumber(&'static str),
    /// The building is nowhere on Earth.
    #[error("it is in the frame {0}, but the building has no georeference: expected the frame 'building'")]
    NoGeoreference(String),
    /// Nothing is known of the frame.
    #[error(
        "the frame {0} is not known: expected 'building', 'EPSG:4326', or a UTM zone of WGS 84 (EPSG:326zz, 327zz)"
    )]
    UnknownFrame(String),
    /// It is in another part of the world.
    #[error(
        "({x:.0}, {y:.0}) m is more than {FARTHEST_M:.0} m from the origin of the building: is it in another frame?"
    )]
    Far {
        /// **Units:** m; **Frame:** building.
        x: f64,
        /// **Units:** m; **Frame:** building.
        y: f64,
    },
    /// The building does not have the floor.
    #[error("floor {floor} is not in the building; it has {floors}")]
    UnknownFloor {
        /// The number.
        floor: i32,
        /// Those there are.
        floors: String,
    },
    /// It was measured after it arrived.
    #[error("it was measured {seconds:.1} s after it arrived: expected its time by the clock of the steps")]
    Future {
        /// By so much.
        seconds: f64,
    },
    /// The covariance is none.
    #[error("its covariance is none: expected a symmetric positive matrix with standard deviations of 1 mm to 10 km")]
    Covariance,
    /// A range that is none.
    #[error("a range of {0} m: expected more than 0 and at most {LONGEST_RANGE_M} m")]
    Range(f64),
}

impl Refused {
    /// In one word, for counting.
    pub fn word(&self) -> &'static str {
        match self {
            Self::NoNumber(_) => "no number",
            Self::NoGeoreference(_) | Self::UnknownFrame(_) => "frame unknown",
            Self::Far { .. } => "far away",
            Self::UnknownFloor { .. } => "floor unknown",
            Self::Future { .. } => "in the future",
            Self::Covariance => "bad covariance",
            Self::Range(_) => "bad range",
        }
    }
}

/// Turns fixes of any frame into observations of one building.
#[derive(Clone, Debug, Default)]
pub struct Frames {
    georeference: Georeference,
    /// From longitude and latitude into the building. Shared, since moments of a walk are kept.
    earth: Option<Arc<Projection>>,
    /// Numbers of the floors; nothing where there is no building.
    floors: Option<Vec<i32>>,
}

impl Frames {
    /// Of a building.
    ///
    /// # Errors
    /// As [`Georeference::projection`].
    pub fn of(building: &Building) -> Result<Self, crate::building::Error> {
        let floors = building.floors.iter().map(|floor| floor.number).collect();
        Ok(Self { floors: Some(floors), ..Self::at(building.georeference)? })
    }

    /// Of a place without a plan.
    ///
    /// # Errors
    /// As [`Georeference::projection`].
    pub fn at(georeference: Georeference) -> Result<Self, crate::building::Error> {
        Ok(Self { georeference, earth: georeference.projection()?.map(Arc::new), ..Self::default() })
    }

    /// The fix in the frame of the building.
    ///
    /// # Errors
    /// A frame or a floor that is not known, a time in the future, a covariance that is none, and what is no number.
    pub fn observe(&self, fix: &Fix) -> Result<Observation, Refused> {
        if fix.time - fix.arrived > CLOCKS_US {
            return Err(Refused::Future { seconds: (fix.time - fix.arrived) as f64 * 1e-6 });
        }
        if let (Some(floor), Some(floors)) = (fix.floor, &self.floors)
            && !floors.contains(&floor)
        {
            let floors = floors.iter().map(i32::to_string).collect::<Vec<_>>().join(", ");
            return Err(Refused::UnknownFloor { floor, floors });
        }
        let measured = match fix.measured {
            Measured::Position { place, covariance } => {
                let (place, turn) = self.place(fix.frame, place)?;
                let covariance = turn.matrix() * checked(covariance)? * turn.matrix().transpose();
                Measured::Position { place, covariance }
            }
            Measured::Range { anchor, above_m, metres, sigma_m } => {
                if !above_m.is_finite() {
                    return Err(Refused::NoNumber("the height of the anchor"));
                }
                if !(metres > 0.0 && metres <= LONGEST_RANGE_M) {
                    return Err(Refused::Range(metres));
                }
                if !(SIGMAS_M.0..=SIGMAS_M.1).contains(&sigma_m) {
                    return Err(Refused::Covariance);
                }
                Measured::Range { anchor: self.place(fix.frame, anchor)?.0, above_m, metres, sigma_m }
            }
        };
        Ok(Observation { time: fix.time, source: fix.source.clone(), measured, floor: fix.floor })
    }

    /// The place in the building, and how the axes of its frame lie there.
    fn place(&self, frame: Frame, place: [f64; 2]) -> Result<([f64; 2], Rotation2<f64>), Refused> {
        if !place.iter().all(|value| value.is_finite()) {
            return Err(Refused::NoNumber("the place"));
        }
        let (place, turn) = match (frame, self.georeference) {
            (Frame::Building, _) => (place, Rotation2::identity()),
            (Frame::Utm(epsg), Georeference::Utm { epsg: own, origin }) if epsg == own => {
                ([place[0] - origin[0], place[1] - origin[1]], Rotation2::identity())
            }
            (Frame::Geographic, _) => self.on_earth(place)?,
            (Frame::Utm(epsg), _) => self.on_earth(zone(epsg, place)?)?,
        };
        if place[0].hypot(place[1]) > FARTHEST_M {
            return Err(Refused::Far { x: place[0], y: place[1] });
        }
        Ok((place, turn))
    }

    fn on_earth(&self, place: [f64; 2]) -> Result<([f64; 2], Rotation2<f64>), Refused> {
        let earth = self.earth.as_ref().ok_or_else(|| Refused::NoGeoreference("of the Earth".into()))?;
        let there = |place: [f64; 2]| earth.to_building(place).map_err(|_| Refused::Far { x: place[0], y: place[1] });
        let (at, east) = (there(place)?, there([place[0] + ASIDE_DEG, place[1]])?);
        Ok((at, Rotation2::new((east[1] - at[1]).atan2(east[0] - at[0]))))
    }
}

/// Longitude and latitude of a place in a UTM zone.
fn zone(epsg: u32, place: [f64; 2]) -> Result<[f64; 2], Refused> {
    let unknown = || Refused::UnknownFrame(format!("EPSG:{epsg}"));
    let zone = Georeference::Utm { epsg, origin: [0.0; 2] }.projection().ok().flatten().ok_or_else(unknown)?;
    zone.to_earth(place).map_err(|_| Refused::Far { x: place[0], y: place[1] })
}

/// A covariance that is one.
fn checked(covariance: Matrix2<f64>) -> Result<Matrix2<f64>, Refused> {
    let [low, high] = [SIGMAS_M.0, SIGMAS_M.1].map(|sigma| sigma * sigma);
    let symmetric = (covariance[(0, 1)] - covariance[(1, 0)]).abs() <= 1e-6 * covariance.trace().abs();
    let bounded = covariance.iter().all(|value| value.is_finite()) && covariance.diagonal().iter().all(|&v| v <= high);
    if !(symmetric && bounded) {
        return Err(Refused::Covariance);
    }
    let least = covariance.symmetric_eigenvalues().min();
    if least >= low { Ok(covariance) } else { Err(Refused::Covariance) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::generate;

    fn fix(frame: Frame, place: [f64; 2]) -> Fix {
        Fix {
            time: Micros(5_000_000),
            arrived: Micros(5_000_000),
            source: "uwb".into(),
            frame,
            measured: Measured::Position { place, covariance: Matrix2::new(9.0, 0.0, 0.0, 1.0) },
            floor: None,
        }
    }

    fn place(observation: &Observation) -> ([f64; 2], Matrix2<f64>) {
        match observation.measured {
            Measured::Position { place, covariance } => (place, covariance),
            Measured::Range { .. } => panic!("{observation:?}"),
        }
    }

    #[test]
    fn one_place_in_three_frames_is_one_place() {
        let georeference = Georeference::Utm { epsg: 32_632, origin: [566_500.0, 5_932_800.0] };
        let frames = Frames::at(georeference).unwrap();
        let [lon, lat] = georeference.projection().unwrap().unwrap().to_earth([78.7, 30.4]).unwrap();
        for (frame, at) in [
            (Frame::Building, [78.7, 30.4]),
            (Frame::Utm(32_632), [566_578.7, 5_932_830.4]),
            (Frame::Geographic, [lon, lat]),
        ] {
            let (found, covariance) = place(&frames.observe(&fix(frame, at)).unwrap());
            // A millimetre is less than any source knows; the grid is turned by 0.8 degrees against the meridian.
            assert!((found[0] - 78.7).hypot(found[1] - 30.4) < 1e-3, "{frame:?} {found:?}");
            assert!((covariance[(0, 0)] - 9.0).abs() < 0.01 && covariance[(0, 1)].abs() < 0.15, "{covariance}");
        }
    }

    #[test]
    fn the_covariance_turns_with_the_building() {
        let georeference = Georeference::Geographic { origin: [10.0, 53.5], rotation_deg: 90.0 };
        let frames = Frames::at(georeference).unwrap();
        let (found, covariance) = place(&frames.observe(&fix(Frame::Geographic, [10.0, 53.5])).unwrap());
        assert!(found[0].hypot(found[1]) < 1e-6);
        assert!((covariance[(0, 0)] - 1.0).abs() < 1e-6 && (covariance[(1, 1)] - 9.0).abs() < 1e-6, "{covariance}");
    }

    #[test]
    fn what_is_of_no_use_is_refused_with_the_reason() {
        let frames = Frames::of(&generate::twin(2)).unwrap();
        let good = fix(Frame::Building, [10.0, 5.0]);
        assert!(frames.observe(&good).is_ok());
        let told = |fix: &Fix| {
            let refused = frames.observe(fix).unwrap_err();
            (refused.word(), refused.to_string())
        };
        assert_eq!(told(&fix(Frame::Geographic, [10.0, 53.5])).0, "frame unknown");
        assert_eq!(told(&fix(Frame::Utm(4_711), [10.0, 53.5])).0, "frame unknown");
        assert_eq!(told(&fix(Frame::Building, [566_578.7, 5_932_830.4])).0, "far away");
        assert_eq!(told(&fix(Frame::Building, [f64::NAN, 0.0])).0, "no number");
        let (word, told_floor) = told(&Fix { floor: Some(9), ..good.clone() });
        assert!(word == "floor unknown" && told_floor.ends_with("it has 0, 1"), "{told_floor}");
        let (word, told_time) = told(&Fix { time: Micros(9_500_000), ..good.clone() });
        assert!(word == "in the future" && told_time.contains("4.5 s after"), "{told_time}");
        for bad in [
            Matrix2::zeros(),
            Matrix2::new(1.0, 0.0, 0.0, -1.0),
            Matrix2::new(1.0, 2.0, 2.0, 1.0),
            Matrix2::new(1.0, 0.5, -0.5, 1.0),
            Matrix2::identity() * f64::NAN,
            Matrix2::identity() * f64::INFINITY,
        ] {
            let measured = Measured::Position { place: [1.0, 1.0], covariance: bad };
            assert_eq!(told(&Fix { measured, ..good.clone() }).0, "bad covariance", "{bad}");
        }
        let range = |metres, sigma_m| Measured::Range { anchor: [0.0; 2], above_m: 2.0, metres, sigma_m };
        assert_eq!(told(&Fix { measured: range(-1.0, 0.1), ..good.clone() }).0, "bad range");
        assert_eq!(told(&Fix { measured: range(3.0, 0.0), ..good }).0, "bad covariance");
    }
}
