//! Every number among the [`Parameters`] with its unit and its bounds, and the check of settings that come from outside.
//!
//! The bounds are wide: they keep out what makes no sense (a negative time, a noise of nothing to divide by, a variance
//! that `f32` cannot carry), not what merely tracks badly. A tracker survives any settings, but only those within the
//! bounds are worth its time.

use super::Parameters;
use core::fmt;

/// One number among the settings `P`.
#[derive(Clone, Copy, Debug)]
pub struct Setting<P: 'static = Parameters> {
    /// Where it stands, as the keys of a file in TOML; elements of a list count from 0.
    pub name: &'static str,
    /// Its unit; `1` for a number without.
    pub unit: &'static str,
    /// The least that makes sense. **Units:** [`Setting::unit`].
    pub least: f32,
    /// The largest that makes sense. **Units:** [`Setting::unit`].
    pub largest: f32,
    value: fn(&P) -> f32,
    set: fn(&mut P, f32),
}

impl<P> Setting<P> {
    /// A number of this name and unit, with the least and the largest that make sense, and how it is read and set.
    pub const fn new(
        name: &'static str,
        unit: &'static str,
        [least, largest]: [f32; 2],
        value: fn(&P) -> f32,
        set: fn(&mut P, f32),
    ) -> Self {
        Self { name, unit, least, largest, value, set }
    }

    /// Its value in `parameters`. **Units:** [`Setting::unit`].
    pub fn value(&self, parameters: &P) -> f32 {
        (self.value)(parameters)
    }

    /// Gives it a value in `parameters`, within its bounds or not; whole numbers are cut. **Units:** [`Setting::unit`].
    pub fn set(&self, parameters: &mut P, value: f32) {
        (self.set)(parameters, value);
    }
}

impl Setting {
    fn named(name: &str) -> Option<&'static Self> {
        SETTINGS.iter().find(|setting| setting.name == name)
    }
}

/// What is wrong with settings.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Unfit {
    /// Not a number, or outside the bounds.
    OutOfBounds {
        /// Which.
        setting: &'static Setting,
        /// Its value. **Units:** those of the setting.
        value: f32,
    },
    /// Of two that have an order, the lower is above the upper.
    Contradiction {
        /// The one that is to be the lower, and its value. **Units:** those of the setting.
        lower: (&'static Setting, f32),
        /// The other, and its value.
        upper: (&'static Setting, f32),
    },
}

impl fmt::Display for Unfit {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfBounds { setting: Setting { name, unit, least, largest, .. }, value } => {
                let unit = if *unit == "1" { "" } else { unit };
                let space = if unit.is_empty() { "" } else { " " };
                write!(out, "{name} is {value}, expected {least} to {largest}{space}{unit}")
            }
            Self::Contradiction { lower: (lower, low), upper: (upper, high) } => {
                write!(out, "{} is {low}, expected no more than {}, which is {high}", lower.name, upper.name)
            }
        }
    }
}

impl core::error::Error for Unfit {}

impl Parameters {
    /// Whether every setting is within its bounds and none contradicts another, also of the method that is not chosen; the
    /// first that is not.
    pub fn check(&self) -> Result<(), Unfit> {
        for setting in SETTINGS {
            let value = setting.value(self);
            // What is not a number is not within.
            if !(setting.least..=setting.largest).contains(&value) {
                return Err(Unfit::OutOfBounds { setting, value });
            }
        }
        for (lower, upper) in ORDERED {
            let (Some(lower), Some(upper)) = (Setting::named(lower), Setting::named(upper)) else { continue };
            let (low, high) = (lower.value(self), upper.value(self));
            if low > high {
                return Err(Unfit::Contradiction { lower: (lower, low), upper: (upper, high) });
            }
        }
        Ok(())
    }
}

/// Pairs whose first must not be above the second.
const ORDERED: &[(&str, &str)] = &[
    ("preintegration.period_s", "preintegration.gap_s"),
    ("stance.floor", "stance.ceiling"),
    ("stance.enter", "stance.leave"),
    ("ground.level_m", "ground.riser_m"),
    ("ground.stop_accel", "ground.ride_accel"),
];

/// A table of settings, a line each: keys, unit, least, largest.
macro_rules! settings {
    ($($first:ident $(.$key:ident)* $([$at:literal])?: $unit:literal, $least:literal, $largest:literal;)+) => {
        &[$(Setting::new(
            concat!(stringify!($first) $(, ".", stringify!($key))* $(, "[", $at, "]")?),
            $unit,
            [$least, $largest],
            |parameters| parameters.$first$(.$key)*$([$at])?.into(),
            |parameters, value| parameters.$first$(.$key)*$([$at])? = value as _,
        )),+]
    };
}

/// Every number among the settings, in the order of [`Parameters`].
pub const SETTINGS: &[Setting] = settings! {
    start_after_s: "s", 0.0, 1e5;
    sleep_after_s: "s", 0.0, 1e6;

    preintegration.period_s: "s", 0.001, 0.1;
    preintegration.gap_s: "s", 0.01, 10.0;

    stance.accel_sigma: "m/s²", 1e-4, 10.0;
    stance.gyro_sigma: "rad/s", 1e-5, 1.0;
    stance.lookback_s: "s", 0.1, 60.0;
    stance.floor: "1", 1.0, 1e9;
    stance.ceiling: "1", 1.0, 1e9;
    stance.limit: "1", 1.0, 1e9;
    stance.velocity_sigma: "m/s", 1e-5, 1.0;
    stance.enter: "1", 1.0, 1e3;
    stance.leave: "1", 1.0, 1e3;
    stance.confirm_s: "s", 0.0, 1.0;
    stance.swing_speed: "m/s", 0.01, 10.0;
    stance.new_pace_speed: "m/s", 0.0, 10.0;
    stance.new_pace_after_s: "s", 0.0, 10.0;

    rest.window_s: "s", 0.05, 10.0;
    rest.gyro_sigma: "rad/s", 1e-5, 1.0;
    rest.accel_sigma: "m/s²", 1e-4, 10.0;
    rest.gyro_mean: "rad/s", 1e-5, 1.0;
    rest.bias_sigma: "rad/s", 1e-7, 0.1;
    rest.bias_share: "1", 0.0, 10.0;

    filter.tilt_sigma: "rad", 0.0, 1.0;
    filter.tilt_sigma_moving: "rad", 0.0, 1.0;
    filter.velocity_sigma: "m/s", 0.0, 10.0;
    filter.gyro_bias_sigma: "rad/s", 0.0, 1.0;
    filter.accel_bias_sigma: "m/s²", 0.0, 10.0;
    filter.lever_sigma: "m", 0.0, 1.0;
    filter.gyro_noise: "rad/s/√Hz", 0.0, 1.0;
    filter.accel_noise: "m/s²/√Hz", 0.0, 10.0;
    filter.gyro_bias_noise: "rad/s/√s", 0.0, 0.1;
    filter.accel_bias_noise: "m/s²/√s", 0.0, 1.0;
    filter.lever_noise: "m/√s", 0.0, 1.0;
    filter.jump_s: "s", 0.0, 0.1;
    filter.gyro_clip_sigma: "rad/s", 0.0, 100.0;
    filter.accel_clip_sigma: "m/s²", 0.0, 1e3;
    filter.gap_gyro_sigma: "rad/s", 0.0, 100.0;
    filter.gap_accel_sigma: "m/s²", 0.0, 1e3;
    filter.heading_share: "1", 0.0, 1.0;
    filter.vertical_bias_share: "1", 0.0, 1.0;
    filter.force_bias_share: "1", 0.0, 1.0;
    filter.gravity_sigma: "m/s²", 1e-4, 10.0;
    filter.force_sigma: "m/s²", 1e-4, 10.0;
    filter.height_sigma: "m", 1e-5, 1.0;

    ground.level_m: "m", 0.0, 10.0;
    ground.level_sigmas: "1", 0.0, 100.0;
    ground.riser_m: "m", 0.0, 10.0;
    ground.settle_s: "s", 0.0, 10.0;
    ground.ride_after_s: "s", 0.0, 60.0;
    ground.ride_accel: "m/s²", 0.01, 10.0;
    ground.ride_rate: "rad/s", 0.0, 10.0;
    ground.stop_speed: "m/s", 0.0, 10.0;
    ground.stop_accel: "m/s²", 0.0, 10.0;
    ground.stop_s: "s", 0.0, 60.0;

    steps.report_after_s: "s", 0.1, 3600.0;
    steps.long_swing_s: "s", 0.1, 3600.0;
    steps.weak_statistic: "1", 0.0, 1e9;

    document.gravity_samples: "1", 1.0, 65535.0;
    document.init_s: "s", 0.0, 60.0;
    document.filter.start: "rad², m², m²/s²", 0.0, 1e4;
    document.filter.rotation_noise: "rad²/s", 0.0, 1.0;
    document.filter.position_noise: "m²/s", 0.0, 10.0;
    document.filter.velocity_noise: "m²/s³", 0.0, 100.0;
    document.filter.gyro: "rad²/s²", 0.0, 1.0;
    document.filter.accel: "m²/s⁴", 0.0, 1e4;
    document.filter.gravity: "m²/s⁴", 1e-8, 1e4;
    document.filter.init_velocity: "m²/s²", 1e-10, 100.0;
    document.filter.init_position: "m²", 1e-10, 100.0;
    document.filter.stance_velocity: "m²/s²", 1e-10, 100.0;
    document.filter.height: "m²", 1e-10, 100.0;
    document.documented.min_still_time: "s", 0.0, 10.0;
    document.documented.max_gyro_norm: "rad/s", 0.01, 10.0;
    document.documented.max_accel_norm: "m/s²", 0.01, 100.0;
    document.documented.max_gyro_offset[0]: "rad/s", 0.01, 10.0;
    document.documented.max_gyro_offset[1]: "rad/s", 0.01, 10.0;
    document.documented.max_gyro_offset[2]: "rad/s", 0.01, 10.0;
    document.documented.max_accel_offset[0]: "m/s²", 0.01, 100.0;
    document.documented.max_accel_offset[1]: "m/s²", 0.01, 100.0;
    document.documented.max_accel_offset[2]: "m/s²", 0.01, 100.0;
    document.shoe.window_s: "s", 0.001, 1.0;
    document.shoe.accel_sigma: "m/s²", 1e-4, 10.0;
    document.shoe.gyro_sigma: "rad/s", 1e-5, 1.0;
    document.shoe.threshold: "1", 1.0, 1e9;
    document.ared.window_s: "s", 0.001, 1.0;
    document.ared.threshold: "rad/s", 0.001, 100.0;
    document.amv.window_s: "s", 0.001, 1.0;
    document.amv.threshold: "m/s²", 0.001, 100.0;
    document.mag.window_s: "s", 0.001, 1.0;
    document.mag.threshold: "m/s²", 0.001, 100.0;
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::ImuSample;
    use crate::selftest::Walk;
    use crate::step::Step;
    use crate::tracker::{Detector, Method, Tracker};
    use nalgebra::Vector3;
    use proptest::prelude::*;
    use std::format;
    use std::vec::Vec;

    fn said(change: impl FnOnce(&mut Parameters)) -> std::string::String {
        let mut parameters = Parameters::default();
        change(&mut parameters);
        parameters.check().err().map(|unfit| format!("{unfit}")).unwrap_or_default()
    }

    #[test]
    fn the_settings_of_the_project_and_of_the_document_pass() {
        assert!(Parameters::default().check().is_ok() && Parameters::documented().check().is_ok());
    }

    #[test]
    fn each_setting_is_held_at_both_bounds_and_every_pair_is_found() {
        for Setting { name, least, largest, .. } in SETTINGS {
            assert!(least.is_finite() && largest.is_finite() && *least >= 0.0 && least < largest, "{name}");
            assert_eq!(SETTINGS.iter().filter(|other| other.name == *name).count(), 1, "{name}");
        }
        for (lower, upper) in ORDERED {
            assert!(Setting::named(lower).is_some() && Setting::named(upper).is_some(), "{lower}, {upper}");
        }
    }

    #[test]
    fn what_is_wrong_is_named_with_its_bounds_and_unit() {
        assert_eq!(said(|p| p.filter.height_sigma = -1.0), "filter.height_sigma is -1, expected 0.00001 to 1 m");
        assert_eq!(said(|p| p.stance.leave = f32::NAN), "stance.leave is NaN, expected 1 to 1000");
        assert_eq!(
            said(|p| p.document.documented.max_accel_offset[2] = f32::INFINITY),
            "document.documented.max_accel_offset[2] is inf, expected 0.01 to 100 m/s²"
        );
        assert_eq!(said(|p| p.document.gravity_samples = 0), "document.gravity_samples is 0, expected 1 to 65535");
        assert_eq!(
            said(|p| (p.stance.floor, p.stance.ceiling) = (10.0, 1.0)),
            "stance.floor is 10, expected no more than stance.ceiling, which is 1"
        );
    }

    /// The numbers that come to mind when something is to break, and any others.
    fn number() -> impl Strategy<Value = f32> {
        let extremes =
            [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, f32::MIN_POSITIVE, 0.0, -0.0, -1.0];
        prop_oneof![prop::sample::select(extremes.to_vec()), any::<u32>().prop_map(f32::from_bits), -10.0_f32..1e4]
    }

    /// Any settings: most as they are by default, some any number at all.
    fn any_parameters() -> impl Strategy<Value = Parameters> {
        let changes = prop::collection::vec((any::<prop::sample::Index>(), number()), 0..12);
        let detectors =
            [Detector::Documented, Detector::Shoe, Detector::Ared, Detector::Amv, Detector::Mag, Detector::Adaptive];
        (any::<bool>(), prop::sample::select(detectors.to_vec()), changes).prop_map(
            |(documented, detector, changes)| {
                let method = if documented { Method::Unscented } else { Method::Pivot };
                let mut parameters = Parameters { method, ..Parameters::default() };
                parameters.document.detector = detector;
                for (at, value) in changes {
                    at.get(SETTINGS).set(&mut parameters, value);
                }
                parameters
            },
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(96))]

        #[test]
        fn no_settings_panic_or_tell_of_what_is_no_number(
            parameters in any_parameters(),
            disturbances in prop::collection::vec((0_usize..2_000, any::<[u32; 6]>(), -1_000_000_i64..5_000_000), 0..5),
        ) {
            let mut samples: Vec<ImuSample> = Walk::new(2_500).collect();
            for (at, bits, shift) in disturbances {
                let values = bits.map(f32::from_bits);
                samples[at].accel.0 = Vector3::new(values[0], values[1], values[2]);
                samples[at].gyro.0 = Vector3::new(values[3], values[4], values[5]);
                samples[at].time = samples[at].time + shift;
            }
            let mut tracker = Tracker::new(&parameters);
            let mut steps: Vec<Step> = Vec::new();
            for sample in &samples {
                steps.extend(tracker.push(sample).step);
                let vectors = [tracker.displacement(), tracker.velocity()];
                prop_assert!(vectors.iter().flatten().chain(&tracker.attitude().coords).all(|value| value.is_finite()));
            }
            steps.extend(tracker.finish());
            for step in steps {
                prop_assert!(step.turn.is_finite() && step.displacement.iter().all(|value| value.is_finite()));
                prop_assert!(step.covariance.iter().all(|value| value.is_finite()));
                prop_assert!((0..4).all(|i| step.covariance[(i, i)] >= 0.0));
            }
        }

        #[test]
        fn settings_within_the_bounds_pass_and_any_outside_is_found(at in any::<prop::sample::Index>(), value in number()) {
            let setting = at.get(SETTINGS);
            let mut parameters = Parameters::default();
            setting.set(&mut parameters, value);
            let value = setting.value(&parameters);
            match parameters.check() {
                Ok(()) => prop_assert!((setting.least..=setting.largest).contains(&value)),
                Err(Unfit::OutOfBounds { setting: found, .. }) => {
                    prop_assert_eq!(found.name, setting.name);
                    prop_assert!(!(setting.least..=setting.largest).contains(&value));
                }
                Err(Unfit::Contradiction { lower: (lower, low), upper: (upper, high) }) => {
                    prop_assert!([lower.name, upper.name].contains(&setting.name) && low > high);
                }
            }
        }
    }
}
