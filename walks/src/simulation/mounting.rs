//! How the sensor sits on the shoe.

use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Attitude of the sensor on the shoe.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Orientation {
    /// On the instep: x forward, y left, z up, tilted forward with the slope of the laces.
    #[default]
    Instep,
    /// x forward, y left, z up.
    Flat,
    /// Turned over about the x axis: y right, z down.
    UpsideDown,
    /// The x axis points up (z backward).
    XUp,
    /// The x axis points down (z forward).
    XDown,
    /// The y axis points up (z to the right).
    YUp,
    /// Turned by half a turn about the vertical: x backward.
    Backward,
    /// No axis along any axis of the shoe.
    Skew,
    /// Any other: axis and angle. **Units:** rad.
    #[value(skip)]
    Rotation([f64; 3]),
}

impl Orientation {
    /// Turns sensor vectors into the shoe's frame (x forward, y left, z up).
    pub fn rotation(self) -> UnitQuaternion<f64> {
        let vector = match self {
            Self::Instep => [0.0, 0.35, 0.0],
            Self::Flat => [0.0; 3],
            Self::UpsideDown => [PI, 0.0, 0.0],
            Self::XUp => [0.0, -FRAC_PI_2, 0.0],
            Self::XDown => [0.0, FRAC_PI_2, 0.0],
            Self::YUp => [FRAC_PI_2, 0.0, 0.0],
            Self::Backward => [0.0, 0.0, PI],
            Self::Skew => [0.9, -1.3, 0.6],
            Self::Rotation(vector) => vector,
        };
        UnitQuaternion::from_scaled_axis(Vector3::from(vector))
    }
}

/// Attitude and place of the sensor on the shoe.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Mounting {
    /// Its attitude.
    pub orientation: Orientation,
    /// Its place relative to the point of the sole below the instep. **Units:** m; **Frame:** shoe, x forward, y left,
    /// z up.
    pub place: [f64; 3],
}

impl Default for Mounting {
    /// On the instep.
    fn default() -> Self {
        Self { orientation: Orientation::Instep, place: [0.0, 0.0, 0.08] }
    }
}

impl Mounting {
    /// Behind the heel cap.
    pub fn heel() -> Self {
        Self { orientation: Orientation::XUp, place: [-0.16, 0.0, 0.05] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orientations_point_where_they_say() {
        let up = |orientation: Orientation, axis: Vector3<f64>| (orientation.rotation() * axis).z;
        assert!((up(Orientation::UpsideDown, Vector3::z()) + 1.0).abs() < 1e-12);
        assert!((up(Orientation::XUp, Vector3::x()) - 1.0).abs() < 1e-12);
        assert!((up(Orientation::XDown, Vector3::x()) + 1.0).abs() < 1e-12);
        assert!((up(Orientation::YUp, Vector3::y()) - 1.0).abs() < 1e-12);
        // Laces rise towards the leg: the x axis of a sensor lying on them points forward and down.
        assert!(up(Orientation::Instep, Vector3::x()) < -0.3);
        assert!(((Orientation::XUp.rotation() * Vector3::z()).x + 1.0).abs() < 1e-12);
    }
}
