//! The tracker on an emulated Cortex-M4F: its bits must be the host's, and its cost is told.

use crate::cost::{self, Cost, Phases};
use crate::process::{self, Failure, Said};
use crate::{device, in_root, tools};
use std::time::Duration;

/// An emulated run takes seconds; this is for one that hangs.
const LIMIT: Duration = Duration::from_secs(600);

/// Runs the self-test on the host and in the emulator, compares the fingerprints, and prints what the emulator counted.
pub fn run() -> Result<(), Failure> {
    tools::QEMU.required()?;
    let route = device::Route::find()?;
    process::run(&mut route.build(&in_root("firmware/emulator")))?;
    let emulated = emulate()?.out;
    let mut command = process::cargo();
    command.args(["run", "--quiet", "--locked", "--package", "sohle-shared", "--example", "selftest"]);
    let native = process::read(&mut command)?.out;

    let pairs = compare(&lines(&native, ""), &lines(&emulated, "bits "))?;
    println!("{pairs} fingerprints of host and Cortex-M4F are equal:");
    print!("{native}");
    println!("\ninstructions for each IMU sample at 200 Hz (Cortex-M4F)");
    println!("{}", cost::table(phases(&emulated, "default")?, phases(&emulated, "documented")?));
    println!("most instructions for a sample, and depth of the stack in bytes with the tracker on it");
    for line in lines(&emulated, "most ").iter().chain(&lines(&emulated, "stack ")) {
        println!("{line}");
    }
    Ok(())
}

/// What the emulator counted: lines of setting, phase, samples, instructions.
fn phases(emulated: &str, setting: &str) -> Result<Phases, Failure> {
    let phase = |name: &str| {
        let start = format!("cost {setting} {name} ");
        let numbers: Vec<u64> =
            lines(emulated, &start).first()?.split(' ').map_while(|word| word.parse().ok()).collect();
        match numbers[..] {
            [samples, instructions] => Some(Cost { samples, instructions }),
            _ => None,
        }
    };
    match (phase("swinging"), phase("standing")) {
        (Some(swinging), Some(standing)) => Ok(Phases { swinging, standing }),
        _ => Err(Failure::Found(format!("the emulator told no cost of the {setting} setting"))),
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
        let text = "bits default 1\ncost default swinging 2 90\ncost default standing 1 70\n";
        let cost = |samples, instructions| Cost { samples, instructions };
        assert_eq!(phases(text, "default").ok(), Some(Phases { swinging: cost(2, 90), standing: cost(1, 70) }));
        assert!(phases(text, "documented").is_err());
    }
}
