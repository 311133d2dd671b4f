//! The same input must give the same output: in debug and release builds, on one thread and on two, and as it was when the
//! accuracy table was last written.

use crate::process::{self, Failure};
use crate::together;
use std::process::Command;

/// The scores of the manifest, as far as they matter here.
#[derive(serde::Deserialize)]
struct Scores {
    recordings: Vec<Recording>,
    outputs_hash: String,
}

#[derive(serde::Deserialize)]
struct Recording {
    status: String,
}

/// The table that `sohle evaluate` printed last; a change of accuracy shows as a change of this file.
const TABLE: &str = "tests/accuracy.txt";

/// Runs the evaluation in all ways and compares the hash over everything it put out.
pub fn run() -> Result<(), Failure> {
    let mut ways = Vec::new();
    for profile in ["dev", "release"] {
        let program = process::build(profile, "--bin", "sohle")?;
        ways.extend(["1", "2"].map(|threads| (profile, program.clone(), threads)));
    }
    // The hash must not depend on what else runs, so they need not wait for each other.
    let evaluated = together::each(ways, together::processors(), |(profile, program, threads)| {
        let mut command = Command::new(program);
        command.current_dir(crate::root()).args(["evaluate", "--format", "json", "--threads", threads]);
        Ok((format!("{profile} build, {threads} threads"), read(&process::read(&mut command)?.out)?))
    })?;
    let mut seen: Vec<(String, String)> = Vec::new();
    let mut whole = true;
    for (way, scores) in evaluated {
        let scored = scores.recordings.iter().filter(|recording| recording.status == "scored").count();
        println!("{} {way}: {scored} of {} results scored", scores.outputs_hash, scores.recordings.len());
        whole &= scored == scores.recordings.len();
        seen.push((way, scores.outputs_hash));
    }
    compare(&seen)?;
    if !whole {
        println!("not all recordings are here, so {TABLE} is not compared");
        return Ok(());
    }
    let table = std::fs::read_to_string(crate::root().join(TABLE))
        .map_err(|error| Failure::Found(format!("{TABLE}: {error}")))?;
    is_of(&table, &seen[0].1)
}

fn is_of(table: &str, hash: &str) -> Result<(), Failure> {
    if table.contains(hash) {
        return Ok(());
    }
    let cure = format!("if that is meant, look at what 'sohle evaluate > {TABLE}' changes and commit it");
    Err(Failure::Found(format!("{TABLE} is of other outputs than {hash}; {cure}")))
}

fn read(text: &str) -> Result<Scores, Failure> {
    serde_json::from_str(text).map_err(|error| Failure::Found(format!("sohle evaluate --format json: {error}")))
}

fn compare(seen: &[(String, String)]) -> Result<(), Failure> {
    for ((first, one), (second, other)) in seen.iter().zip(seen.iter().skip(1)) {
        if one != other {
            return Err(Failure::Found(format!("the outputs differ: {first} gives {one}, {second} gives {other}")));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_different_hash_is_told_with_both_ways() {
        let seen = |hashes: [&str; 3]| {
            let ways = ["dev build, 1 threads", "dev build, 2 threads", "release build, 1 threads"];
            ways.iter().zip(hashes).map(|(way, hash)| ((*way).to_owned(), hash.to_owned())).collect::<Vec<_>>()
        };
        assert!(compare(&seen(["a", "a", "a"])).is_ok());
        let told = compare(&seen(["a", "a", "b"])).err().map(|failure| failure.to_string()).unwrap_or_default();
        assert_eq!(told, "the outputs differ: dev build, 2 threads gives a, release build, 1 threads gives b");
    }

    #[test]
    fn a_table_of_other_outputs_is_refused() {
        assert!(is_of("outputs hash ab12\n", "ab12").is_ok());
        assert!(is_of("outputs hash ab12\n", "cd34").is_err());
    }

    #[test]
    fn only_what_is_needed_is_read() {
        let text = r#"{"recordings": [{"name": "a", "status": "scored", "steps": 4}], "outputs_hash": "ab"}"#;
        assert_eq!(read(text).unwrap().outputs_hash, "ab");
        assert!(read("{}").is_err());
    }
}
