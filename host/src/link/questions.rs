//! When the shoe is asked for its time.

use sohle_shared::time::Micros;
use std::collections::VecDeque;

/// Between two questions for the time. **Units:** microseconds.
const QUESTION_US: i64 = 2_000_000;
/// The same at the start, and after a question that was not answered.
const QUESTION_SHORT_US: i64 = 500_000;
/// Questions of the start, and the time between them.
const BURST: (u32, i64) = (8, 50_000);
/// Questions that may still be answered.
const QUESTIONS: usize = 16;

/// Questions for the time.
#[derive(Debug, Default)]
pub struct Questions {
    number: u32,
    /// Without an answer: number and time.
    open: VecDeque<(u32, Micros)>,
    due: Micros,
    /// Left of the burst at the start.
    burst: u32,
}

impl Questions {
    /// A burst is due: the clock is not known yet.
    pub fn begin(&mut self, now: Micros) {
        (self.due, self.burst) = (now, BURST.0);
    }

    /// Whatever was asked before is not answered any more.
    pub fn forget(&mut self) {
        self.open.clear();
    }

    /// When the next question is to be asked.
    pub fn due(&self) -> Micros {
        self.due
    }

    /// The number of a question that is asked now.
    pub fn ask(&mut self, now: Micros) -> u32 {
        self.number = self.number.wrapping_add(1);
        if self.open.len() == QUESTIONS {
            self.open.pop_front();
        }
        self.open.push_back((self.number, now));
        self.burst = self.burst.saturating_sub(1);
        self.due = now + if self.burst > 0 { BURST.1 } else { QUESTION_SHORT_US };
        self.number
    }

    /// When the question was asked that is answered now; `None` if it was answered before or never asked.
    pub fn answered(&mut self, number: u32) -> Option<Micros> {
        let at = self.open.iter().position(|&(open, _)| open == number)?;
        let (_, asked) = self.open.remove(at)?;
        if self.burst == 0 {
            self.due = self.due.max(asked + QUESTION_US);
        }
        Some(asked)
    }
}
