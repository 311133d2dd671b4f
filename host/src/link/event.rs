//! What a [`Session`](super::session::Session) tells.

use sohle_shared::wire::message::{Attitude, Hello, Log, Outcome, Raw, Status};
use sohle_shared::wire::packed::PackedStep;
use sohle_shared::wire::{PROTOCOL, SCHEMA};

/// What the shoe told, or what became of the connection.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The shoe speaks the same protocol and has accepted this program; again when the line was opened anew or the shoe was
    /// rebooted.
    Connected(Hello),
    /// The shoe speaks another protocol or has other messages; [`mismatch`] says it in words.
    Refused(Hello),
    /// The shoe starts anew: its clock, the numbers of its steps and its tracker.
    Rebooted {
        /// The new boot.
        boot: u32,
    },
    /// A step; each comes once, in the order of the numbers.
    Step {
        /// The boot it belongs to.
        boot: u32,
        /// Counts up by one with each step since the boot.
        id: u32,
        /// The step.
        step: PackedStep,
    },
    /// Steps that are lost: the shoe ran out of room before they were acknowledged.
    Gap {
        /// The boot they belong to.
        boot: u32,
        /// The number of the first.
        first: u32,
        /// How many.
        count: u32,
    },
    /// How the shoe is.
    Status(Status),
    /// Where the foot is.
    Attitude(Attitude),
    /// What went into the tracker.
    Raw(Raw),
    /// A line for the log.
    Log(Log),
    /// A command was answered.
    Reply {
        /// As [`Session::command`](super::session::Session::command) returned it.
        number: u32,
        /// What became of it.
        outcome: Outcome,
    },
    /// The foot stands still, and the sensor sleeps: until it wakes, little is heard of the shoe.
    Asleep,
    /// The sensor was woken, by motion or by a command.
    Woken,
    /// Nothing was heard for three seconds, or sixteen of a shoe that sleeps.
    Silent,
    /// Something was heard again.
    Back,
}

/// Why this program and that shoe do not understand each other, and what helps.
pub fn mismatch(hello: &Hello) -> String {
    let Hello { protocol, schema, firmware, board, .. } = hello;
    let own = env!("CARGO_PKG_VERSION");
    format!(
        "the shoe ({board}, firmware {firmware}) speaks protocol {protocol} with messages {schema:016x}, this program \
         (version {own}) protocol {PROTOCOL} with messages {SCHEMA:016x}: flash the firmware that was built with this \
         program, or run the program that was built with firmware {firmware}"
    )
}
