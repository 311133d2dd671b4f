//! `sohle ports`: where shoes may be.

use super::{Error, print};
use crate::link::bluetooth::{self, radio::Sighting};
use serialport::{SerialPortInfo, SerialPortType};
use std::time::Duration;

/// Lists the serial ports of this machine and the shoes on Bluetooth
#[derive(Debug, clap::Args)]
#[command(after_help = "What is listed first in a line is what 'sohle live' takes.\n\n\
Examples:\n  sohle ports\n  sohle ports --seconds 20\n  sohle live ble:any")]
pub struct Args {
    /// How long Bluetooth is listened to; 0 leaves it out
    #[arg(long, value_name = "SECONDS", default_value_t = 4.0)]
    seconds: f64,
}

/// Looks and lists.
pub fn run(args: Args) -> Result<(), Error> {
    if !(0.0..=3_600.0).contains(&args.seconds) {
        return Err(Error::new(format!("--seconds {}: expected 0 to 3600", args.seconds)));
    }
    let ports = serialport::available_ports().unwrap_or_default();
    print(&ports.iter().map(serial).collect::<String>())?;
    if args.seconds == 0.0 {
        return Ok(());
    }
    let shoes =
        bluetooth::in_range(Duration::from_secs_f64(args.seconds)).map_err(|fault| Error::new(fault.to_string()))?;
    if shoes.is_empty() {
        eprintln!("no shoe is heard on Bluetooth");
    }
    print(&shoes.iter().map(shoe).collect::<String>())
}

fn serial(port: &SerialPortInfo) -> String {
    let what = match &port.port_type {
        SerialPortType::UsbPort(usb) => usb.product.clone().unwrap_or_else(|| "USB".into()),
        SerialPortType::BluetoothPort => "Bluetooth".into(),
        SerialPortType::PciPort | SerialPortType::Unknown => String::new(),
    };
    format!("{:<28}  {what}", format!("serial:{}", port.port_name)).trim_end().to_owned() + "\n"
}

fn shoe(shoe: &Sighting) -> String {
    let signal = shoe.signal_dbm.map_or(String::new(), |signal| format!("{signal} dBm"));
    format!("{:<28}  {}  {signal}", format!("ble:{}", shoe.label()), shoe.address).trim_end().to_owned() + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shoe_is_listed_as_it_is_connected_to() {
        let heard = |name: Option<&str>, signal_dbm| Sighting {
            name: name.map(str::to_owned),
            address: "C0:5E:00:00:00:0A".into(),
            signal_dbm,
        };
        let line = shoe(&heard(Some("Sohle-000A"), Some(-61)));
        assert_eq!(line, "ble:Sohle-000A                C0:5E:00:00:00:0A  -61 dBm\n");
        let line = shoe(&heard(None, None));
        assert_eq!(line, "ble:C0:5E:00:00:00:0A         C0:5E:00:00:00:0A\n");
    }
}
