//! From stances to [`Step`]s: when a stance is complete, what it is worth, and what to warn of.

use crate::filter::rebase::Change;
use crate::sample::ClippedSamples;
use crate::step::{FloorMode, Step, StepQuality};
use crate::time::Micros;

/// Settings of [`StepBuilder`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Parameters {
    /// Someone who stands for longer is told of at once; the stance goes on. **Units:** s.
    pub report_after_s: f32,
    /// A swing longer than this probably hides a stance. **Units:** s.
    pub long_swing_s: f32,
    /// A stance that was never stiller than this was weak. **Units:** 1, the SHOE statistic.
    pub weak_statistic: f32,
}

impl Default for Parameters {
    fn default() -> Self {
        Self { report_after_s: 1.0, long_swing_s: 2.0, weak_statistic: 3e4 }
    }
}

/// What a moment means for the step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Nothing.
    None,
    /// A step is complete: re-base the filter and call [`StepBuilder::take`].
    Complete,
}

/// Follows the stances.
#[derive(Clone, Debug)]
pub struct StepBuilder {
    parameters: Parameters,
    index: u32,
    stance: Option<Stance>,
    /// The foot has swung since the last step.
    swung: bool,
    left_at: Option<Micros>,
    quality: StepQuality,
    clipped: ClippedSamples,
}

#[derive(Clone, Copy, Debug)]
struct Stance {
    start: Micros,
    end: Micros,
    reported: bool,
    stillest: f32,
}

impl StepBuilder {
    /// Before the first stance.
    pub fn new(parameters: &Parameters) -> Self {
        Self {
            parameters: *parameters,
            index: 0,
            stance: None,
            swung: true,
            left_at: None,
            quality: StepQuality::default(),
            clipped: ClippedSamples::default(),
        }
    }

    /// What happened since the last step that should be known.
    pub fn warn(&mut self) -> &mut StepQuality {
        &mut self.quality
    }

    /// Takes in how many samples were clipped.
    pub fn count(&mut self, clipped: ClippedSamples) {
        self.clipped.add(clipped);
        self.quality.accel_clipped |= clipped.accel > 0;
        self.quality.gyro_clipped |= clipped.gyro > 0;
    }

    /// Takes in a moment: whether the foot stands and since when, how still it is, and whether it certainly swings.
    pub fn observe(&mut self, time: Micros, standing_since: Option<Micros>, statistic: f32, swings: bool) -> Event {
        self.swung |= swings;
        let Some(since) = standing_since else {
            let complete = self.stance.is_some_and(|stance| !stance.reported);
            return if complete { Event::Complete } else { self.leave() };
        };
        let swung = self.swung;
        let stance =
            self.stance.get_or_insert(Stance { start: since, end: time, reported: !swung, stillest: f32::INFINITY });
        stance.end = time;
        stance.stillest = stance.stillest.min(statistic);
        let long = time.since(stance.start) >= self.parameters.report_after_s;
        if long && !stance.reported { Event::Complete } else { Event::None }
    }

    /// The foot stood until `time`, unseen.
    pub fn stood_until(&mut self, time: Micros) {
        if let Some(stance) = &mut self.stance {
            stance.end = stance.end.max(time);
        }
    }

    fn leave(&mut self) -> Event {
        if let Some(stance) = self.stance.take() {
            self.left_at = Some(stance.end);
        }
        Event::None
    }

    /// The recording ends: whether a step is complete with it.
    pub fn finish(&self) -> Event {
        if self.stance.is_some_and(|stance| !stance.reported) { Event::Complete } else { Event::None }
    }

    /// The stance, reported or not, is to be told of again: an elevator has carried it elsewhere.
    pub fn reopen(&mut self) {
        if let Some(stance) = &mut self.stance {
            stance.reported = false;
        }
    }

    /// Whether the present stance has been told of.
    pub fn reported(&self) -> bool {
        self.stance.is_some_and(|stance| stance.reported)
    }

    /// The step that is complete. `standing` tells whether its stance goes on.
    pub fn take(&mut self, change: Change, mode: FloorMode, standing: bool) -> Option<Step> {
        let stance = self.stance.as_mut()?;
        stance.reported = true;
        let mut quality = core::mem::take(&mut self.quality);
        quality.weak_stance = stance.stillest > self.parameters.weak_statistic;
        quality.long_swing = self.left_at.is_some_and(|left| stance.start.since(left) > self.parameters.long_swing_s);
        let first = self.index == 0;
        let step = Step {
            index: self.index,
            stance_start: stance.start,
            stance_end: stance.end,
            displacement: if first { nalgebra::Vector3::zeros() } else { change.displacement },
            turn: if first { 0.0 } else { change.turn },
            covariance: if first { nalgebra::Matrix4::zeros() } else { change.covariance },
            mode,
            quality,
            clipped: core::mem::take(&mut self.clipped),
        };
        self.index = self.index.wrapping_add(1);
        self.swung = false;
        self.left_at = Some(stance.end);
        if !standing {
            self.leave();
        }
        Some(step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix4, Vector3};

    fn change() -> Change {
        Change { displacement: Vector3::new(1.3, 0.1, 0.0), turn: 0.1, covariance: Matrix4::identity() * 1e-4 }
    }

    /// Runs a pattern of tenths of seconds: `s` stands, `w` swings, `r` is restless without moving.
    fn steps(pattern: &str) -> std::vec::Vec<Step> {
        let mut builder = StepBuilder::new(&Parameters::default());
        let (mut steps, mut since) = (std::vec::Vec::new(), None);
        for (i, moment) in pattern.chars().enumerate() {
            let time = Micros(i as i64 * 100_000);
            since = if moment == 's' { since.or(Some(time)) } else { None };
            if builder.observe(time, since, 1e3, moment == 'w') == Event::Complete {
                steps.extend(builder.take(change(), FloorMode::Level, since.is_some()));
            }
        }
        if builder.finish() == Event::Complete {
            steps.extend(builder.take(change(), FloorMode::Level, true));
        }
        steps
    }

    #[test]
    fn each_stance_is_a_step_and_the_first_marks_the_start() {
        let steps = steps("ssswwwwssswwwwsss");
        assert_eq!(steps.iter().map(|step| step.index).collect::<std::vec::Vec<_>>(), [0, 1, 2]);
        assert_eq!(steps[0].displacement, Vector3::zeros());
        assert_eq!(steps[1].displacement, change().displacement);
        assert_eq!((steps[1].stance_start, steps[1].stance_end), (Micros(700_000), Micros(900_000)));
    }

    #[test]
    fn who_stands_is_told_of_once_and_soon() {
        let steps = steps("ssswwwwsssssssssssssssssssssssssssswwwwsss");
        assert_eq!(steps.len(), 3);
        assert_eq!(steps[1].stance_end, Micros(1_700_000));
    }

    #[test]
    fn a_restless_moment_in_a_stance_makes_no_second_step() {
        assert_eq!(steps("ssswwwwssrssswwwwsss").len(), 3);
    }
}
