//! What came of fuzzing a target, by what libFuzzer says.

use crate::in_root;
use crate::process::Failure;

/// Lines of a finding that are shown: what was promised, and where it was broken.
const LINES_SHOWN: usize = 12;

/// What came of a target.
#[derive(Debug, PartialEq)]
pub struct Report {
    target: String,
    seconds: u64,
    executions: u64,
    /// Places in the code that were reached.
    coverage: u64,
    finding: Option<Finding>,
}

/// What a target did not stand.
#[derive(Debug, PartialEq)]
struct Finding {
    /// The file with the input, if there is one.
    input: Option<String>,
    /// What was said of it.
    what: String,
}

impl Report {
    /// By what the program said, and by its exit code.
    pub fn of(target: &str, said: &str, code: Option<i32>) -> Self {
        let number = |line: &str| line.split_whitespace().next().and_then(|word| word.parse().ok());
        let last = |mark: &str| said.lines().rev().find_map(|line| number(line.split_once(mark)?.1)).unwrap_or(0);
        let after_done = |line: &str| line.split_once(" runs in ").and_then(|(_, rest)| number(rest));
        let finding = (code != Some(0)).then(|| Finding {
            input: said.lines().rev().find_map(|line| line.split_once("Test unit written to ")).map(|(_, p)| p.into()),
            what: excerpt(said),
        });
        Self {
            target: target.to_owned(),
            seconds: said.lines().rev().find_map(after_done).unwrap_or(0),
            executions: last("stat::number_of_executed_units:"),
            coverage: last(" cov: "),
            finding,
        }
    }
}

/// The lines from a panic or an error on, without those of the machinery below it.
fn excerpt(said: &str) -> String {
    let begins = |line: &&str| line.contains("panicked at") || line.contains("ERROR: libFuzzer");
    let start = said.lines().position(|line| begins(&line));
    let skipped = start.unwrap_or_else(|| said.lines().count().saturating_sub(LINES_SHOWN));
    said.lines().skip(skipped).take(LINES_SHOWN).map(|line| format!("    {line}\n")).collect()
}

/// Prints the table and each finding with the command that shows it again; an error if there is one.
pub fn conclude(mut reports: Vec<Report>) -> Result<(), Failure> {
    reports.sort_by(|a, b| a.target.cmp(&b.target));
    println!(
        "{:<12} {:>8} {:>12} {:>14} {:>9} {:>9}",
        "target", "time/s", "executions", "executions/s", "coverage", "findings"
    );
    for Report { target, seconds, executions, coverage, finding } in &reports {
        let (rate, findings) = (executions / (*seconds).max(1), u8::from(finding.is_some()));
        println!("{target:<12} {seconds:>8} {executions:>12} {rate:>14} {coverage:>9} {findings:>9}");
    }
    let found: Vec<_> =
        reports.iter().filter_map(|report| report.finding.as_ref().map(|it| (&report.target, it))).collect();
    for (target, Finding { input, what }) in &found {
        println!("\n{target}:\n{what}");
        if let Some(input) = input {
            let root = format!("{}/", in_root("").display());
            let input =
                input.strip_prefix(root.trim_end_matches('/')).map_or(&input[..], |rest| rest.trim_start_matches('/'));
            println!("    again: cargo xtask fuzz {target} --input {input}");
        }
    }
    if found.is_empty() {
        return Ok(());
    }
    let names: Vec<_> = found.iter().map(|(target, _)| target.as_str()).collect();
    Err(Failure::Found(format!("fuzzing has found something in {}", names.join(", "))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_without_a_finding_is_counted() {
        let said = "#2\tINITED cov: 5 ft: 6 corp: 1/1b\n#900\tNEW    cov: 12 ft: 30 corp: 3/9b\n#1000\tDONE   cov: 14 ft: 31\n\
                    Done 1000 runs in 21 second(s)\nstat::number_of_executed_units: 1000\nstat::average_exec_per_sec:     47\n";
        let report = Report { target: "frame".into(), seconds: 21, executions: 1_000, coverage: 14, finding: None };
        assert_eq!(Report::of("frame", said, Some(0)), report);
    }

    #[test]
    fn a_panic_is_told_with_its_place_and_input() {
        let said = "#2\tINITED cov: 5 ft: 6\n\nthread 'main' panicked at src/frame.rs:5:\nall bytes are taken\n\
                    artifact_prefix='/x/'; Test unit written to /x/crash-12\nstat::number_of_executed_units: 7\n";
        let report = Report::of("frame", said, Some(77));
        let finding = report.finding.as_ref().unwrap();
        assert_eq!((report.executions, finding.input.as_deref()), (7, Some("/x/crash-12")));
        assert!(finding.what.starts_with("    thread 'main' panicked at src/frame.rs:5:\n    all bytes are taken\n"));
        assert!(conclude(vec![report]).is_err());
    }

    #[test]
    fn a_program_that_says_nothing_and_fails_is_a_finding() {
        assert!(Report::of("frame", "", None).finding.is_some());
        assert!(conclude(vec![Report::of("frame", "Done 0 runs in 0 second(s)", Some(0))]).is_ok());
    }
}
