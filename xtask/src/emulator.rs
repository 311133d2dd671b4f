//! The shoe's code on an emulated Cortex-M4F: its bits must be the host's, and its cost within the budget.

mod budget;

use crate::cost::{self, Cost};
use crate::process::{self, Failure, Said};
use crate::{device, in_root, tools};
use std::process::Command;
use std::time::Duration;

/// An emulated run takes seconds; this is for one that hangs.
const LIMIT: Duration = Duration::from_secs(600);

/// Runs the self-test on the host and in the emulator, compares the fingerprints, and prints what the emulator counted.
pub fn run() -> Result<(), Failure> {
    tools::QEMU.required()?;
    let route = device::Route::find()?;
    let mut build = route.build(&in_root("firmware/emulator"));
    process::run(build.args(["--bin", "sohle-emulator", "--features", "documented"]))?;
    let emulated = emulate()?.out;
    let native = process::read(&mut Command::new(process::build("dev", "--example", "selftest")?))?.out;

    let pairs = compare(&lines(&native, ""), &lines(&emulated, "bits "))?;
    println!("{pairs} fingerprints of host and Cortex-M4F are equal:");
    print!("{native}");
    for rate in ["200", "2000"] {
        let both = |phase| {
            Ok::<_, Failure>((
                phase,
                cost(&emulated, "default", rate, phase)?,
                cost(&emulated, "documented", rate, phase)?,
            ))
        };
        let (swinging, standing) = (both("swinging")?, both("standing")?);
        let mean = ("mean", swinging.1.and(standing.1), swinging.2.and(standing.2));
        let title = format!("\ninstructions for each IMU sample at {rate} Hz (Cortex-M4F)");
        print!("{}", cost::table(&title, &[swinging, standing, mean]));
    }
    println!("\nthe tracker on the Cortex-M4F");
    for line in lines(&emulated, "told ") {
        println!("  {line}");
    }
    let (table, over) = budget::table(&lines(&emulated, "part "), &budget::read()?)?;
    print!("{table}");
    if over.is_empty() { Ok(()) } else { Err(Failure::Found(over.join("; "))) }
}

/// What the emulator counted: lines of setting, rate, phase, samples, instructions.
fn cost(emulated: &str, setting: &str, rate: &str, phase: &str) -> Result<Cost, Failure> {
    let start = format!("cost {setting} {rate} {phase} ");
    let numbers: Vec<u64> =
        lines(emulated, &start).iter().flat_map(|line| line.split(' ')).map_while(|word| word.parse().ok()).collect();
    match numbers[..] {
        [count, instructions] => Ok(Cost { count, instructions }),
        _ => Err(Failure::Found(format!("the emulator told no cost of {setting}, {phase}, at {rate} Hz"))),
    }
}

fn emulate() -> Result<Said, Failure> {
    let words = "-machine mps2-an386 -display none -monitor none -serial none \
                 -semihosting-config enable=on,target=native -icount shift=0 -kernel";
    let mut command = process::program("qemu-system-arm", words.split_whitespace());
    process::read_within(command.arg(device::binary("sohle-emulator")), LIMIT)
}

/// The lines of `text` that begin with `start`, without it.
fn lines<'a>(text: &'a str, start: &str) -> Vec<&'a str> {
    text.lines().filter_map(|line| line.strip_prefix(start)).collect()
}

/// How many fingerprints there are; an error if one differs or is missing on one side.
fn compare(native: &[&str], emulated: &[&str]) -> Result<usize, Failure> {
    if native.is_empty() || native.len() != emulated.len() {
        let counts = (native.len(), emulated.len());
        return Err(Failure::Found(format!("{} fingerprints on the host, {} in the emulator", counts.0, counts.1)));
    }
    match native.iter().zip(emulated).find(|(native, emulated)| native != emulated) {
        None => Ok(native.len()),
        Some((native, emulated)) => {
            Err(Failure::Found(format!("the bits differ: host `{native}`, Cortex-M4F `{emulated}`")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_fingerprints_are_counted_and_others_are_told() {
        assert_eq!(compare(&["a 1", "b 2"], &["a 1", "b 2"]).ok(), Some(2));
        let told =
            |native: &[&str], emulated: &[&str]| compare(native, emulated).err().map(|failure| failure.to_string());
        assert_eq!(told(&["a 1"], &["a 2"]).as_deref(), Some("the bits differ: host `a 1`, Cortex-M4F `a 2`"));
        assert_eq!(told(&["a 1"], &[]).as_deref(), Some("1 fingerprints on the host, 0 in the emulator"));
        assert!(told(&[], &[]).is_some());
    }

    #[test]
    fn the_cost_is_read_from_what_the_emulator_says() {
        let text = "bits default 1\ncost default 200 swinging 2 90\ncost default 200 standing 1 70\n";
        assert_eq!(cost(text, "default", "200", "swinging").ok(), Some(Cost { count: 2, instructions: 90 }));
        assert!(cost(text, "default", "2000", "swinging").is_err());
    }
}
