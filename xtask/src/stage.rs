//! The stages of a check run: what ran, how long it took, how much of it passed.

use crate::process::{self, Ended, Failure};
use std::ops::AddAssign;
use std::process::Command;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Tests and checks counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// How many passed.
    pub passed: u64,
    /// How many failed.
    pub failed: u64,
}

impl Tally {
    /// One check passed.
    pub const PASSED: Self = Self { passed: 1, failed: 0 };

    /// What the summary of a test runner says: the last line of nextest's that begins with `Summary`, or all lines of
    /// the standard harness that begin with `test result:`.
    pub fn of_test_output(text: &str) -> Self {
        let nextest = text.lines().rev().find(|line| line.trim_start().starts_with("Summary ["));
        let harness = text.lines().filter(|line| line.starts_with("test result: "));
        let mut tally = Self::default();
        for line in nextest.into_iter().chain(harness) {
            tally += Self { passed: count_before(line, "passed"), failed: count_before(line, "failed") };
            tally.failed += count_before(line, "timed out");
        }
        tally
    }
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.passed += other.passed;
        self.failed += other.failed;
    }
}

/// The number in front of `word`; 0 when the line has none.
fn count_before(line: &str, word: &str) -> u64 {
    let before = line.split(word).next().filter(|before| before.len() < line.len());
    before.and_then(|before| before.split_whitespace().next_back()).and_then(|number| number.parse().ok()).unwrap_or(0)
}

/// What came of a stage.
struct Finished {
    name: &'static str,
    time: Duration,
    tally: Tally,
    trouble: Option<String>,
}

/// Stages that run one after the other beside those of a [`Run`], which tells of them when it is joined.
pub struct Beside(JoinHandle<Vec<RanBeside>>);

/// Its name, how long it took, and how it ended.
type RanBeside = (&'static str, Duration, Result<Ended, Failure>);

impl Beside {
    /// Begins with commands that are one check each.
    pub fn start(stages: Vec<(&'static str, Command)>) -> Self {
        let run = |(name, mut command)| {
            let start = Instant::now();
            let ended = process::watch(&mut command, || true);
            (name, start.elapsed(), ended)
        };
        Self(thread::spawn(move || stages.into_iter().map(run).collect()))
    }
}

/// All stages of a run.
pub struct Run {
    begun: Instant,
    finished: Vec<Finished>,
}

impl Default for Run {
    fn default() -> Self {
        Self { begun: Instant::now(), finished: Vec::new() }
    }
}

impl Run {
    /// Runs a stage. One that fails is told and remembered, and the run goes on: a change should learn all that is
    /// wrong with it at once.
    pub fn stage(&mut self, name: &'static str, work: impl FnOnce() -> (Tally, Result<(), Failure>)) {
        println!("\n=== {name}");
        let start = Instant::now();
        let (tally, result) = work();
        self.finish(name, start.elapsed(), tally, result);
    }

    fn finish(&mut self, name: &'static str, time: Duration, mut tally: Tally, result: Result<(), Failure>) {
        let trouble = result.err().map(|failure| failure.to_string());
        if trouble.is_some() && tally.failed == 0 {
            tally.failed = 1;
        }
        match &trouble {
            None => println!("--- {name}: ok, {:.1} s", time.as_secs_f64()),
            Some(trouble) => println!("--- {name}: FAILED, {:.1} s: {trouble}", time.as_secs_f64()),
        }
        self.finished.push(Finished { name, time, tally, trouble });
    }

    /// A stage that is one check.
    pub fn check(&mut self, name: &'static str, work: impl FnOnce() -> Result<(), Failure>) {
        self.stage(name, || match work() {
            Ok(()) => (Tally::PASSED, Ok(())),
            Err(failure) => (Tally::default(), Err(failure)),
        });
    }

    /// Waits for the stages that run beside, and tells of them as of any other.
    pub fn join(&mut self, beside: Beside) {
        for (name, time, ended) in beside.0.join().expect("what runs commands does not panic") {
            println!("\n=== {name}, which ran beside others");
            let result = ended.and_then(|Ended { said, code }| {
                print!("{}{}", said.err, said.out);
                // What went wrong is the last that it said.
                let last = said.err.trim_end().lines().next_back().unwrap_or("it was stopped");
                let trouble = last.trim_start_matches("error: ").to_owned();
                if code == Some(0) { Ok(()) } else { Err(Failure::Found(trouble)) }
            });
            let tally = if result.is_ok() { Tally::PASSED } else { Tally::default() };
            self.finish(name, time, tally, result);
        }
    }

    /// Prints a line for each stage and, last, the sum. Whether everything passed.
    pub fn summary(self) -> bool {
        println!("\n{:<28} {:>8} {:>7} {:>7}", "stage", "time/s", "passed", "failed");
        let mut sum = Tally::default();
        for stage in &self.finished {
            let Tally { passed, failed } = stage.tally;
            println!("{:<28} {:>8.1} {passed:>7} {failed:>7}", stage.name, stage.time.as_secs_f64());
            sum += stage.tally;
        }
        println!("{:<28} {:>8.1} {:>7} {:>7}\n", "all", self.begun.elapsed().as_secs_f64(), sum.passed, sum.failed);
        for stage in &self.finished {
            if let Some(trouble) = &stage.trouble {
                println!("{}: {trouble}", stage.name);
            }
        }
        println!("{} passed, {} failed", sum.passed, sum.failed);
        sum.failed == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nextest_is_counted_by_its_last_summary() {
        let text =
            "    Starting 3 tests\n     Summary [   0.004s] 134 tests run: 130 passed (2 slow), 4 failed, 2 skipped\n";
        assert_eq!(Tally::of_test_output(text), Tally { passed: 130, failed: 4 });
    }

    #[test]
    fn a_test_that_timed_out_has_failed() {
        let text = "Summary [ 60.0s] 3 tests run: 2 passed, 1 timed out, 0 skipped";
        assert_eq!(Tally::of_test_output(text), Tally { passed: 2, failed: 1 });
    }

    #[test]
    fn the_standard_harness_is_summed() {
        let text = "test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out\n\
                    test result: FAILED. 1 passed; 2 failed; 0 ignored\n";
        assert_eq!(Tally::of_test_output(text), Tally { passed: 4, failed: 2 });
    }

    #[test]
    fn no_summary_counts_nothing() {
        assert_eq!(Tally::of_test_output("error: could not compile"), Tally::default());
    }

    #[test]
    fn what_ran_beside_is_counted_and_its_last_words_are_the_trouble() {
        let shell = |words| {
            let mut command = Command::new("sh");
            command.args(["-c", words]);
            command
        };
        let mut run = Run::default();
        run.join(Beside::start(vec![
            ("good", shell("true")),
            ("bad", shell("echo first >&2; echo error: last >&2; exit 1")),
        ]));
        let stages: Vec<_> =
            run.finished.iter().map(|stage| (stage.name, stage.tally, stage.trouble.as_deref())).collect();
        let failed = Tally { passed: 0, failed: 1 };
        assert_eq!(stages, [("good", Tally::PASSED, None), ("bad", failed, Some("last"))]);
        assert!(!run.summary());
    }

    #[test]
    fn a_failed_stage_fails_the_run_though_no_test_was_counted() {
        let mut run = Run::default();
        run.check("good", || Ok(()));
        run.check("bad", || Err(Failure::Found("no".into())));
        assert!(!run.summary());
    }
}
