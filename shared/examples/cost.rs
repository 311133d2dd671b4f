//! Runs the self-test's walk so that callgrind can count what tracker and filter cost; `cargo xtask bench` calls it.
//!
//! `cost SETTING PART PERIOD_US`: the parts are the tracker's samples in motion (`swinging`) and at rest (`standing`), and
//! the filter's steps alone (`prediction`, `correction`). What belongs to the part runs within [`counted`], the rest does
//! not. Prints how often it ran.

use sohle_shared::filter::pivot::PivotFilter;
use sohle_shared::filter::unscented::UnscentedFilter;
use sohle_shared::preintegration::Preintegrator;
use sohle_shared::sample::{AccelCorrected, GyroCorrected};
use sohle_shared::selftest::{self, Walk, counted};
use sohle_shared::so3;
use sohle_shared::step::FloorMode;
use sohle_shared::tracker::{Parameters, Tracker};
use std::process::ExitCode;

/// How often the part in question ran.
struct Count(u32);

impl Count {
    /// Runs `work`, within [`counted`] if it belongs to the part.
    fn run<T>(&mut self, belongs: bool, work: impl FnOnce() -> T) -> T {
        if belongs {
            self.0 += 1;
            counted(work)
        } else {
            work()
        }
    }
}

/// The samples of one phase through the tracker.
fn samples(parameters: &Parameters, period_us: u32, stands: &[bool], standing: bool) -> u32 {
    let mut count = Count(0);
    let mut phases = stands.iter();
    selftest::track(period_us, parameters, |tracker, sample| {
        let belongs = phases.next() == Some(&standing);
        count.run(belongs, || tracker.push(sample))
    });
    count.0
}

/// Steps of the document's filter: one for each sample.
fn unscented_steps(parameters: &Parameters, period_us: u32, stands: &[bool], corrections: bool) -> u32 {
    let mut count = Count(0);
    let mut filter = UnscentedFilter::new(&parameters.document.filter);
    let dt = period_us as f32 * 1e-6;
    for (index, (sample, &stands)) in Walk::new(period_us).zip(stands).enumerate() {
        let (accel, gyro) = (AccelCorrected(sample.accel.0), GyroCorrected(sample.gyro.0));
        if index == 0 {
            filter.start(so3::level(&accel.0), accel.0.norm());
        }
        count.run(!corrections, || filter.predict(gyro, accel, dt));
        if stands {
            count.run(corrections, || filter.stand(accel, FloorMode::Level, 0.0));
        }
    }
    count.0
}

/// Steps of the project's own filter: one for each increment.
fn pivot_steps(parameters: &Parameters, period_us: u32, stands: &[bool], corrections: bool) -> u32 {
    let mut count = Count(0);
    let mut filter = PivotFilter::new(&parameters.filter);
    let mut gathered = Preintegrator::new(&parameters.preintegration);
    for (index, (sample, &stands)) in Walk::new(period_us).zip(stands).enumerate() {
        if index == 0 {
            filter.start(&sample.accel.0, None);
        }
        let Some(increment) = gathered.push(&sample, filter.gyro_bias(), filter.accel_bias()) else {
            continue;
        };
        count.run(!corrections, || filter.predict(&increment));
        if stands {
            count.run(corrections, || {
                filter.update_zero_velocity(0.01, false);
                filter.update_height(0.0, 0.1);
            });
        }
    }
    count.0
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [setting, part, period_us] = words.as_slice() else { return usage() };
    let Ok(period_us) = period_us.parse() else { return usage() };
    let documented = setting == "documented";
    let parameters = if documented { Parameters::documented() } else { Parameters::default() };
    // Whether the foot stands is known only after the sample: a first run finds out.
    let mut stands = Vec::new();
    selftest::track(period_us, &parameters, |tracker: &mut Tracker, sample| {
        let output = tracker.push(sample);
        stands.push(output.stance);
        output
    });
    let steps = if documented { unscented_steps } else { pivot_steps };
    let count = match part.as_str() {
        "swinging" => samples(&parameters, period_us, &stands, false),
        "standing" => samples(&parameters, period_us, &stands, true),
        "prediction" => steps(&parameters, period_us, &stands, false),
        "correction" => steps(&parameters, period_us, &stands, true),
        _ => return usage(),
    };
    println!("{count}");
    ExitCode::SUCCESS
}

fn usage() -> ExitCode {
    eprintln!("error: usage: cost default|documented swinging|standing|prediction|correction PERIOD_US");
    ExitCode::from(2)
}
