//! `sohle command`: one thing asked of a shoe.

use super::{Error, parameters, print};
use crate::calibration;
use crate::export::file;
use crate::link::connection::Happening;
use crate::link::event::{Event, mismatch};
use crate::link::{Address, Connection};
use clap::ValueEnum;
use sohle_shared::step::FloorMode;
use sohle_shared::tracker::Order;
use sohle_shared::wire::message::Action;
use sohle_shared::wire::transfer::{Item, Value};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Asks something of a shoe
#[derive(Debug, clap::Args)]
#[command(after_help = "A shoe speaks to one program at a time: a 'sohle live' that runs has to say hello anew.\n\
Steps that wait on the shoe stay there for 'sohle live'.\n\n\
Examples:\n  sohle command serial:/dev/ttyACM0 reset\n  sohle command tcp:127.0.0.1:7700 parameters get mine.toml\n  \
sohle command serial:/dev/ttyACM0 calibration set calibration.toml")]
pub struct Args {
    /// Where the shoe is: a serial port, at 921600 baud unless it says otherwise, or a network port
    #[arg(value_name = "serial:PATH[@BAUD]|tcp:HOST:PORT|ble:SHOE")]
    address: Address,
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// The tracker begins anew
    Reset,
    /// The tracker waits for a rest and starts from there
    Init,
    /// The tracker starts from the next stance, without waiting for a rest
    Track,
    /// What the ground does, as a map knows it
    FloorMode {
        /// The ground
        #[arg(value_enum)]
        ground: Ground,
    },
    /// All steps that were not acknowledged are sent again
    Resend,
    /// The settings of the tracker, as 'sohle parameters' prints them
    Parameters {
        #[command(subcommand)]
        access: Access,
    },
    /// The calibration of the sensor, as 'sohle calibrate' writes it
    Calibration {
        #[command(subcommand)]
        access: Access,
    },
}

#[derive(Debug, clap::Subcommand)]
enum Access {
    /// Reads them from the shoe
    Get {
        /// Where they are written; the standard output when left out
        file: Option<PathBuf>,
    },
    /// Gives them to the shoe, which keeps them
    Set {
        /// Where they are read from
        file: PathBuf,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Ground {
    /// A level floor
    Level,
    /// Stairs or a ramp
    Stairs,
    /// An elevator
    Elevator,
    /// The tracker decides from the motion
    Auto,
}

/// How long a shoe is looked for.
const PATIENCE: Duration = Duration::from_secs(10);

/// Connects, asks, tells.
pub fn run(args: Args) -> Result<(), Error> {
    // What cannot be read needs no shoe.
    let value = match &args.what {
        What::Parameters { access: Access::Set { file } } => Some(Value::Parameters(parameters::read(file)?)),
        What::Calibration { access: Access::Set { file } } => Some(Value::Calibration(calibration::read(file)?)),
        _ => None,
    };
    let mut connection = Connection::open(args.address).leaving_steps();
    connect(&mut connection)?;
    if let Some(value) = value {
        connection.write(&value, &mut |_, _| {})?;
        return print("done\n");
    }
    let order = |order| Action::Order(order);
    let action = match args.what {
        What::Reset => order(Order::Reset),
        What::Init => order(Order::Init),
        What::Track => order(Order::Track),
        What::FloorMode { ground } => order(Order::FloorMode(match ground {
            Ground::Level => Some(FloorMode::Level),
            Ground::Stairs => Some(FloorMode::Stairs),
            Ground::Elevator => Some(FloorMode::Elevator),
            Ground::Auto => None,
        })),
        What::Resend => Action::Resend,
        What::Parameters { access } => return get(&mut connection, Item::Parameters, access),
        What::Calibration { access } => return get(&mut connection, Item::Calibration, access),
    };
    connection.ask(action, &mut |_, _| {})?;
    print("done\n")
}

/// Waits for the shoe to accept this program.
pub fn connect(connection: &mut Connection) -> Result<(), Error> {
    let until = Instant::now() + PATIENCE;
    let mut why = String::from("no shoe answered");
    loop {
        let left = until.saturating_duration_since(Instant::now());
        match connection.next(left) {
            Some(Happening::Event(Event::Connected(_))) => return Ok(()),
            Some(Happening::Event(Event::Refused(hello))) => return Err(Error::new(mismatch(&hello))),
            Some(Happening::Unreachable(reason)) => why = reason,
            None if left.is_zero() => return Err(Error::new(format!("{why} within {} s", PATIENCE.as_secs()))),
            _ => {}
        }
    }
}

fn get(connection: &mut Connection, item: Item, access: Access) -> Result<(), Error> {
    let text = match connection.read(item, &mut |_, _| {})? {
        Value::Parameters(parameters) => toml::to_string(&parameters)?,
        Value::Calibration(calibration) => toml::to_string(&calibration)?,
    };
    match access {
        Access::Get { file: Some(path) } => Ok(file::write(&path, text.as_bytes())?),
        Access::Get { file: None } | Access::Set { .. } => print(&text),
    }
}
