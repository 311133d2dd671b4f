//! Does a tracker stay as good as it was? Judges each step of a walk of any length against the truth, window by window,
//! and holds nothing but the last few of each.

use crate::recording::{SimulatedTruth, TruthStance};
use sohle_shared::step::Step;
use sohle_shared::time::Micros;
use std::collections::VecDeque;

/// The errors of the steps of a stretch of a walk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Window {
    /// Stances the foot really had.
    pub stances: u64,
    /// Steps that were told.
    pub steps: u64,
    /// Real stances that no step was told of.
    pub missed: u64,
    /// Steps that end in no real stance.
    pub invented: u64,
    judged: u64,
    length: f64,
    height: f64,
    turn: f64,
}

impl Window {
    /// Root mean square of the errors of horizontal length (m), height (m) and turn (rad) per step.
    pub fn errors(&self) -> [f64; 3] {
        let n = self.judged.max(1) as f64;
        [self.length, self.height, self.turn].map(|sum| (sum / n).sqrt())
    }
}

/// Matches steps with true stances as both come, in windows of equal length.
#[derive(Clone, Debug)]
pub struct Judge {
    window_us: i64,
    windows: Vec<Window>,
    truths: VecDeque<TruthStance>,
    steps: VecDeque<Step>,
    /// Number of the stance, and it, that the last step was matched with.
    last: Option<(u64, TruthStance)>,
    passed: u64,
}

/// True stances kept to match steps with.
const KEPT: usize = 8;
/// How far beside a true stance a step may lie that ends in it: the window of the detector. **Units:** µs.
const TOLERANCE_US: i64 = 30_000;

impl Judge {
    /// Windows of `seconds`. **Units:** s.
    pub fn new(seconds: f64) -> Self {
        Self {
            window_us: Micros::from_seconds(seconds).0.max(1),
            windows: Vec::new(),
            truths: VecDeque::new(),
            steps: VecDeque::new(),
            last: None,
            passed: 0,
        }
    }

    /// A step was told.
    pub fn step(&mut self, step: Step) {
        self.steps.push_back(step);
    }

    /// A true stance has ended. Steps of earlier ones are judged.
    pub fn stance(&mut self, stance: TruthStance) {
        self.window(stance.start).stances += 1;
        while self.steps.front().is_some_and(|step| step.stance_end + TOLERANCE_US < stance.start) {
            self.judge_next();
        }
        self.truths.push_back(stance);
        if self.truths.len() > KEPT {
            self.truths.pop_front();
            self.passed += 1;
        }
    }

    /// The walk is over.
    pub fn finish(mut self) -> Vec<Window> {
        while !self.steps.is_empty() {
            self.judge_next();
        }
        self.windows
    }

    fn window(&mut self, time: Micros) -> &mut Window {
        let index = usize::try_from(time.0 / self.window_us).unwrap_or(0);
        if self.windows.len() <= index {
            self.windows.resize(index + 1, Window::default());
        }
        &mut self.windows[index]
    }

    fn judge_next(&mut self) {
        let Some(step) = self.steps.pop_front() else { return };
        let found = self.truths.iter().zip(self.passed..).find(|(truth, _)| {
            truth.start + -TOLERANCE_US <= step.stance_end && step.stance_start <= truth.end + TOLERANCE_US
        });
        let found = found.map(|(truth, number)| (number, *truth));
        let last = self.last;
        let window = self.window(step.stance_start);
        window.steps += 1;
        let Some((number, truth)) = found else {
            window.invented += 1;
            return;
        };
        match last {
            Some((before, from)) if number > before => {
                window.missed += number - before - 1;
                // A step over a missed stance is right if it spans both strides.
                let truth = SimulatedTruth { poses: Vec::new(), stances: vec![from, truth] };
                for stride in truth.strides() {
                    let [x, y, z] = stride.displacement;
                    let turned = f64::from(step.turn) - stride.turn;
                    let turned = turned - std::f64::consts::TAU * (turned / std::f64::consts::TAU).round();
                    window.judged += 1;
                    window.length += (f64::from(step.length()) - x.hypot(y)).powi(2);
                    window.height += (f64::from(step.displacement.z) - z).powi(2);
                    window.turn += turned * turned;
                }
            }
            Some(_) => window.invented += 1,
            None => {}
        }
        self.last = Some((number, truth));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix4, Vector3};
    use sohle_shared::step::{FloorMode, StepQuality};

    fn truth(i: i64) -> TruthStance {
        let start = Micros(i * 1_000_000);
        TruthStance { start, end: start + 300_000, position: [i as f64, 0.0, 0.0], heading: 0.0, still: true }
    }

    fn step(i: i64, length: f32) -> Step {
        Step {
            index: i as u32,
            stance_start: Micros(i * 1_000_000 + 20_000),
            stance_end: Micros(i * 1_000_000 + 290_000),
            displacement: Vector3::new(length, 0.0, 0.01),
            turn: 0.002,
            covariance: Matrix4::zeros(),
            mode: FloorMode::Level,
            quality: StepQuality::default(),
            clipped: Default::default(),
        }
    }

    #[test]
    fn errors_are_told_in_the_window_they_belong_to() {
        let mut judge = Judge::new(10.0);
        for i in 0..20 {
            judge.stance(truth(i));
            // One missed in each window; the second is 1 cm off for each metre.
            if i % 10 != 5 {
                let strides = if i % 10 == 6 { 2.0 } else { 1.0 };
                judge.step(step(i, strides * if i < 10 { 1.0 } else { 1.01 }));
            }
        }
        let windows = judge.finish();
        assert_eq!(windows.len(), 2);
        for window in &windows {
            assert_eq!((window.stances, window.steps, window.missed, window.invented), (10, 9, 1, 0));
            let [_, height, turn] = window.errors();
            assert!((height - 0.01).abs() < 1e-6 && (turn - 0.002).abs() < 1e-6);
        }
        assert!(windows[0].errors()[0] < 1e-6);
        // Eight of 0.01 m and one of 0.02 m.
        assert!((windows[1].errors()[0] - (12e-4_f64 / 9.0).sqrt()).abs() < 1e-6);
    }

    #[test]
    fn a_step_in_the_air_is_invented() {
        let mut judge = Judge::new(10.0);
        judge.stance(truth(0));
        judge.step(step(0, 0.0));
        let mut false_one = step(0, 0.5);
        false_one.stance_start = Micros(500_000);
        false_one.stance_end = Micros(600_000);
        judge.step(false_one);
        judge.stance(truth(1));
        judge.step(step(1, 1.0));
        let windows = judge.finish();
        assert_eq!((windows[0].steps, windows[0].invented, windows[0].missed), (3, 1, 0));
    }
}
