//! `sohle pair`: lets a laptop pair with a shoe by Bluetooth.

use super::{Error, command, print};
use crate::link::{Address, Connection};
use sohle_shared::wire::message::Action;

/// Opens a shoe's pairing window over its cable
#[derive(Debug, clap::Args)]
#[command(
    after_help = "A shoe pairs only while its window is open, and whoever has its cable may open it; its button does the same.\n\
While it is open, pair from the laptop that is to be known: 'bluetoothctl pair ADDRESS' on Linux, the settings elsewhere.\n\n\
Examples:\n  sohle pair serial:/dev/ttyACM0\n  sohle pair serial:/dev/ttyACM0 --seconds 120"
)]
pub struct Args {
    /// Where the shoe's cable is: a serial port, at 921600 baud unless it says otherwise, or a network port
    #[arg(value_name = "serial:PATH[@BAUD]|tcp:HOST:PORT")]
    address: Address,
    /// How long the window stays open; 0 closes it
    #[arg(long, value_name = "SECONDS", default_value_t = 60, value_parser = clap::value_parser!(u16).range(0..=600))]
    seconds: u16,
}

/// Connects and asks.
pub fn run(args: Args) -> Result<(), Error> {
    let mut connection = Connection::open(args.address).leaving_steps();
    command::connect(&mut connection)?;
    connection.ask(Action::Pair(args.seconds), &mut |_, _| {})?;
    match args.seconds {
        0 => print("the pairing window is closed\n"),
        seconds => print(&format!("the pairing window is open for {seconds} s\n")),
    }
}
