//! Where the shoe is: the text `serial:PATH[@BAUD]`, `tcp:HOST:PORT` or `ble:NAME|ADDRESS|any`.

use super::bluetooth::wanted::Wanted;
use std::fmt;
use std::str::FromStr;

/// Of the shoe's UART. **Units:** baud.
pub const DEFAULT_BAUD: u32 = 921_600;

/// Where the shoe is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// A serial port.
    Serial {
        /// As the system names it, `/dev/ttyACM0` or `COM3`.
        path: String,
        /// **Units:** baud.
        baud: u32,
    },
    /// A port of the network: the emulated shoe, or a bridge to a serial port.
    Tcp {
        /// Name or number; one of IPv6 without its brackets.
        host: String,
        /// Number of the port.
        port: u16,
    },
    /// A shoe on Bluetooth.
    Bluetooth(Wanted),
}

/// What addresses begin with.
const KINDS: [&str; 3] = ["serial:", "tcp:", "ble:"];

impl Address {
    /// Whether the text is meant as an address, be it a right one or not.
    pub fn is_meant(text: &str) -> bool {
        KINDS.iter().any(|kind| text.starts_with(kind))
    }
}

/// A text that is no address.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{text}': {fault}; expected serial:/dev/ttyACM0[@{DEFAULT_BAUD}], tcp:HOST:PORT or ble:NAME|ADDRESS|any")]
pub struct AddressError {
    text: String,
    fault: &'static str,
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        parse(text).map_err(|fault| AddressError { text: text.to_owned(), fault })
    }
}

fn parse(text: &str) -> Result<Address, &'static str> {
    match text.split_once(':') {
        Some(("serial", place)) => {
            let (path, baud) = match place.rsplit_once('@') {
                Some((path, baud)) => (path, baud.parse().ok().filter(|&baud| baud > 0)),
                None => (place, Some(DEFAULT_BAUD)),
            };
            let baud = baud.ok_or("the baud rate behind '@' is no whole number above 0")?;
            if path.is_empty() {
                return Err("no serial port is named");
            }
            Ok(Address::Serial { path: path.to_owned(), baud })
        }
        Some(("tcp", place)) => {
            let (host, port) = place.rsplit_once(':').ok_or("no port is named")?;
            let port = port.parse().ok().filter(|&port| port > 0).ok_or("the port is no number from 1 to 65535")?;
            let bare = host.strip_prefix('[').and_then(|host| host.strip_suffix(']'));
            if bare.is_none() && host.contains(':') {
                return Err("an IPv6 host stands in brackets");
            }
            let host = bare.unwrap_or(host);
            if host.is_empty() {
                return Err("no host is named");
            }
            Ok(Address::Tcp { host: host.to_owned(), port })
        }
        Some(("ble", place)) => {
            Wanted::parse(place).map(Address::Bluetooth).ok_or("no shoe is named; 'sohle ports' lists those in range")
        }
        _ => Err("neither 'serial:' nor 'tcp:' nor 'ble:'"),
    }
}

impl fmt::Display for Address {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial { path, baud } => write!(out, "serial:{path}@{baud}"),
            Self::Tcp { host, port } if host.contains(':') => write!(out, "tcp:[{host}]:{port}"),
            Self::Tcp { host, port } => write!(out, "tcp:{host}:{port}"),
            Self::Bluetooth(wanted) => write!(out, "ble:{wanted}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shown_is_read_back() {
        for text in ["serial:/dev/ttyACM0@921600", "serial:COM3@115200", "tcp:localhost:4000", "tcp:[::1]:4000"]
            .into_iter()
            .chain(["ble:any", "ble:Sohle-1A2B", "ble:C0:5E:00:00:00:0A"])
        {
            assert_eq!(text.parse::<Address>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn the_baud_rate_may_be_left_out() {
        let expected = Address::Serial { path: "/dev/ttyACM0".into(), baud: DEFAULT_BAUD };
        assert_eq!("serial:/dev/ttyACM0".parse(), Ok(expected));
    }

    #[test]
    fn what_is_wrong_is_told_with_what_was_expected() {
        for (text, fault) in [
            ("/dev/ttyACM0", "neither 'serial:' nor 'tcp:' nor 'ble:'"),
            ("udp:host:1", "neither 'serial:' nor 'tcp:' nor 'ble:'"),
            ("ble:", "no shoe is named; 'sohle ports' lists those in range"),
            ("serial:", "no serial port is named"),
            ("serial:@9600", "no serial port is named"),
            ("serial:/dev/ttyACM0@fast", "the baud rate behind '@' is no whole number above 0"),
            ("serial:/dev/ttyACM0@0", "the baud rate behind '@' is no whole number above 0"),
            ("tcp:host", "no port is named"),
            ("tcp:host:0", "the port is no number from 1 to 65535"),
            ("tcp:host:65536", "the port is no number from 1 to 65535"),
            ("tcp::4000", "no host is named"),
            ("tcp:::1:4000", "an IPv6 host stands in brackets"),
        ] {
            let told = text.parse::<Address>().unwrap_err().to_string();
            assert_eq!(
                told,
                format!(
                    "'{text}': {fault}; expected serial:/dev/ttyACM0[@921600], tcp:HOST:PORT or ble:NAME|ADDRESS|any"
                )
            );
        }
    }
}
