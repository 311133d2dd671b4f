//! Steps in polar form, as the document has them: length `L` and direction `R` (Fix, 3.2, 3.3).

use sohle_shared::step::Step;

/// A step by its length and its direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Polar {
    /// `L`. **Units:** m.
    pub length: f64,
    /// `R`, from the heading frame of the first step. **Units:** rad, counter-clockwise, not wrapped.
    pub direction: f64,
}

impl Polar {
    /// The step in the world that is reached by turning the first heading frame by `phi0` (3.2, 3.3). **Units:** m.
    pub fn along(&self, phi0: f64) -> [f64; 2] {
        let (sin, cos) = (phi0 + self.direction).sin_cos();
        [self.length * cos, self.length * sin]
    }
}

/// Turns steps, each of which knows the heading frame of the one before only, into polar ones of one frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Polars {
    heading: f64,
}

impl Polars {
    /// The next step; nothing for one that is no number.
    pub fn next(&mut self, step: &Step) -> Option<Polar> {
        let [x, y] = [step.displacement.x, step.displacement.y].map(f64::from);
        let turn = f64::from(step.turn);
        if ![x, y, turn].iter().all(|value| value.is_finite()) {
            return None;
        }
        let polar = Polar { length: x.hypot(y), direction: self.heading + y.atan2(x) };
        self.heading += turn;
        Some(polar)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use nalgebra::{Matrix4, Vector3};
    use sohle_shared::sample::ClippedSamples;
    use sohle_shared::step::{FloorMode, StepQuality};
    use sohle_shared::time::Micros;

    /// A step at `seconds`, straight ahead, after which the foot is turned.
    pub fn step(index: u32, seconds: f64, length: f64, turn: f64) -> Step {
        let time = Micros((seconds * 1e6).round() as i64);
        Step {
            index,
            stance_start: time,
            stance_end: time,
            displacement: Vector3::new(length as f32, 0.0, 0.0),
            turn: turn as f32,
            covariance: Matrix4::from_diagonal(&nalgebra::Vector4::new(1e-3, 1e-3, 1e-2, 1e-4)),
            mode: FloorMode::Level,
            quality: StepQuality::default(),
            clipped: ClippedSamples::default(),
        }
    }

    #[test]
    fn a_square_comes_back_in_any_direction() {
        let mut polars = Polars::default();
        let quarter = std::f64::consts::FRAC_PI_2;
        let polar: Vec<_> = (0..4).filter_map(|i| polars.next(&step(i, 0.0, 2.0, quarter))).collect();
        assert!(polar[3].direction > 4.7, "{polar:?}");
        for phi0 in [0.0, 3.5] {
            let end = polar.iter().map(|polar| polar.along(phi0)).fold([0.0; 2], |at, d| [at[0] + d[0], at[1] + d[1]]);
            // Turns are kept in single precision.
            assert!(end[0].hypot(end[1]) < 1e-6, "{end:?}");
        }
    }

    #[test]
    fn what_is_no_number_is_none() {
        let mut polars = Polars::default();
        assert_eq!(polars.next(&step(0, 0.0, f64::NAN, 0.0)), None);
        assert_eq!(polars.next(&step(1, 0.0, 1.0, 0.0)).map(|polar| polar.direction), Some(0.0));
    }
}
